"""Parameters of a problem: found from measured motion, and what to measure to know them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from shoal.commands import options
from shoal.commands.options import Out
from shoal.errors import InputError, check_trusted

if TYPE_CHECKING:
    from shoal.identification.carried import Carried


@click.command()
@click.argument("problem")
@click.option(
    "--data",
    multiple=True,
    metavar="[NAME=]FILE",
    callback=options.recordings,
    help="A recording (CSV, Parquet, or a YAML that describes one) instead of the problem's own, or one of several.",
)
@click.option(
    "--hold-out",
    multiple=True,
    metavar="[NAME=]FROM:TO",
    callback=options.windows,
    help="Seconds of the recording that are predicted instead of fitted (repeatable).",
)
@options.method
@click.option("--seed", type=options.limited("seed"), default=0, show_default=True, help="Seed of the random numbers.")
@options.engine
@options.set_only
@options.fitted
@click.option(
    "--tolerance",
    type=float,
    metavar="METRES",
    help="Error the model may have at the markers: coarse models for the search, the cheapest good one at the end.",
)
@click.option(
    "--time-limit",
    type=options.limited("time_limit"),
    metavar="SECONDS",
    help="End after this time with what is known.",
)
@click.option(
    "--checkpoint",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Keep the evaluations in this file; where it exists, go on from it.",
)
@click.option("--profiles", is_flag=True, help="Intervals by the profile likelihood as well.")
@click.option(
    "--bootstrap", type=options.limited("bootstrap"), default=0, metavar="N", help="Refit so many resampled data sets."
)
@click.option(
    "--sample",
    type=options.limited("sample"),
    default=0,
    is_flag=False,
    flag_value=1000,
    metavar="[N]",
    help="Draw from the posterior until N draws are effective.  [N: 1000]",
)
@options.as_json
@options.out(".html", ".png", ".gif", ".json", ".nc")
def identify(
    problem: str,
    checkpoint: Path | None,
    profiles: bool,
    bootstrap: int,
    sample: int,
    as_json: bool,
    out: Out,
    **how: Any,
) -> None:
    """Find the parameters of PROBLEM from measured motion. With intervals and a verdict."""
    from shoal.identification import identify, load_problem
    from shoal.identification.conclude import Wishes
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    if out is not None and out.suffix == ".nc" and not sample:
        raise InputError("out: .nc holds draws from the posterior; add --sample")
    wanted, wishes = load_problem(problem), Wishes(profiles=profiles, bootstrap=bootstrap, sample=sample)
    with _interruptible(checkpoint), screen.working(f"{wanted.name}: preparing the data") as tell:
        how["progress"] = lambda _, best, __, count: tell(
            f"{wanted.name}: best fitness {best:.3e}, {count} evaluations"
        )
        carried = how["fitted"]
        starting, values = (wanted, how["values"]) if carried is None else carried.into(wanted, how["values"])[:2]
        screen.compile_for(how["engine"], [1, 2], starting.load_scene(values))
        estimate = identify(wanted, checkpoint=checkpoint, wishes=wishes, **how)
    if out is not None:
        files.estimate(estimate, wanted, out)
    screen.show(estimate.to_json(), as_json, lambda: tables.estimate_table(estimate))
    check_trusted(estimate.verdict.trusted, f"{estimate.verdict}: {estimate.message}")


@click.command()
@click.argument("problem")
@click.option("--data", multiple=True, metavar="[NAME=]FILE", callback=options.recordings, help="As for identify.")
@click.option("--about", type=click.Choice(["answer", "start"]), help="Default: the answer from the data.")
@click.option("--noise", type=float, metavar="METRES", help="Standard deviation of positions; else the problem's.")
@click.option("--angle-noise", type=float, metavar="RADIANS", help="Standard deviation of angles; else the problem's.")
@click.option(
    "--sensor-noise",
    multiple=True,
    metavar="SENSOR=SIZE",
    callback=options.sizes,
    help="Weigh acceleration, rate, force, torque or strain too, with this standard deviation in SI units.",
)
@click.option("--duration", type=float, metavar="SECONDS", help="Of the measurement; else that of the data.")
@click.option("--rate", type=float, metavar="HERTZ", help="Samples per second; else that of the data.")
@click.option("--parameter", metavar="NAME", help="The one to be known better; else the weakest.")
@options.set_only
@options.fitted
@options.as_json
@options.out(".html", ".json", ".png")
def design(
    problem: str,
    data: str | dict[str, str] | None,
    about: Literal["answer", "start"] | None,
    as_json: bool,
    out: Out,
    fitted: Carried | None,
    **how: Any,
) -> None:
    """Say what to measure to know the parameters of PROBLEM best. Which sensor where, how long and how often."""
    from shoal.identification import load_problem
    from shoal.notebook import design
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    wanted = load_problem(problem)
    if fitted is not None:
        wanted, how["values"], notes = fitted.into(wanted, how["values"])
        for note in notes:
            click.echo(f"shoal: note: {note}", err=True)
    with screen.working(f"designing a measurement for {wanted.name}"):
        found = design(wanted, data, about=about, **how)
    if out is not None:
        files.design(found, out)
    screen.show(found.to_json(), as_json, lambda: tables.design_table(found))
    check_trusted(found.ok, found.message)


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
