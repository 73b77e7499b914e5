"""The command line. Every command calls one plain function; heavy imports wait until they are needed."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

import click

from shoal.engines import COMPARED, ENGINES
from shoal.errors import InputError, ShoalError
from shoal.ports import PORTS
from shoal.whole import whole

EXIT_UNTRUSTED = 3
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""No room: on the disk, for this user, in this file."""
EXTRAS = {
    "pipeline": ("prefect", "mlflow", "jinja2", "shoal_flows"),
    "services": ("fastapi", "starlette", "uvicorn", "pydantic_settings", "orjson"),
    "fmu": ("pythonfmu",),
}
"""Modules that only an extra of the package brings."""


class Program(click.Group):
    """Turns every error a user is meant to read into one line and its exit status."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the program and leave with its exit status."""
        try:
            try:
                sys.exit(super().main(*args, **{**kwargs, "standalone_mode": False}))
            finally:
                sys.stdout.flush()  # here, where a full disk can still be told of
        except click.exceptions.NoArgsIsHelpError as error:
            click.echo(error.format_message())
            sys.exit(InputError.exit_status)
        except (ShoalError, click.ClickException) as error:
            message = error.format_message() if isinstance(error, click.ClickException) else str(error)
            if isinstance(error, click.UsageError) and error.ctx is not None:
                message = f"{message.rstrip('.')} (see `{error.ctx.command_path} --help`)"
            click.echo(f"shoal: {message}", err=True)
            sys.exit(getattr(error, "exit_status", InputError.exit_status))
        except click.Abort:
            click.echo("shoal: stopped", err=True)
            sys.exit(130)
        except OSError as error:
            if error.errno not in FULL:
                raise
            click.echo(f"shoal: cannot write: {error.strerror}", err=True)
            # What is still in the buffer of standard output would fail once more.
            os._exit(EXIT_UNTRUSTED)


def key_value(context: click.Context, parameter: click.Parameter, pairs: tuple[str, ...]) -> dict[str, str]:
    """PATH=VALUE pairs as a mapping."""
    found = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not (key and equals and value):
            raise click.BadParameter(f"{pair!r} is not PATH=VALUE")
        found[key.strip()] = value.strip()
    return found


def field_values(context: click.Context, parameter: click.Parameter, pairs: tuple[str, ...]) -> dict[str, Any]:
    """PATH=VALUE pairs; a value in brackets or braces is a list or a mapping as YAML writes it, `null` is nothing."""
    return {path: _structured(path, text) for path, text in key_value(context, parameter, pairs).items()}


def _structured(path: str, text: str) -> Any:
    if text == "null":
        return None
    if text[0] not in "[{":
        return text
    from shoal.scene.load import read_yaml

    try:
        return read_yaml(text, path)
    except InputError:
        raise click.BadParameter(
            f"{path}: {text!r} is neither a list such as [0, -9.81] nor a mapping such as {{angle: 0.6}}"
        ) from None


def recordings(
    context: click.Context, parameter: click.Parameter, given: tuple[str, ...]
) -> str | dict[str, str] | None:
    """FILE, or NAME=FILE once or more."""
    if len(given) == 1 and ("=" not in given[0] or Path(given[0]).exists()):
        return given[0]
    if bare := [one for one in given if "=" not in one]:
        raise click.BadParameter(f"{bare[0]!r} is not NAME=FILE, as several recordings need it")
    if len(found := key_value(context, parameter, given)) < len(given):
        raise click.BadParameter("a recording is named twice")
    return found or None


def times_list(context: click.Context, parameter: click.Parameter, text: str | None) -> list[float] | None:
    """T,T,... as numbers."""
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise click.BadParameter(f"{text!r} is not a list of times in s, such as 0.1,0.2,0.5") from None


