"""Motions of a scene whose parameters are known as intervals or distributions only."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from shoal.commands import options
from shoal.commands.options import Out, Times, Values
from shoal.commands.stated import stated
from shoal.errors import ComputationError, InputError, check_trusted

if TYPE_CHECKING:
    from shoal.response import Response


def _methods() -> str:
    from shoal.response.methods import METHODS

    return f"One of {', '.join(METHODS)}."


def _ways() -> str:
    from shoal.response.limits.choice import WAYS

    return f"Of a probability: one of {', '.join(WAYS)}."


@click.command()
@click.argument("scene", is_eager=True, callback=stated)
@click.option(
    "--vary",
    "vary",
    multiple=True,
    required=True,
    metavar="PATH=LOW:HIGH|PATH~DISTRIBUTION|FILE",
    help='An interval (-2%:2% is relative) or a distribution, such as "bodies.OA.length~normal(1,0.01)" (repeatable). '
    "PATH,PATH=... ties fields together. FILE is what `shoal identify --out` wrote, .json or .nc of draws.",
)
@click.option("--correlate", "pairs", multiple=True, metavar="PATH,PATH=VALUE", help="Correlation of two of them.")
@click.option("--method", cls=options.LateHelp, told=_methods, default="auto", show_default=True, metavar="NAME")
@click.option(
    "--gap",
    type=options.limited("gap"),
    metavar="SHARE",
    help="Go on until outer and attained bounds differ by this share of the width.",
)
@click.option(
    "--runs",
    "most",
    type=options.limited("most"),
    default=20_000,
    show_default=True,
    help="Most runs that may be made.",
)
@click.option("--degree", type=options.limited("degree"), help="Of a method that has one (default: its own).")
@click.option("--count", type=options.limited("count"), help="Runs of a method that samples (default: its own).")
@click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar='"MARKER.QUANTITY < NUMBER"',
    help="What must not happen (repeatable), the opposite of --require; also JOINT.force, .torque, energy, .strain and "
    "so on (docs/reference/uncertain.md).",
)
@click.option(
    "--require",
    "requirements",
    multiple=True,
    metavar='"MARKER.QUANTITY > NUMBER"',
    help="What must hold (repeatable): the opposite of --limit.",
)
@click.option("--limit-method", cls=options.LateHelp, told=_ways, default="auto", show_default=True, metavar="NAME")
@click.option(
    "--limit-runs",
    type=options.limited("limit_runs"),
    default=5_000,
    show_default=True,
    help="Runs for each probability.",
)
@click.option("--allocate", is_flag=True, help="Look for the widest tolerances that keep the limit.")
@click.option(
    "--target",
    type=options.limited("target"),
    help="With --allocate: the probability of passing the limit (default 0.001).",
)
@click.option(
    "--cost",
    "costs",
    multiple=True,
    metavar="PATH=COST",
    help="With --allocate: of tightening this tolerance (default 1; repeatable).",
)
@click.option(
    "--worst",
    "worst_file",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.yaml",
    help="Write the scene that comes nearest to a limit, or goes furthest beyond, or attains a bound.",
)
@click.option("--worst-of", default="", metavar="LIMIT|BOUND", help="Which: a limit, or MARKER.QUANTITY.lower, .upper.")
@click.option(
    "--time-limit",
    type=options.limited("time_limit"),
    metavar="SECONDS",
    help="End after this time with what is known by then.",
)
@click.option(
    "--checkpoint",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Keep the runs in this file; where it exists, go on from it.",
)
@options.engine
@options.values
@options.at
@click.option("--tolerance", type=float, metavar="METRES", help="Use the cheapest model whose errors stay below.")
@click.option("--seed", type=options.limited("seed"), default=0, show_default=True)
@options.verify
@options.as_json
@options.out(".html", ".nc", ".csv", ".json", ".png")
def uncertain(
    scene: str,
    vary: tuple[str, ...],
    pairs: tuple[str, ...],
    method: str,
    gap: float | None,
    most: int,
    degree: int | None,
    count: int | None,
    limits: tuple[str, ...],
    requirements: tuple[str, ...],
    limit_method: str,
    limit_runs: int,
    allocate: bool,
    target: float | None,
    costs: tuple[str, ...],
    worst_file: Path | None,
    worst_of: str,
    time_limit: float | None,
    checkpoint: Path | None,
    engine: str,
    values: Values,
    times: Times,
    tolerance: float | None,
    seed: int,
    verify: bool,
    as_json: bool,
    out: Out,
) -> None:
    """Bound or predict the motion of SCENE if some of its fields are intervals or distributions.

    Intervals give bounds that runs attain, distributions give means, deviations, quantiles and Sobol indices. A
    requirement states what must hold, a limit what must not happen: with intervals the answer is whether it can be
    violated, with distributions how probable that is. SCENE may be a
    YAML `uncertain: {scene: ..., vary: ..., ...}` that states these options.
    """
    from shoal.pictures import files
    from shoal.response import uncertain
    from shoal.response.limits import read_limits
    from shoal.response.read import correlations, parameters, prices
    from shoal.response.worst import require_case
    from shoal.scene import load_scene
    from shoal.terminal import screen, tables

    wanted = load_scene(scene).with_values(values)
    known, correlated = parameters(vary, wanted), correlations(pairs)
    require_case(worst_of, read_limits(limits, requirements, wanted), wanted, known)
    with screen.working(f"{wanted.name}: uncertain response") as tell:
        screen.compile_for(engine, [1, 2], wanted)
        response = uncertain(
            wanted,
            known,
            times,
            method=method,
            gap=gap,
            correlations=correlated,
            degree=degree,
            count=count,
            tolerance=tolerance,
            engine=engine,
            verify=verify,
            seed=seed,
            most=most,
            limits=limits,
            requirements=requirements,
            limit_method=limit_method,
            limit_runs=limit_runs,
            allocate=allocate,
            costs=prices(costs),
            target=target,
            checkpoint=checkpoint,
            time_limit=time_limit,
            progress=lambda runs: tell(f"{wanted.name}: {runs} runs"),
        )
    if out is not None:
        files.response(response, out)
    screen.show(response.to_json(), as_json, lambda: tables.response_table(response))
    if worst_file is not None:
        _save_worst(response, worst_file, worst_of)
    check_trusted(response.ok, response.message)


def _save_worst(response: Response, file: Path, of: str) -> None:
    """One scene; those of several limits get numbers. Raises ComputationError, also where there is no worst case."""
    from shoal.response.worst import worst

    try:
        cases = worst(response, of)
    except InputError as error:
        raise ComputationError(f"{error}; {file} is not written") from None
    for k, case in enumerate(cases):
        path = file if len(cases) == 1 else file.with_stem(f"{file.stem}-{k + 1}")
        case.save(path)
        click.echo(f"{path}: {case.scene.description}", err=True)
    if not of and len(cases) < len(response.limits):
        missing = [one.limit.text for one in response.limits if one.shown is None]
        click.echo(f"no run comes near {' or '.join(missing)}: no worst case is written", err=True)
