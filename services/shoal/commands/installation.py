"""Shoal itself: as a service, in other programs, and whether all of it is there."""

from __future__ import annotations

from pathlib import Path

import click

from shoal.commands import options
from shoal.commands.options import Out, Values
from shoal.errors import check_trusted
from shoal.ports import PORTS


@click.command()
@click.argument("engine", type=options.EngineName())
@click.option("--host", default="127.0.0.1", show_default=True)
@click.option(
    "--port",
    type=click.IntRange(1, 65535),
    metavar="PORT",
    help=", ".join(f"{port} {engine}" for engine, port in PORTS.items()) + ".",
)
@click.option("--certificate", type=click.Path(path_type=Path), help="Serve https with this certificate (PEM).")
@click.option("--key", type=click.Path(path_type=Path), help="The certificate's private key (PEM).")
def serve(engine: str, host: str, port: int | None, certificate: Path | None, key: Path | None) -> None:
    """Serve ENGINE over HTTP until Ctrl-C. SHOAL_API_* in the environment sets the limits."""
    from shoal.api.serve import serve

    serve(engine, host, port, certificate, key)


@click.command("export-fmu")
@click.argument("scene")
@options.values
@click.option(
    "--parameter",
    "parameters",
    multiple=True,
    metavar="PATH",
    help="A number of the scene that a host may set (repeatable); else gravity and the stated initial angles.",
)
@click.option(
    "--input",
    "inputs",
    multiple=True,
    metavar="PATH",
    help="A load's scale or torque, or a drive, that a host may change during the run (repeatable).",
)
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version: 2.0 or 3.0.")
@options.out(".fmu", otherwise="; else the scene's name")
def export_fmu(
    scene: str, values: Values, parameters: tuple[str, ...], inputs: tuple[str, ...], fmi: str, out: Out
) -> None:
    """Write SCENE as an FMI unit for co-simulation. A host needs this installation to run it."""
    from shoal.fmu.export import export
    from shoal.scene import load_scene
    from shoal.terminal import screen

    wanted = load_scene(scene).with_values(values)
    with screen.working(f"exporting {wanted.name}"):
        screen.compile_for("gauss", [1], wanted)
        written = export(wanted, parameters, out, inputs=inputs, fmi=fmi)
    click.echo(written)


@click.command()
@click.argument("scene")
@click.option(
    "--to",
    required=True,
    type=click.Choice(["exudyn", "mjcf"]),
    help="exudyn: a Python script that runs by itself; mjcf: MuJoCo's format, of rigid bodies.",
)
@options.values
@click.option("--verify/--no-verify", default=True, show_default=True, help="Run it there and here, and compare.")
@options.out(".py", ".xml", otherwise="; else the scene's name")
def export(scene: str, to: str, values: Values, verify: bool, out: Out) -> None:
    """Write SCENE as a file of another tool. The distance of its motion from ours is printed on stderr."""
    from shoal.exported import checked, export
    from shoal.scene import load_scene
    from shoal.terminal import screen

    wanted = load_scene(scene).with_values(values)
    with screen.working(f"exporting {wanted.name}"):
        done = export(wanted, checked(to, out), verify=verify)
    out = out or Path(done.name)
    done.save(out)
    if done.distance is not None:
        click.echo(f"{to}: its motion is within {done.distance:.2g} m of `shoal simulate`", err=True)
    click.echo(out)


@click.command("import")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--partial", is_flag=True, help="Write the scene although constraints of the file are not in it.")
@options.out(".yaml", otherwise="; else the file's name")
def import_scene(file: Path, partial: bool, out: Out) -> None:
    """Write the machine of FILE (URDF, or MuJoCo's MJCF) as a scene. What has no counterpart is listed on stderr."""
    import yaml

    from shoal.errors import InputError
    from shoal.imported import read
    from shoal.whole import whole

    found = read(file)
    if found.missing and not partial:
        others = f" (and {len(found.missing) - 1} more)" if len(found.missing) > 1 else ""
        what = f"{found.missing[0]}{others} has no counterpart: the scene would be another machine"
        raise InputError(f"{file}: {what}; --partial writes the rest")
    path = out or Path(f"{found.scene['name']}.yaml")
    with whole(path) as part:
        part.write_text(yaml.safe_dump(found.scene, sort_keys=False), encoding="utf-8")
    for line in found.left_out:
        mark = "; the scene is another machine" if line in found.missing else ""
        click.echo(f"left out: {line}{mark}", err=True)
    for line in found.notes:
        click.echo(f"note: {line}", err=True)
    for line in found.warnings:
        click.echo(f"note: MuJoCo says: {line}", err=True)
    click.echo(path)


@click.command()
@options.as_json
def doctor(as_json: bool) -> None:
    """Check the installation and say what is wrong. Engines, compiled kernels, pipeline, folders."""
    from shoal.doctor import examine
    from shoal.terminal import screen, tables

    checks = examine()
    ok = all(check.ok for check in checks)
    report = {"status": "ok" if ok else "failed", "checks": [vars(check) for check in checks]}
    screen.show(report, as_json, lambda: tables.doctor_table(checks))
    check_trusted(ok, "something is missing; see the table")