class MethodOption(click.Option):
    """An option whose help names the methods there are; their import waits until somebody asks."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """The option and its help."""
        from shoal.identification.methods import METHODS

        self.help = f"One of {', '.join(METHODS)}; the problem's by default."
        return super().get_help_record(ctx)


Command = Callable[..., Any]


def option_set(command: Command) -> Command:
    """--set PATH=VALUE."""
    text = "Set any field of the scene, such as bodies.OA.elements=16, solver.step=1e-5 (repeatable)."
    return click.option("--set", "values", multiple=True, metavar="PATH=VALUE", callback=field_values, help=text)(
        command
    )


def option_verify(command: Command) -> Command:
    """--verify, --no-verify."""
    return click.option("--verify/--no-verify", default=True, show_default=True, help="Estimate errors by more runs.")(
        command
    )


def option_json(command: Command) -> Command:
    """--json."""
    return click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")(command)


def option_engine(command: Command) -> Command:
    """--engine."""
    text = f"{', '.join(ENGINES)}, or the address of a service (see `shoal serve`)."
    return click.option("--engine", default="gauss", show_default=True, help=text)(command)


@click.group(cls=Program, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="shoal")
def main() -> None:
    """Simulate and identify planar rigid-flexible machines, and check the answers against other engines.

    SCENE and PROBLEM are a built-in name (see `shoal scenes`) or a YAML file.
    """


@main.command()
@click.argument("name", required=False)
def scenes(name: str | None) -> None:
    """List the built-in scenes and problems, or print one as YAML. Where both have the name, the scene."""
    from shoal import terminal
    from shoal.identification.problem import problem_names
    from shoal.scene.load import load_scene, scene_library, scene_names, unknown
    from shoal.scene.parametric import parametric

    if name is None:
        terminal.listing("scenes", {n: load_scene(n).description for n in scene_names()})
        _problems()
        return
    if (data := parametric(name)) is not None:
        import yaml

        click.echo(yaml.safe_dump(data, sort_keys=False), nl=False)
        return
    if name in scene_names():
        click.echo((scene_library() / f"{name}.yaml").read_text(encoding="utf-8"), nl=False)
        if name in problem_names():
            click.echo(f"shoal: there is a problem of that name too: shoal problems {name}", err=True)
        return
    if name not in problem_names():
        raise InputError(unknown(name, "scene or problem", [*scene_names(), *problem_names()]) + "; see `shoal scenes`")
    _print_problem(name)


@main.command()
@click.argument("name", required=False)
def problems(name: str | None) -> None:
    """List the built-in problems, or print one as YAML."""
    from shoal.identification.problem import problem_names
    from shoal.scene.load import unknown

    if name is None:
        _problems()
        return
    if name not in problem_names():
        raise InputError(unknown(name, "problem", problem_names()) + "; see `shoal problems`")
    _print_problem(name)


def _problems() -> None:
    from shoal import terminal
    from shoal.identification.problem import load_problem, problem_names

    terminal.listing("problems", {n: load_problem(n).description for n in problem_names()})


def _print_problem(name: str) -> None:
    from shoal.identification.problem import problem_library

    click.echo((problem_library() / f"{name}.yaml").read_text(encoding="utf-8"), nl=False)


@main.command()
@click.argument("scene")
@option_engine
@option_set
@click.option("--at", "times", metavar="T,T,...", callback=times_list, help="Sample at these times [s].")
@click.option(
    "--tolerance",
    type=float,
    metavar="METRES",
    help="Find the cheapest model whose error at the markers stays below; overrides elements, integrator and step.",
)
@option_verify
@option_json
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write .html, .gif, .png, .csv or .json.")
def simulate(
    scene: str,
    engine: str,
    values: dict[str, str],
    times: list[float] | None,
    tolerance: float | None,
    verify: bool,
    as_json: bool,
    out: Path | None,
) -> None:
    """Say where the markers of SCENE go, and how far to trust it."""
    from shoal import terminal
    from shoal.engines import get_engine
    from shoal.engines.verification import verified
    from shoal.scene import load_scene

    terminal.check_output(out, (".html", ".gif", ".png", ".csv", ".json"))
    wanted = load_scene(scene).with_values(values)
    selection = None
    if tolerance is not None:
        from shoal.selection import select

        if engine != "gauss":
            raise InputError(f"--tolerance: models are chosen for engine gauss only, found --engine {engine}")
        with terminal.rungs_progress(wanted.name) as progress:
            selection = select(wanted, tolerance, times, progress)
        trajectory, wanted = selection.trajectory, selection.chosen.scene
    else:
        chosen = get_engine(engine)
        with terminal.working(f"simulating {wanted.name} with {engine}"):
            trajectory = verified(chosen, wanted, times) if verify else chosen.simulate(wanted, times)
    if out is not None:
        with whole(out) as path:
            terminal.write_trajectory(trajectory, wanted, path, selection)
    report = trajectory.to_json() | ({} if selection is None else {"selection": selection.to_json()})
    terminal.show(report, as_json, lambda: terminal.trajectory_table(trajectory, wanted, selection))
    _finish(trajectory.ok, trajectory.message)


@main.command()
@click.argument("scene")
@click.option("--time", default=0.0, show_default=True, metavar="T", help="Applied stand as they are at T [s].")
@option_set
@option_json
def statics(scene: str, time: float, values: dict[str, str], as_json: bool) -> None:
    """Find where SCENE comes to rest, and if it is stable there."""
    from shoal import terminal
    from shoal.mechanics.analysis.statics import statics
    from shoal.scene import load_scene

    wanted = load_scene(scene).with_values(values)
    with terminal.working(f"balancing {wanted.name}"):
        equilibrium = statics(wanted, time)
    terminal.show(equilibrium.to_json(), as_json, lambda: terminal.equilibrium_table(equilibrium))
    _finish(equilibrium.ok, equilibrium.message)


@main.command()
@click.argument("scene")
@click.option("--count", default=10, show_default=True, type=click.IntRange(min=1), help="How many, lowest first.")
@click.option("--about", default="equilibrium", show_default=True, type=click.Choice(["equilibrium", "start"]))
@option_set
@option_json
def modes(
    scene: str, count: int, about: Literal["equilibrium", "start"], values: dict[str, str], as_json: bool
) -> None:
    """Eigenfrequencies and mode shapes of SCENE. About its equilibrium, or its start."""
    from shoal import terminal
    from shoal.mechanics.analysis.modes import modes
    from shoal.scene import load_scene

    wanted = load_scene(scene).with_values(values)
    with terminal.working(f"modes of {wanted.name}"):
        found = modes(wanted, about=about, count=count)
    terminal.show(found.to_json(), as_json, lambda: terminal.modes_table(found))
    _finish(found.ok, "it does not stay there: a motion grows")


@main.command()
@click.argument("scene")
@click.option("--at", "times", required=True, metavar="T,T,...", callback=times_list, help="Times of the motion [s].")
@option_set
@option_json
def reactions(scene: str, times: list[float], values: dict[str, str], as_json: bool) -> None:
    """Forces and torques in the joints of SCENE while it moves."""
    from shoal import terminal
    from shoal.mechanics.analysis.reactions import reactions
    from shoal.scene import load_scene

    wanted = load_scene(scene).with_values(values)
    with terminal.working(f"reactions of {wanted.name}"):
        found = reactions(wanted, times)
    ok = all(one.ok for one in found)
    report = {"status": "ok" if ok else "unbalanced", "reactions": [one.to_json() for one in found]}
    terminal.show(report, as_json, lambda: terminal.reactions_table(found))
    _finish(ok, "the bodies are not in balance")


@main.command()
@click.argument("problem")
@click.option(
    "--data",
    multiple=True,
    metavar="[NAME=]FILE",
    callback=recordings,
    help="A recording (CSV, Parquet, or a YAML that describes one) instead of the problem's own, or one of several.",
)
@click.option("--method", cls=MethodOption, metavar="NAME")
@click.option("--seed", default=0, show_default=True, help="Seed of the random numbers.")
@option_engine
@option_set
@click.option(
    "--tolerance",
    type=float,
    metavar="METRES",
    help="Error the model may have at the markers: coarse models for the search, the cheapest good one at the end.",
)
@click.option("--time-limit", type=click.FloatRange(min=0, min_open=True), metavar="SECONDS", help="For all of it.")
@click.option(
    "--checkpoint",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Keep the evaluations in this file; where it exists, go on from it.",
)
@click.option("--profiles", is_flag=True, help="The profile likelihood of every parameter.")
@click.option("--bootstrap", type=click.IntRange(min=0), default=0, metavar="N", help="Draws of a bootstrap.")
@option_json
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write .html, .png, .gif or .json.")
def identify(
    problem: str,
    data: str | dict[str, str] | None,
    method: str | None,
    seed: int,
    engine: str,
    values: dict[str, str],
    tolerance: float | None,
    time_limit: float | None,
    checkpoint: Path | None,
    profiles: bool,
    bootstrap: int,
    as_json: bool,
    out: Path | None,
) -> None:
    """Find the parameters of PROBLEM from measured motion. With intervals and a verdict."""
    from shoal import terminal
    from shoal.identification import identify, load_problem
    from shoal.identification.conclude import Wishes

    terminal.check_output(out, (".html", ".png", ".gif", ".json"))
    wanted = load_problem(problem)
    with _interruptible(checkpoint), terminal.fitness_progress(wanted.name) as progress:
        estimate = identify(
            wanted,
            method=method,
            data=data,
            engine=engine,
            values=values,
            seed=seed,
            tolerance=tolerance,
            time_limit=time_limit,
            checkpoint=checkpoint,
            wishes=Wishes(profiles=profiles, bootstrap=bootstrap),
            progress=progress,
        )
    if out is not None:
        with whole(out) as path:
            terminal.write_estimate(estimate, wanted, path)
    terminal.show(estimate.to_json(), as_json, lambda: terminal.estimate_table(estimate))
    _finish(estimate.verdict.trusted, f"{estimate.verdict}: {estimate.message}")


@main.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path("report.html"),
    show_default=True,
    help="Write .html.",
)
def report(runs: tuple[str, ...], out: Path) -> None:
    """Make one page of identifications of one problem.

    RUN is a file that `shoal identify --out FILE.json` wrote, or the id of a run in MLflow.
    """
    from shoal import terminal
    from shoal.pictures import archive
    from shoal.pictures.study import best_of

    terminal.check_output(out, (".html",))
    found: dict[str, Any] = {}
    for run in runs:
        if Path(run).suffix or Path(run).exists():
            found[Path(run).stem if Path(run).stem not in found else run] = archive.read(Path(run))
        else:
            found |= _pipeline("shoal_flows.report.stored").stored(run)
    with whole(out) as path:
        terminal.write_report(found, path)
    click.echo(f"report: {out}")
    best = found[best_of({name: answer.estimate for name, answer in found.items()})].estimate
    _finish(best.verdict.trusted, f"{best.verdict}: {best.message}")


@main.command()
@click.argument("problem")
@click.option("--data", multiple=True, metavar="[NAME=]FILE", callback=recordings, help="As for identify.")
@click.option("--about", type=click.Choice(["answer", "start"]), help="The answer from the data, where there are any.")
@click.option("--noise", type=float, metavar="METRES", help="Standard deviation of positions; else the problem's.")
@click.option("--angle-noise", type=float, metavar="RADIANS", help="Standard deviation of angles; else the problem's.")
@click.option("--duration", type=float, metavar="SECONDS", help="Of the measurement; else that of the data.")
@click.option("--rate", type=float, metavar="HERTZ", help="Samples per second; else that of the data.")
@click.option("--parameter", metavar="NAME", help="To be sharpened; else the weakest.")
@option_set
@option_json
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write .json or .png.")
def design(
    problem: str,
    data: str | dict[str, str] | None,
    about: Literal["answer", "start"] | None,
    values: dict[str, str],
    as_json: bool,
    out: Path | None,
    **options: Any,
) -> None:
    """Say what to measure to know the parameters of PROBLEM best. Which marker, how long and how often."""
    from shoal import terminal
    from shoal.identification import load_problem
    from shoal.identification.design import about_answer, design, has_data

    terminal.check_output(out, (".json", ".png"))
    wanted = load_problem(problem)
    with terminal.working(f"designing a measurement for {wanted.name}"):
        if about == "answer" or (about is None and (data is not None or has_data(wanted))):
            found = about_answer(wanted, data=data, values=values, **options)
        else:
            found = design(wanted, values=values, **options)
    if out is not None:
        with whole(out) as path:
            terminal.write_design(found, path)
    terminal.show(found.to_json(), as_json, lambda: terminal.design_table(found))
    _finish(found.ok, "no candidate tells every parameter; name one with --parameter")


@main.command()
@click.argument("scene")
@click.option("--vary", "vary", multiple=True, required=True, metavar="PATH=LOW:HIGH:COUNT", callback=key_value)
@option_engine
@option_set
@click.option("--at", "time", type=float, metavar="T", help="Instant [s]; the scene's duration by default.")
@option_verify
@option_json
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write .csv, .json or .png.")
def sweep(
    scene: str,
    vary: dict[str, str],
    engine: str,
    values: dict[str, str],
    time: float | None,
    verify: bool,
    as_json: bool,
    out: Path | None,
) -> None:
    """Marker positions of SCENE over a grid of values. At one instant; the paper's Figure 4, for example."""
    from shoal import terminal
    from shoal.engines import get_engine
    from shoal.engines.spot_checks import spot_checked
    from shoal.engines.sweep import sweep
    from shoal.scene import load_scene

    terminal.check_output(out, (".csv", ".json", ".png"))
    wanted = load_scene(scene).with_values(values)
    grid = {path: terminal.axis(path, text) for path, text in vary.items()}
    with terminal.working(f"sweeping {wanted.name}"):
        result = sweep(wanted, grid, get_engine(engine), time)
        result = spot_checked(result, get_engine(engine)) if verify else result
    if out is not None:
        with whole(out) as path:
            terminal.write_sweep(result, path)
    terminal.show(result.to_json(), as_json, lambda: terminal.sweep_table(result))
    _finish(result.ok, result.complaint)


