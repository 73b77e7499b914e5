"""`python -m shoal_validation.coverage [--seeds N] [--page FILE]`.

Refits the rigid double pendulum to N data sets (200) that differ in their noise, each from the truth, and counts how
often the 95 % intervals contain it. The table goes to standard output and into docs/verdict-charts.md. Takes
about two minutes.
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
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import linearise, spread
from shoal.trajectory import Array

from shoal_validation.coverage.cases import Case, cases
from shoal_validation.document import publish, table


@dataclass(frozen=True)
class Count:
    """One parameter: share of intervals with the truth, spread of the estimates and the mean reported one."""

    parameter: str
    covered: float
    naive: float
    scatter: float
    reported: float


def measure(case: Case, seeds: int) -> list[Count]:
    """Refit to `seeds` data sets. naive: coverage of 1.96 standard deviations of a plain least-squares covariance."""
    console = Console(stderr=True)
    found = np.array([_refit(case, s) for s in track(range(seeds), case.name, console=console, transient=True)])
    errors, halves, stds, plain = np.moveaxis(found, -1, 0)
    return [
        Count(
            name,
            float(np.mean(np.abs(errors[:, k]) <= halves[:, k])),
            float(np.mean(np.abs(errors[:, k]) <= 1.96 * plain[:, k])),
            float(np.std(errors[:, k], ddof=1)),
            float(np.sqrt(np.mean(stds[:, k] ** 2))),
        )
        for k, name in enumerate(case.problem.parameters)
    ]


def _refit(case: Case, seed: int) -> Array:
    """Error, half interval, standard deviation and the plain one of the parameters as sought, (parameters, 4)."""
    model = case.model(seed)
    truth = model.parameters.to_vector(np.array([case.truth[name] for name in model.names]))
    end = descend(model, truth, lambda *_: None)
    at = linearise(end.jacobian, end.residual, model.sizes(end.point), blocks_of(model, len(end.residual)))
    known = [spread(lambda p, k=k: float(p[k]), end.point, at) for k in range(len(truth))]  # type: ignore[misc]
    variance = float(end.residual @ end.residual) / (len(end.residual) - len(truth))
    plain = np.sqrt(variance * np.sum(at.pseudo_inverse**2, axis=1))
    return np.array(
        [[x - t, s.half, s.std, p] for x, t, s, p in zip(end.point, truth, known, plain, strict=True)], dtype=float
    )


def main(arguments: list[str]) -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.coverage", description=__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--page", type=Path, default=Path("docs/verdict-charts.md"))
    chosen = parser.parse_args(arguments)
    rows = [
        (
            case.name,
            count.parameter,
            f"{100 * count.covered:.1f} %",
            f"{100 * count.naive:.1f} %",
            f"{count.reported / count.scatter:.2f}",
        )
        for case in cases()
        for count in measure(case, chosen.seeds)
    ]
    head = (
        "sought; noise",
        "parameter",
        "95 % interval covers",
        "plain 1.96 sigma covers",
        "reported over true spread",
    )
    publish(chosen.page, {"coverage": table(head, rows)})


if __name__ == "__main__":
    main(sys.argv[1:])
