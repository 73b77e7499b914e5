"""`python -m shoal_validation.inverse_precision.chaos [--quick] [--page FILE]`: long records, where a deviation grows.

The rigid double pendulum from the noisy path of its tip or of both joints: 100 samples a second, 1 mm of white noise,
both angles sought anywhere. Data by Lagrange's equations (scipy DOP853), or, with friction, by Runge-Kutta steps of
another size than the model's. Prints a table and writes it into the block `chaos` of FILE, which is
docs/identification-charts.md, where that has one. About five minutes; quick: one draw of the noise.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from shoal.engines import get_engine
from shoal.identification import Estimate, Measurement, Problem, identify, measure
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import descend_many
from shoal.trajectory import Array

from shoal_validation.document import rewrite, table
from shoal_validation.inverse_precision.cases import RATE, rigid_problem
from shoal_validation.problems.double_pendulum import lagrange

CHAOTIC = (3 * np.pi / 4 - np.pi / 2, 2.6 - np.pi / 2)
"""Absolute angles [rad]; from the downward vertical 3 pi/4 and 2.6."""
GENTLE = (np.pi / 3 - np.pi / 2, np.pi / 4 - np.pi / 2)
"""From the downward vertical pi/3 and pi/4."""
ROUGH = (np.pi / 3, np.pi / 4)
"""From the horizontal: above it, so that the machine turns over."""
NOISE = 1e-3
SOLVER = {"solver.relative_tolerance": 1e-8, "solver.absolute_tolerance": 1e-8}
RIGHT = 1e-3
"""Largest error of an answer that is right [rad]."""
NEAR = 0.3
"""A false minimum counts as near by up to this distance [rad]."""
FRICTION = 0.2
_BLOCK = "chaos"


@dataclass(frozen=True)
class Study:
    """One row: a method on draws of a record. data: the measurement of a draw."""

    about: str
    method: str
    problem: Problem
    data: Callable[[int], Measurement]


def record(
    problem: Problem, start: tuple[float, float], horizon: float, *, seed: int = 0, rate: float = RATE
) -> Measurement:
    """Positions of the problem's markers by Lagrange's equations, with white noise; start: absolute angles [rad]."""
    times = np.arange(1, round(horizon * rate) + 1) / rate
    places = dict(zip("AB", lagrange(start, times), strict=True))
    columns = [places[c.marker][:, "xy".index(c.quantity)] for c in problem.channels]
    values = np.stack(columns, axis=1)
    values = values + NOISE * np.random.default_rng(seed).standard_normal(values.shape)
    truth = dict(zip(problem.parameters, start, strict=False))
    return Measurement.single(times, tuple(problem.channels), values, f"Lagrange's equations, noise {NOISE:g} m", truth)


def two_markers() -> Problem:
    """Both angles from the motion of elbow and tip."""
    data = rigid_problem().model_dump(mode="json")
    data["channels"] = [{"marker": m, "quantity": q, "column": m + q} for m in "AB" for q in "xy"]
    return Problem.parse(data, "two markers")


def with_friction() -> Problem:
    """Both angles and the friction at the ground from the tip; data by Runge-Kutta steps of 0.5 ms."""
    data = rigid_problem().model_dump(mode="json")
    data["parameters"]["friction"] = {"path": "joints.O.friction", "lower": 0.0, "upper": 1.0}
    values: dict[str, object] = {"solver.integrator": "rk4", "solver.step": 5e-4, "joints.O.friction": FRICTION}
    values |= {"initial.OA.angle": CHAOTIC[0], "initial.AB.angle": CHAOTIC[1]}
    source = {"kind": "engine", "engine": "gauss", "values": values, "stop": 10.0, "count": 1000, "noise": NOISE}
    data["source"] = source
    return Problem.parse(data, "friction")


def studies() -> Iterator[Study]:
    """The rows of the table."""
    tip, both, friction = rigid_problem(), two_markers(), with_friction()
    for method in ("least-squares", "auto"):
        yield Study("chaotic, 10 s, tip", method, tip, lambda seed: record(tip, CHAOTIC, 10.0, seed=seed))
    for method in ("progressive", "multiple-shooting"):
        yield Study("chaotic, 10 s, both markers", method, both, lambda seed: record(both, CHAOTIC, 10.0, seed=seed))
    yield Study("chaotic, 10 s, tip, friction sought too", "auto", friction, lambda seed: rubbed(friction, seed))
    yield Study("gentle, 5 s, tip", "auto", tip, lambda seed: record(tip, GENTLE, 5.0, seed=seed))
    yield Study("turning over, 5 s, tip", "auto", tip, lambda seed: record(tip, ROUGH, 5.0, seed=seed))


def rubbed(problem: Problem, seed: int) -> Measurement:
    """A draw of the record with friction."""
    (source,) = problem.sources.values()
    drawn = problem.model_copy(update={"source": source.model_copy(update={"seed": seed})})
    return measure(drawn, drawn.load_scene())


def row(study: Study, draws: int) -> tuple[str, ...]:
    """A row of the table."""
    found = [
        identify(study.problem, method=study.method, measurement=study.data(seed), values=SOLVER)
        for seed in range(draws)
    ]
    errors = [error(estimate) for estimate in found]
    work = [estimate.work for estimate in found]
    return (
        study.about,
        study.method,
        f"{sum(e < RIGHT for e in errors)} of {draws}",
        f"{np.median(errors):.1e}",
        f"{np.median(work):.0f} ({min(work):.0f} to {max(work):.0f})",
        f"{np.median([estimate.evaluations for estimate in found]):.0f}",
        f"{np.median([estimate.wall_s for estimate in found]):.1f}",
        f"{sum(bool(false_near(study, estimate)) for estimate in found)} of {draws}",
    )


def error(estimate: Estimate) -> float:
    """The largest error of a parameter, in its own unit."""
    return max(abs(estimate.parameters[name].value - true) for name, true in estimate.truth.items())


def false_near(study: Study, estimate: Estimate) -> list[Array]:
    """The listed points near the truth that are minima: a descent from there stays, and is worse than the answer."""
    scene = study.problem.load_scene(SOLVER)
    model = ForwardModel(study.problem, scene, get_engine("gauss"), estimate.measurement)
    truth = np.array([estimate.truth[name] for name in model.names])
    listed = np.array([[minimum[name] for name in model.names] for minimum in estimate.minima])
    near = [p for p in listed if np.max(np.abs(p - truth)) < NEAR]
    ends = [descend_many(model, p[None])[0] for p in near]
    return [
        p
        for p, end in zip(near, ends, strict=True)
        if np.max(np.abs(end.point - p)) < RIGHT and end.fitness > 2 * estimate.fitness
    ]


def main(arguments: list[str]) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.inverse_precision.chaos", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one draw of the noise")
    parser.add_argument("--page", type=Path, default=Path("docs/identification-charts.md"))
    chosen = parser.parse_args(arguments)
    head = ("record", "method", f"right to {RIGHT:g}", "error, median", "full runs", "simulations", "time [s]")
    rows = [row(study, 1 if chosen.quick else 10) for study in studies()]
    text = table((*head, "false minima near by"), rows)
    sys.stdout.write(text + "\n")
    if not chosen.quick and chosen.page.exists() and f"<!-- begin {_BLOCK} -->" in chosen.page.read_text("utf-8"):
        rewrite(chosen.page, _BLOCK, text)


if __name__ == "__main__":
    main(sys.argv[1:])
