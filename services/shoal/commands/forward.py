"""Motions of a scene: one, over a grid of values, on several engines."""

from __future__ import annotations

import click

from shoal.arguments import check_apart, check_estimated
from shoal.commands import options
from shoal.commands.options import Out, Times, Values
from shoal.errors import InputError, check_trusted


@click.command()
@click.argument("scene")
@options.engine
@options.values
@options.at
@click.option(
    "--tolerance",
    type=float,
    metavar="METRES",
    help="Find the cheapest model whose error at the markers stays below; overrides elements, integrator and step.",
)
@click.option(
    "--patience",
    type=float,
    metavar="SECONDS",
    help="With --tolerance: give up where a refinement would take longer (default: 60).",
)
@options.verify
@options.as_json
@options.out(".html", ".gif", ".png", ".csv", ".parquet", ".nc", ".json")
def simulate(
    scene: str,
    engine: str,
    values: Values,
    times: Times,
    tolerance: float | None,
    patience: float | None,
    verify: bool,
    as_json: bool,
    out: Out,
) -> None:
    """Say where the markers of SCENE go, and how far to trust it."""
    from shoal.engines import get_engine
    from shoal.engines.theory import rigid_runs
    from shoal.engines.verification import verified
    from shoal.pictures import files
    from shoal.scene import load_scene
    from shoal.terminal import screen, tables

    wanted = load_scene(scene).with_values(values)
    stated, selection = wanted.name, None
    if patience is not None and tolerance is None:
        raise InputError("--patience: is that of a search; state --tolerance as well")
    check_estimated(tolerance, verify)
    if tolerance is not None:
        from shoal.selection import select
        from shoal.selection.refine import PATIENCE

        if engine != "gauss":
            raise InputError(f"--tolerance: models are chosen for engine gauss only, found --engine {engine}")
        with screen.working(f"{stated}: looking for the cheapest model") as tell:
            selection = select(
                wanted,
                tolerance,
                times,
                lambda said: tell(f"{stated}: {said}"),
                PATIENCE if patience is None else patience,
            )
        trajectory, wanted = selection.trajectory, selection.chosen.scene
    else:
        chosen = get_engine(engine)
        with screen.working(f"simulating {wanted.name} with {engine}"):
            screen.compile_for(engine, [1], wanted, *(rigid_runs(wanted) if verify else ()))
            trajectory = verified(chosen, wanted, times) if verify else chosen.simulate(wanted, times)
    if out is not None:
        files.trajectory(trajectory, wanted, out, selection)
    report = trajectory.to_json() | ({} if selection is None else {"selection": selection.to_json()})
    screen.show(report, as_json, lambda: tables.trajectory_table(trajectory, wanted, selection))
    check_trusted(trajectory.ok, trajectory.message)


@click.command()
@click.argument("scene")
@click.option(
    "--vary",
    "vary",
    multiple=True,
    required=True,
    metavar="PATH=LOW:HIGH:COUNT",
    callback=options.axes,
    help="So many values of a field, in the units of the scene (repeatable: all combinations).",
)
@options.engine
@options.values
@click.option(
    "--at",
    "time",
    cls=options.Once,
    type=float,
    metavar="T",
    callback=options.once,
    help="Instant [s]; the scene's duration by default.",
)
@options.verify
@options.as_json
@options.out(".csv", ".parquet", ".nc", ".json", ".png")
def sweep(
    scene: str, vary: Values, engine: str, values: Values, time: float | None, verify: bool, as_json: bool, out: Out
) -> None:
    """Marker positions of SCENE over a grid of values. At one instant; the paper's Figure 4, for example."""
    from shoal.engines import get_engine
    from shoal.engines.spot_checks import spot_checked
    from shoal.engines.sweep import sweep
    from shoal.pictures import files
    from shoal.scene import load_scene
    from shoal.terminal import screen, tables

    check_apart(options.set_values(), vary)
    wanted = load_scene(scene).with_values(values)
    with screen.working(f"sweeping {wanted.name}"):
        screen.compile_for(engine, [1, 2], wanted)
        result = sweep(wanted, vary, get_engine(engine), time)
        result = spot_checked(result, get_engine(engine)) if verify else result
    if out is not None:
        files.sweep(result, out)
    screen.show(result.to_json(), as_json, lambda: tables.sweep_table(result))
    check_trusted(result.ok, result.complaint)


@click.command()
@click.argument("scene")
@click.option("--engines", help="Names, separated by commas; else ours and at most two others that can run the scene.")
@options.values
@options.at
@options.verify
@options.as_json
@options.out(".json", ".png")
def compare(
    scene: str, engines: str | None, values: Values, times: Times, verify: bool, as_json: bool, out: Out
) -> None:
    """Run SCENE on several engines and show how far apart they are."""
    from shoal.engines.compare import compare, compared
    from shoal.pictures import files
    from shoal.scene import load_scene
    from shoal.terminal import screen, tables

    wanted = load_scene(scene).with_values(values)
    names = compared(wanted) if engines is None else [name.strip() for name in engines.split(",")]
    with screen.working(f"running {wanted.name} on {', '.join(names)}"):
        for name in names:
            screen.compile_for(name, [1], wanted)
        comparison = compare(wanted, names, times, verify)
    if out is not None:
        files.comparison(comparison, out)
    screen.show(comparison.to_json(), as_json, lambda: tables.comparison_table(comparison))
    check_trusted(comparison.ok, comparison.complaint)
