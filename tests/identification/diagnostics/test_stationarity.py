"""Answers that are not at a minimum are told, minima are not: drawn at random, and as swarms leave them."""

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem, Verdict
from shoal.identification.conclude import conclude
from shoal.identification.diagnostics.stationarity import downhill
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import Outcome
from shoal.identification.methods.lanes import Descent
from shoal.identification.methods.least_squares import descend
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import linearise
from shoal.identification.uncertainty.sensitivity import believed
from shoal.trajectory import Array

SOLVER = {"solver.integrator": "rk4", "solver.step": 5e-3}
SAMPLES = 100
CLOSE, FAR = 1.0, (3.0, 10.0, 30.0)
"""Standard deviations."""


def drawn(seed: int) -> tuple[ForwardModel, Array]:
    """A double pendulum with noise of its own, and the truth: with priors, bounds, logarithms, open directions."""
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-1.2, 1.2, 2)
    truth = dict(zip(("theta1", "theta2"), angles.tolist(), strict=True))
    parameters: dict[str, dict[str, Any]] = {
        name: {"path": f"initial.{body}.angle", "lower": -np.pi, "upper": np.pi}
        for name, body in (("theta1", "OA"), ("theta2", "AB"))
    }
    density = {"lower": 50.0, "upper": 2e4}
    kind = ("plain", "log", "density", "open", "bound", "prior")[seed % 6]
    if kind in ("log", "density", "open"):
        scale = "log" if kind == "log" else "linear"
        parameters["density"] = {"path": "bodies.AB.density", "scale": scale, **density}
        truth["density"] = float(rng.uniform(500, 2000))
    if kind == "open":
        # A free swing knows the ratio of the masses only.
        parameters["other"] = {"path": "bodies.OA.density", **density}
        truth["other"] = 1000.0
    size, loss = 10 ** rng.uniform(-4.5, -2), rng.choice(["squares", "squares", "huber", "cauchy"])
    if kind == "bound":
        parameters["theta1"]["upper"] = truth["theta1"] + 0.1 * size * rng.standard_normal()
    if kind == "prior":
        parameters["theta2"]["prior"] = {"mean": truth["theta2"] + 0.01 * rng.standard_normal(), "std": 0.01}
    problem = Problem.parse(
        {
            "name": kind,
            "scene": "rigid-double-pendulum",
            "values": SOLVER,
            "parameters": parameters,
            "channels": [{"marker": "B", "quantity": axis, "column": axis} for axis in "xy"],
            "source": {"kind": "file"},
            "loss": str(loss),
            "noise": size if kind == "prior" or rng.random() < 0.5 else None,
        },
        kind,
    )
    times = np.arange(1, SAMPLES + 1) / SAMPLES * rng.uniform(0.5, 2.0)
    fields = {parameters[name]["path"]: value for name, value in truth.items()}
    points = get_engine("gauss").simulate(problem.load_scene(fields), times).marker("B")
    rho = rng.choice([0.0, 0.9])
    white = rng.standard_normal((SAMPLES, 2))
    points = points + size * lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], white, axis=0)
    if loss != "squares":
        points[rng.choice(SAMPLES, 5)] += 30 * size * rng.standard_normal((5, 2))
    measurement = Measurement.single(times, tuple(problem.channels), points, "drawn", {}, problem.noise)
    model = ForwardModel(problem, problem.load_scene(), get_engine("gauss"), measurement)
    start = model.parameters.to_vector(np.array([truth[name] for name in model.names]))
    return model, np.clip(start, model.lower, model.upper)


def told(model: ForwardModel, point: Array) -> bool:
    return downhill(model, point, believed(model, point)) is not None


def beside(model: ForwardModel, end: Descent, far: float, rng: np.random.Generator) -> Array:
    """A point so many standard deviations from an optimum, in a random direction of what the data tell."""
    seen, sizes = believed(model, end.point), model.sizes(end.point)
    at = linearise(seen.jacobian, seen.residual, sizes, blocks_of(model, len(seen.residual)))
    values, directions = np.linalg.eigh(at.covariance / np.outer(sizes, sizes))
    known = slice(at.unknown.shape[1], None)
    way = rng.standard_normal(values[known].shape)
    way *= far / np.linalg.norm(way)
    return np.asarray(end.point + sizes * (directions[:, known] @ (np.sqrt(np.maximum(values[known], 0)) * way)))


def shares(seeds: range) -> dict[float, tuple[int, int]]:
    """Of optima (0) and of points beside them, by standard deviations: how many are told, how many there were."""
    found = {far: [0, 0] for far in (0.0, CLOSE, *FAR)}
    for seed in seeds:
        model, start = drawn(seed)
        end = descend(model, start, lambda *_: None)
        if not end.converged:
            continue
        rng = np.random.default_rng(seed)
        for far in (0.0, (CLOSE, *FAR)[seed // 6 % 4]):
            point = beside(model, end, far, rng) if far else end.point
            if np.all((point >= model.lower) & (point <= model.upper)):
                found[far][0] += told(model, point)
                found[far][1] += 1
    return {far: (hits, count) for far, (hits, count) in found.items()}


def test_ends_away_from_the_minimum_are_told() -> None:
    found = shares(range(6, 12))
    assert found[0.0][0] == 0
    assert found[3.0][0] == found[3.0][1] > 3


@pytest.mark.slow
def test_minima_are_seldom_told_and_what_is_far_from_them_seldom_missed() -> None:
    found = shares(range(100, 400))
    hits, count = found[0.0]
    assert count > 280
    assert hits <= 0.01 * count, found
    for far in FAR:
        hits, count = found[far]
        assert hits >= 0.95 * count, found
    hits, count = found[CLOSE]
    assert hits <= 0.1 * count, found


def test_the_verdict_says_so_and_names_the_way_down() -> None:
    model, start = drawn(0)
    end = descend(model, start, lambda *_: None)
    ends = {Verdict.IDENTIFIED: end.point, Verdict.UNFINISHED: beside(model, end, 10.0, np.random.default_rng(1))}
    for verdict, point in ends.items():
        outcome = Outcome(point, float(model.fitness(point[None])[0]), [], "")
        estimate = conclude(model, outcome, "afsa", 0)
        assert estimate.verdict is verdict, estimate.message
    assert estimate.status == "failed"
    assert estimate.codes[0] == "not-stationary"
    assert estimate.findings[0].numbers["better"] < estimate.findings[0].numbers["fitness"]
    assert estimate.advice


def test_an_end_outside_the_bounds_is_no_answer() -> None:
    model, start = drawn(0)
    outside = np.array([start[0], model.upper[1] + 0.1])
    estimate = conclude(model, Outcome(outside, 1.0, [], ""), "iafsa-printed", 0)
    assert estimate.verdict is Verdict.UNFINISHED
    assert estimate.codes == ["out-of-bounds"]