@main.command()
@click.argument("scene")
@click.option("--engines", default=",".join(COMPARED), show_default=True, help="Names, separated by commas.")
@option_set
@click.option("--at", "times", metavar="T,T,...", callback=times_list, help="Sample at these times [s].")
@option_json
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write .json or .png.")
def compare(
    scene: str,
    engines: str,
    values: dict[str, str],
    times: list[float] | None,
    as_json: bool,
    out: Path | None,
) -> None:
    """Run SCENE on several engines and show how far apart they are."""
    from shoal import terminal
    from shoal.engines.compare import compare
    from shoal.scene import load_scene

    terminal.check_output(out, (".json", ".png"))
    wanted = load_scene(scene).with_values(values)
    with terminal.working(f"running {wanted.name} on {engines}"):
        comparison = compare(wanted, [name.strip() for name in engines.split(",")], times)
    if out is not None:
        with whole(out) as path:
            terminal.write_comparison(comparison, path)
    terminal.show(comparison.to_json(), as_json, lambda: terminal.comparison_table(comparison))
    reasons = [*comparison.refused.values(), *(t.message for t in comparison.trajectories.values() if t.message)]
    _finish(comparison.ok, reasons[0] if reasons else "fewer than two engines ran")


@main.command()
@click.argument("flow")
@click.option("--param", "parameters", multiple=True, metavar="K=V", callback=key_value, help="JSON or plain text.")
@option_json
def run(flow: str, parameters: dict[str, str], as_json: bool) -> None:
    """Run a Prefect FLOW and log it to MLflow. It is forward, identify, compare, sweep or nightly."""
    _finish(bool(_pipeline("shoal_flows.run").main(flow, parameters, as_json)), "the flow did not end well")


