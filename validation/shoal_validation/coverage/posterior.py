"""`python -m shoal_validation.coverage.posterior [--seeds N] [--page FILE]`.

Draws from the posterior of the rigid double pendulum for N data sets (40) that differ in their noise, and counts how
often the central 95 % contain the truth, which is that of scipy's solution of Lagrange's equations. The table, with the
effective draws a minute, goes to standard output and into docs/identification-charts.md. Takes twenty minutes.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from shoal.identification.methods.least_squares import descend
from shoal.identification.spread.covariance import blocks_of
from shoal.identification.spread.posterior import Posterior, posterior
from shoal.identification.spread.uncertainty import linearise

from shoal_validation.coverage.cases import Case, cases
from shoal_validation.document import publish, table

WANTED = 1000
"""Effective draws from each posterior."""


@dataclass(frozen=True)
class Count:
    """Of all posteriors of a case. covered: share that holds the truth, by parameter; converged: share that has.

    a_minute: effective draws a minute
    """

    covered: dict[str, float]
    converged: float
    a_minute: float


def drawn(case: Case, seed: int) -> Posterior:
    """The posterior for one data set, about the fit that begins at the truth."""
    model = case.model(seed)
    truth = model.parameters.to_vector(np.array([case.truth[name] for name in model.names]))
    end = descend(model, truth, lambda *_: None)
    blocks = blocks_of(model, len(end.residual))
    at = linearise(end.jacobian, end.residual, model.sizes(end.point), blocks)
    return posterior(model, end.point, at, blocks, float(end.residual @ end.residual), WANTED, seed)


def measure(case: Case, seeds: int) -> Count:
    """Draw for so many data sets."""
    console = Console(stderr=True)
    found = [drawn(case, seed) for seed in track(range(seeds), case.name, console=console, transient=True)]
    covered = {
        name: float(np.mean([one.marginals[name].lower <= true <= one.marginals[name].upper for one in found]))
        for name, true in case.truth.items()
    }
    worth, wall = sum(one.worth for one in found), sum(one.wall_s for one in found)
    return Count(covered, float(np.mean([one.converged for one in found])), 60.0 * worth / wall)


def main(arguments: list[str]) -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.coverage.posterior", description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--page", type=Path, default=Path("docs/identification-charts.md"))
    chosen = parser.parse_args(arguments)
    rows = []
    for case in cases():
        count = measure(case, chosen.seeds)
        told = ", ".join(f"{name} {100 * share:.0f} %" for name, share in count.covered.items())
        rows.append((case.name, told, f"{100 * count.converged:.0f} %", f"{count.a_minute:.2g}"))
    lines = table(("parameters; noise", "central 95 % with the truth", "converged", "effective draws a minute"), rows)
    publish(chosen.page, {"posterior": lines})


if __name__ == "__main__":
    main(sys.argv[1:])
