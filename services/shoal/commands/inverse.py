"""Parameters of a problem: found from measured motion, and what to measure to know them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from shoal.commands import options
from shoal.commands.command import command
from shoal.commands.options import Out
from shoal.errors import InputError, check_trusted

if TYPE_CHECKING:
    from shoal.requests.design import Design
    from shoal.requests.identify import Identify


@command("identify")
@options.as_json
@options.out(".html", ".png", ".gif", ".json", ".nc")
def identify(asked: Identify, as_json: bool, out: Out) -> None:
    """Find the parameters of PROBLEM from measured motion. With intervals and a verdict."""
    from shoal.identification import load_problem
    from shoal.identification.carried import carried
    from shoal.notebook import identify
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    if out is not None and out.suffix == ".nc" and not asked.sample:
        raise InputError("out: .nc holds draws from the posterior; add --sample")
    problem = load_problem(str(asked.problem))
    with _interruptible(asked.checkpoint), screen.working(f"{problem.name}: preparing the data") as tell:

        def progress(_: int, best: float, __: float, count: int) -> None:
            tell(f"{problem.name}: best fitness {best:.3e}, {count} evaluations")

        known = None if asked.values is None else carried(asked.values)
        starting, values = (problem, asked.set) if known is None else known.into(problem, asked.set)[:2]
        screen.compile_for(asked.engine, [1, 2], starting.load_scene(values))
        estimate = identify.answer(replace(asked, progress=progress))
    if out is not None:
        files.estimate(estimate, problem, out)
    screen.show(estimate.to_json(), as_json, lambda: tables.estimate_table(estimate))
    check_trusted(estimate.verdict.trusted, f"{estimate.verdict}: {estimate.message}")


@command("design")
@options.as_json
@options.out(".html", ".json", ".png")
def design(asked: Design, as_json: bool, out: Out) -> None:
    """Say what to measure to know the parameters of PROBLEM best. Which sensor where, how long and how often."""
    from shoal.identification import load_problem
    from shoal.notebook import designed
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    with screen.working(f"designing a measurement for {load_problem(str(asked.problem)).name}"):
        found = designed(asked, options.note)
    options.finish(found, as_json, out, files.design, tables.design_table)


@contextmanager
def _interruptible(checkpoint: str | Path | None) -> Iterator[None]:
    """Say that a checkpoint is gone on from, and after Ctrl-C how."""
    if checkpoint is not None and Path(checkpoint).exists():
        click.echo(f"shoal: going on from {checkpoint}", err=True)
    try:
        yield
    except KeyboardInterrupt:
        if checkpoint is not None:
            click.echo(f"shoal: {checkpoint} keeps what was evaluated; the same command goes on from there", err=True)
        raise