@main.command()
@click.argument("run_id")
@option_json
def rerun(run_id: str, as_json: bool) -> None:
    """Repeat a study from its MLflow run, and compare the figures."""
    _finish(bool(_pipeline("shoal_flows.rerun").main(run_id, as_json)), "the figures do not agree")


@main.command()
def upload() -> None:
    """Send MLflow the runs that it could not be told of. They wait in the outbox."""
    count = _pipeline("shoal_flows.tracking.upload").upload()
    click.echo(f"{count} runs uploaded")


@main.command()
@click.option("--host", default="127.0.0.1", show_default=True)
@click.option("--port", default=5000, show_default=True)
def ui(host: str, port: int) -> None:
    """Serve the MLflow dashboard of all runs until Ctrl-C."""
    _pipeline("shoal_flows.ui").ui(host, port)


@main.command()
@click.argument("engine", type=click.Choice(list(ENGINES)))
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
    _optional("shoal.api.serve", "services").serve(engine, host, port, certificate, key)


@main.command("export-fmu")
@click.argument("scene")
@option_set
@click.option(
    "--parameter",
    "parameters",
    multiple=True,
    metavar="PATH",
    help="A number of the scene that a host may set (repeatable); else gravity and the initial angles.",
)
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write .fmu; else the scene's name.")
def export_fmu(scene: str, values: dict[str, str], parameters: tuple[str, ...], out: Path | None) -> None:
    """Write SCENE as an FMI 2.0 unit for co-simulation. A host needs this installation to run it."""
    from shoal import terminal
    from shoal.scene import load_scene

    terminal.check_output(out, (".fmu",))
    wanted = load_scene(scene).with_values(values)
    click.echo(_optional("shoal.fmu.export", "fmu").export(wanted, parameters, out))


