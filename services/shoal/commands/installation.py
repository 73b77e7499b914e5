"""Shoal itself: as a service, in other programs, and whether all of it is there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from shoal.commands import options
from shoal.commands.command import command
from shoal.commands.options import Out
from shoal.errors import check_trusted
from shoal.ports import PORTS

if TYPE_CHECKING:
    from shoal.imported import Imported
    from shoal.requests.export import Export
    from shoal.requests.fmu import Fmu


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


@command("fmu", name="export-fmu")
@options.out(".fmu", otherwise="; else the scene's name")
def export_fmu(asked: Fmu, out: Out) -> None:
    """Write SCENE as an FMI unit for co-simulation. A host needs this installation to run it."""
    from shoal.fmu.export import export
    from shoal.notebook import machine
    from shoal.terminal import screen

    scene = machine(asked, options.note)
    with screen.working(f"exporting {scene.name}"):
        screen.compile_for("gauss", [1], scene)
        written = export(scene, asked.parameter, out, inputs=asked.input, fmi=asked.fmi)
    click.echo(written)


@command("export")
@options.out(".py", ".xml", otherwise="; else the scene's name")
def export(asked: Export, out: Out) -> None:
    """Write SCENE as a file of another tool. The distance of its motion from ours is printed on stderr."""
    from shoal.notebook import export, machine
    from shoal.terminal import screen

    scene = machine(asked, options.note)
    with screen.working(f"exporting {scene.name}"):
        done = export.answer(replace(asked.of(scene), file=out))
    if out is None:
        out = Path(done.name)
        done.save(out)
    if done.distance is not None:
        click.echo(f"{asked.to}: its motion is within {done.distance:.2g} m of `shoal simulate`", err=True)
    click.echo(out)


@click.command("import")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--partial", is_flag=True, help="Write the scene although constraints of the file are not in it.")
@click.option(
    "--root", type=click.Choice(["fixed", "floating"]), help="Whether the ground holds the root of a URDF file."
)
@click.option(
    "--argument", "stated", multiple=True, metavar="NAME=VALUE", help="An argument of the macros of a file (xacro)."
)
@click.option("--no-contacts", is_flag=True, help="Leave out the contacts of the file.")
@options.out(".yaml", otherwise="; else the file's name")
@options.as_json
def import_scene(
    file: Path, partial: bool, root: Any, stated: tuple[str, ...], no_contacts: bool, out: Out, as_json: bool
) -> None:
    """Write the machine of FILE (URDF, SDF or MuJoCo's MJCF) as a scene. What became what is listed on stderr."""
    from shoal.atomic_write import atomic_write
    from shoal.errors import InputError
    from shoal.imported import read
    from shoal.scene.edited import as_yaml
    from shoal.terminal import screen, tables

    if wrong := next((one for one in stated if "=" not in one), None):
        raise InputError(f"--argument: must be NAME=VALUE, found {wrong[:40]!r}")
    found = read(file, root, dict(one.split("=", 1) for one in stated), contacts=not no_contacts)
    if found.missing and not partial:
        others = f" (and {len(found.missing) - 1} more)" if len(found.missing) > 1 else ""
        what = f"{found.missing[0]}{others} has no counterpart: the scene would be another machine"
        raise InputError(f"{file}: {what}; --partial writes the rest")
    path = out or Path(f"{found.scene['name']}.yaml")
    with atomic_write(path) as part:
        part.write_text(as_yaml(found.scene), encoding="utf-8")
    report = {
        "status": "ok", "file": str(path), "rows": [one._asdict() for one in found.rows], "left_out": found.left_out,
        "missing": found.missing, "notes": found.notes, "warnings": found.warnings,
        "findings": [one.to_json() for one in found.findings],
    }  # fmt: skip
    screen.show(report, as_json, lambda: _show_import(found, path, tables))


def _show_import(found: Imported, path: Path, tables: Any) -> None:
    """Print the table and the lines of an import on stderr, and the path of the scene on stdout."""
    tables.import_table(found.rows)
    for line in found.left_out:
        mark = "; the scene is another machine" if line in found.missing else ""
        click.echo(f"left out: {line}{mark}", err=True)
    for line in found.notes:
        click.echo(f"note: {line}", err=True)
    for line in found.warnings:
        click.echo(f"note: MuJoCo says: {line}", err=True)
    for one in found.findings:
        if one.severity != "note":
            click.echo(f"{one.code}: {one.kind.meaning}", err=True)
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
