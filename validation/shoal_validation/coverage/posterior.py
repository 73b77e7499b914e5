"""`python -m shoal_validation.coverage.posterior [--seeds N] [--record FILE] [--page FILE]`.

Draws from the posterior of the rigid double pendulum for N data sets (100) that differ in their noise, and counts how
often the central 95 % contain the truth, which is that of scipy's solution of Lagrange's equations. The table, with the
effective draws a minute of processor time, goes to standard output and into docs/verdict-charts.md. --record
keeps every data set in a file, so that the study goes on where it was stopped. Takes half an hour.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from shoal.identification.methods.least_squares import descend
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import linearise
from shoal.identification.uncertainty.posterior import Posterior, posterior

from shoal_validation.coverage.cases import Case, cases
from shoal_validation.document import publish, table
from shoal_validation.resumed import resumed

WANTED = 500
"""Effective draws from each posterior."""


@dataclass(frozen=True)
class Count:
    """Coverage of one posterior. covered: whether it holds the truth, by parameter; worth: effective draws.

    seconds: of processors, the fit included
    """

    covered: dict[str, bool]
    converged: bool
    worth: float
    seconds: float


def drawn(case: Case, seed: int) -> Posterior:
    """The posterior for one data set, about the fit that begins at the truth."""
    model = case.model(seed)
    truth = model.parameters.to_vector(np.array([case.truth[name] for name in model.names]))
    end = descend(model, truth, lambda *_: None)
    blocks = blocks_of(model, len(end.residual))
    at = linearise(end.jacobian, end.residual, model.sizes(end.point), blocks)
    return posterior(model, end.point, at, blocks, float(end.residual @ end.residual), WANTED, seed)


def counted(case: Case, seed: int) -> Count:
    """Draw for one data set and compare."""
    begin = time.process_time()
    found = drawn(case, seed)
    covered = {
        name: found.marginals[name].lower <= true <= found.marginals[name].upper for name, true in case.truth.items()
    }
    return Count(covered, found.converged, found.worth, time.process_time() - begin)


def main(arguments: list[str]) -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.coverage.posterior", description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--record", type=Path, help="file of the data sets that are done")
    parser.add_argument("--page", type=Path, default=Path("docs/verdict-charts.md"))
    chosen = parser.parse_args(arguments)
    each = {f"{case.name} {seed}": (case, seed) for case in cases() for seed in range(chosen.seeds)}
    found = dict(resumed(list(each), lambda key: asdict(counted(*each[key])), chosen.record))
    rows = []
    for case in cases():
        mine = [Count(**found[f"{case.name} {seed}"]) for seed in range(chosen.seeds)]
        shares = {name: np.mean([one.covered[name] for one in mine]) for name in case.truth}
        told = ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares.items())
        a_minute = 60.0 * sum(one.worth for one in mine) / sum(one.seconds for one in mine)
        converged = np.mean([one.converged for one in mine])
        rows.append((case.name, told, f"{100 * converged:.0f} %", f"{a_minute:.2g}"))
    head = ("parameters; noise", "central 95 % with the truth", "converged", "effective draws a minute of a processor")
    publish(chosen.page, {"posterior": table(head, rows)})


if __name__ == "__main__":
    main(sys.argv[1:])