@main.command()
def demo() -> None:
    """The main job: both cases of the paper on every engine. One table, one report."""
    sys.exit(_pipeline("shoal_flows.demo").main())


@main.command()
@click.option("--only", metavar="NAME", help="One problem of the library or of the paper.")
@click.option("--quick", is_flag=True, help="A part that takes less than three minutes.")
@option_json
def validate(only: str | None, quick: bool, as_json: bool) -> None:
    """Run the problem library over all engines, and write a page. Against its references and the nights before."""
    good = _pipeline("shoal_validation.nightly.main").main(only, quick, as_json)
    _finish(bool(good), "not every line is as it should be; the page and the lines above name them")


@main.command()
@option_json
def doctor(as_json: bool) -> None:
    """Check the installation and say what is wrong. Engines, compiled kernels, pipeline, folders."""
    from shoal import doctor, terminal

    checks = doctor.examine()
    report = {"status": "ok" if all(c.ok for c in checks) else "failed", "checks": [vars(c) for c in checks]}
    terminal.show(report, as_json, lambda: terminal.doctor_table(checks))
    _finish(all(check.ok for check in checks), "something is missing; see the table")


def _pipeline(module: str) -> Any:
    """A module of the pipeline, which the library itself does not depend on. Raises InputError."""
    return _optional(module, "pipeline")


def _optional(module: str, extra: str) -> Any:
    """A module that needs an extra of the package. Raises InputError."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] in EXTRAS[extra]:
            raise InputError(f"{error.name} is not installed; install shoal with its extra '{extra}'") from None
        raise


@contextmanager
def _interruptible(checkpoint: Path | None) -> Iterator[None]:
    """Say that a checkpoint is gone on from, and after Ctrl-C how."""
    if checkpoint is not None and checkpoint.exists():
        click.echo(f"shoal: going on from {checkpoint}", err=True)
    try:
        yield
    except KeyboardInterrupt:
        if checkpoint is not None:
            click.echo(f"shoal: {checkpoint} keeps what was evaluated; the same command goes on from there", err=True)
        raise


def _finish(trusted: bool, reason: str) -> None:
    """Exit status 0 only for an answer that can be trusted, else 3 with the reason."""
    if not trusted:
        click.echo(f"shoal: {reason}", err=True)
        sys.exit(EXIT_UNTRUSTED)
