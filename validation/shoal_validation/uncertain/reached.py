"""Demands on uncertain responses: numbers of runs and accuracy. One row for each demand."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from shoal.engines import get_engine
from shoal.engines.ways import on_finer_mesh
from shoal.notebook import uncertain
from shoal.response import Response, respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.machine import ResponseModel
from shoal.response.marginals import Normal, Uniform
from shoal.response.respond import ModelResponse
from shoal.response.runs import Answers
from shoal.scene import load_scene
from shoal.trajectory import Array

from shoal_validation.uncertain.limits import MOST, STATES, repeated
from shoal_validation.uncertain.problems import Problem, pendulum, rod, two

PENDULUM = "flexible-double-pendulum"
FIELDS: Mapping[str, tuple[str, str]] = {
    "initial.OA.angle": ("-2%", "2%"),
    "initial.AB.angle": ("-2%", "2%"),
    "bodies.OA.length": ("-1%", "1%"),
    "bodies.AB.length": ("-1%", "1%"),
    "bodies.OA.youngs_modulus": ("-5%", "5%"),
    "bodies.AB.youngs_modulus": ("-5%", "5%"),
    "bodies.OA.density": ("-5%", "5%"),
    "bodies.AB.density": ("-5%", "5%"),
}
DEMANDS = {2: (1e-6, 20), 4: (1e-5, 120), 8: (1e-4, 700)}
"""Intervals -> error of the bounds of the tip as a share of the width, and runs."""
_OPTIMISED: Mapping[str, Any] = {"method": "optimise", "seed": 9}
JUDGES: Mapping[int, tuple[Mapping[str, Any], ...]] = {
    2: ({"gap": 1e-9, "seed": 1}, {**_OPTIMISED, "count": 500}),
    4: ({"gap": 5e-7, "seed": 1}, {**_OPTIMISED, "count": 3000}),
    8: (*({"seed": seed} for seed in range(1, 6)), {**_OPTIMISED, "count": 6000}),
}
"""The studies that judge them."""
SECONDS, REPEATS = 0.5, 15
"""Of computing with four intervals, at most, and how often it is measured."""
NORMAL = {path: 0.01 if path.endswith("angle") else 0.005 if path.endswith("length") else 0.025 for path in FIELDS}
"""Deviations of normal variables, as shares of what the scene states."""
JUDGING = 16_384
REPETITIONS = 600
ROUNDING = 1e-9
"""Of the width."""
FINE = {1: 400_001, 2: 1001}
"""Places along each axis of the grids that judge."""


@dataclass(frozen=True)
class Reached:
    """name: of the demand; asked: in words; found: in words; met: whether it is"""

    name: str
    asked: str
    found: str
    met: bool


def all_of_them(*, quick: bool = False) -> Iterator[Reached]:
    """Every demand; quick: those of few seconds."""
    yield from motions()
    yield from indices()
    yield normal_terms()
    if not quick:
        for count in DEMANDS:
            yield from double_pendulum(count)
        yield computing()
        yield resonant()
        yield statistics()
        yield from probabilities()


def double_pendulum(count: int) -> Iterator[Reached]:
    """Tip B over 0.5 s, judged by studies with a smaller gap; then the mesh, by runs on one four times as fine."""
    ways = dict(list(FIELDS.items())[:count])
    wanted, runs = DEMANDS[count]
    found = uncertain(PENDULUM, ways)
    judges = [uncertain(PENDULUM, ways, verify=False, **how) for how in JUDGES[count]]
    off, _ = _off(found, judges)
    within, outside = _off(found, judges, found.horizon)
    ends = f"; within its horizon of {found.horizon:g} s {within:.0e}" if not found.ok else ""
    yield Reached(
        f"double pendulum, {count} intervals",
        f"{wanted:.0e} of the width, {runs} runs",
        f"{off:.0e}, {found.evaluations - found.controls} runs beside {found.controls} of control{ends}; outer bounds "
        f"{_held(outside)}",
        off <= wanted and found.evaluations - found.controls <= runs and outside <= ROUNDING,
    )
    moved = _moved(found)
    assert found.mesh_error is not None
    yield Reached(
        f"double pendulum, {count} intervals, mesh",
        "bounds of the continuum within the estimated mesh error",
        f"moved by {moved:.2e} m on four times the elements, {found.mesh_error:.2e} m estimated",
        moved <= found.mesh_error,
    )


def computing() -> Reached:
    """Processor time of four intervals, over all threads; kernels are compiled before."""
    ways, times = dict(list(FIELDS.items())[:4]), list[float]()
    for _ in range(REPEATS):
        begin = time.process_time()
        uncertain(PENDULUM, ways, verify=False)
        times.append(time.process_time() - begin)
    middle = float(np.median(times))
    return Reached(
        "double pendulum, 4 intervals, computing",
        f"{SECONDS:g} s on one core",
        f"{middle:.2f} s, the median of {REPEATS} from {min(times):.2f} to {max(times):.2f} s",
        middle <= SECONDS,
    )


def _off(found: Response, judges: list[Response], until: float = math.inf) -> tuple[float, float]:
    """By how much bounds of B fall short of those of the judges, and outer ones of what these attain, of the width."""
    worst, outside, within = 0.0, -math.inf, found.times <= until
    for axis in found.axes:

        def of(one: Response, side: str, axis: str = axis) -> Array:
            return one.column("B", axis, getattr(one.bounds, side))

        lower = np.min([of(one, "lower") for one in judges], axis=0)
        upper = np.max([of(one, "upper") for one in judges], axis=0)
        width = float((upper - lower).max())
        short = np.maximum(of(found, "lower") - lower, upper - of(found, "upper"))[within]
        beyond = np.maximum(of(found, "lower_outer") - lower, upper - of(found, "upper_outer"))[within]
        worst, outside = max(worst, float(short.max()) / width), max(outside, float(beyond.max()) / width)
    return worst, outside


def _moved(found: Response) -> float:
    """The furthest of B's bounds on a mesh four times as fine [m]; what attains them coarsely is run there."""
    bounds, names = found.bounds, found.inputs.names
    assert bounds is not None
    places = np.unique(np.concatenate([bounds.at_lower, bounds.at_upper]).round(12), axis=0)
    lanes = {name: places[:, k] for k, name in enumerate(names)}
    scene = next(on_finer_mesh(found.stated, 4))
    told = ResponseModel(scene, found.times, get_engine("gauss"))(lanes).values
    moved = [
        np.abs(found.column("B", axis, extreme) - found.column("B", axis, bound))
        for axis in found.axes
        for extreme, bound in ((told.min(axis=0), bounds.lower), (told.max(axis=0), bounds.upper))
    ]
    return float(np.max(moved))


def motions() -> Iterator[Reached]:
    """Motions in closed form at long times."""
    times = np.array([10.0, 100.0, 500.0, 999.0, 1000.0])
    yield _motion("pendulum, length +-2 %, 1000 s", Problem("", 1, tuple(times), pendulum), 1e-7, 9, "rad")
    yield _motion("two frequencies, 100 s", Problem("", 2, (40.0, 100.0), two), 1e-6, 25, "of the width")
    yield _motion("vibrating rod, 200 s", Problem("", 2, (80.0, 200.0), rod), 1e-6, 40, "of the width")


def _motion(name: str, problem: Problem, wanted: float, runs: int, unit: str) -> Reached:
    """Both attained and outer bounds, beside those of a fine grid, which lie inside the true ones by its width squared.

    Where the grid is as coarse as what is asked for, the gap that is told takes its place.
    """
    found = _asked(problem)
    bounds = found.bounds
    assert bounds is not None
    lower, upper = problem.reference(FINE)
    scale = 1.0 if unit == "rad" else float((upper - lower).max())
    pairs = ((bounds.lower_outer, lower), (bounds.upper_outer, upper), (bounds.lower, lower), (bounds.upper, upper))
    off = float(np.max([np.abs(told - true).max() for told, true in pairs])) / scale
    held = bool(np.all(bounds.lower_outer <= lower) and np.all(bounds.upper_outer >= upper))
    if problem.parameters > 1:
        off = bounds.gap
    return Reached(
        name,
        f"{wanted:.0e} {unit}, {runs} runs",
        f"{off:.0e}, {found.runs.own} runs beside {found.runs.controls} of control; outer bounds "
        f"{_held(0.0 if held else 1.0)}",
        off <= wanted and held and found.runs.own <= runs,
    )


def _asked(problem: Problem) -> ModelResponse:
    times, count = np.array(problem.times), len(problem.times)
    return respond(
        problem.at(times),
        problem.inputs,
        count,
        groups=np.zeros(count, dtype=int),
        instants=times,
        over_time=problem.at,
    )


def resonant() -> Reached:
    """Hanging rigid rods of 1 and 2 m, whose frequencies are nearly as one to three."""
    angles = {"initial.OA.angle": -math.pi / 2 + 0.3, "initial.AB.angle": -math.pi / 2 + 0.3}
    solver = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-12, "solver.duration": 100.0}
    scene = load_scene("rigid-double-pendulum").with_values({**angles, **solver})
    path, (low, high), times = "bodies.AB.length", (1.98, 2.02), np.array([10.0, 50.0, 100.0])
    found = uncertain(scene, {path: (low, high)}, times, verify=False)
    bounds = found.bounds
    assert bounds is not None
    lanes = {path: np.linspace(low, high, 4001)}
    motion = get_engine("gauss").simulate_many(scene, lanes, times)
    tip = motion.points[:, motion.markers.index("B")]
    beyond = 0.0
    for k, axis in enumerate(found.axes):
        lower, upper = (found.column("B", axis, of) for of in (bounds.lower_outer, bounds.upper_outer))
        over = np.maximum(lower - tip[:, k].min(axis=-1), tip[:, k].max(axis=-1) - upper)[times <= found.horizon]
        beyond = max(beyond, float(over.max(initial=0.0)))
    return Reached(
        "rods of 1 m and 2 m, near 1:3, 100 s",
        "refused, or right",
        f"{found.status}, horizon {found.horizon:g} s, gap {bounds.gap:.0e}, {found.evaluations} runs; "
        f"4001 runs lie {beyond:.0e} m beyond",
        beyond <= 1e-8,
    )


def statistics() -> Reached:
    """Mean and deviation of the tip with eight normal variables, judged by quasi-random runs."""
    scene = load_scene(PENDULUM)
    ways = [f"{path}~normal({scene.value(path)},{NORMAL[path] * scene.value(path)})" for path in FIELDS]
    found = uncertain(scene, ways, verify=False)
    judge = uncertain(scene, ways, method="sobol", count=JUDGING, runs=JUDGING, seed=7, verify=False)
    one, other = found.statistics, judge.statistics
    assert one is not None
    assert other is not None
    off = {"mean": 0.0, "std": 0.0}
    for axis in found.axes:
        size = float(found.column("B", axis, other.std).max())
        for name in off:
            apart = np.abs(found.column("B", axis, getattr(one, name)) - found.column("B", axis, getattr(other, name)))
            off[name] = max(off[name], float(apart.max()) / size)
    return Reached(
        "double pendulum, eight normal variables",
        "mean and deviation within 1e-03, 300 runs",
        f"{off['mean']:.0e} and {off['std']:.0e} from {JUDGING} quasi-random runs, {found.evaluations} runs",
        max(off.values()) <= 1e-3 and found.evaluations <= 300,
    )


def normal_terms() -> Reached:
    """Eight normal variables of which a few matter, in closed form."""

    def function(values: Mapping[str, Array]) -> Array:
        a, b, c, d, e, f = (values[f"x{k}"] for k in range(6))
        return np.asarray(a**2 + b * c + np.exp(0.3 * d) + 0.1 * e**3 + f)

    growth = math.exp(0.09)
    mean, std = 1 + math.exp(0.045), math.sqrt(4 + growth * (growth - 1) + 0.15)
    answer = _response(function, 8, Normal(0.0, 1.0))
    found = answer.statistics
    assert found is not None
    off = max(abs(found.mean[0] - mean), abs(found.std[0] - std)) / std
    return Reached(
        "a sum of eight normal variables, powers and products",
        "mean and deviation within 1e-03, 300 runs",
        f"{off:.0e}, {answer.runs.evaluations} runs",
        off <= 1e-3 and answer.runs.evaluations <= 300,
    )


def indices() -> Iterator[Reached]:
    """First and total Sobol indices of Ishigami's function and of the g-function."""
    variance = 0.5 + 49 / 8 + math.pi**4 / 50 + math.pi**8 / 1800
    one, other = 0.5 * (1 + math.pi**4 / 50) ** 2 / variance, 49 / 8 / variance
    both = math.pi**8 * (1 / 18 - 1 / 50) / 100 / variance

    def ishigami(v: Mapping[str, Array]) -> Array:
        return np.asarray(np.sin(v["x0"]) + 7 * np.sin(v["x1"]) ** 2 + 0.1 * v["x2"] ** 4 * np.sin(v["x0"]))

    told = _response(ishigami, 3, Uniform(-math.pi, math.pi))
    yield _indices("Ishigami's function", told, np.array([[one, other, 0.0], [one + both, other, both]]))
    weights = np.array([0.0, 1.0, 4.5, 9.0])
    partial = 1 / (3 * (1 + weights) ** 2)

    def kinked(v: Mapping[str, Array]) -> Array:
        return np.asarray(np.prod([(np.abs(4 * v[f"x{k}"] - 2) + a) / (1 + a) for k, a in enumerate(weights)], axis=0))

    whole = np.prod(1 + partial)
    exact = np.array([partial, partial * whole / (1 + partial)]) / (whole - 1)
    yield _indices("the g-function", _response(kinked, 4, Uniform(0.0, 1.0)), exact)


def _response(function: Callable[[Mapping[str, Array]], Array], count: int, of: Normal | Uniform) -> ModelResponse:
    """By `auto`."""

    def model(values: Mapping[str, Array]) -> Answers:
        told = function(values)
        return Answers(told[:, None], np.ones(len(told), dtype=bool))

    return respond(model, Inputs(tuple(UncertainParameter(f"x{k}", of, {f"x{k}": 1.0}) for k in range(count))), 1)


def _indices(name: str, answer: ModelResponse, exact: Array) -> Reached:
    found = answer.statistics
    assert found is not None
    off = float(np.abs(np.stack([found.first[:, 0], found.total[:, 0]]) - exact).max())
    return Reached(f"Sobol indices of {name}", "within 0.01", f"{off:.0e}, {answer.runs.evaluations} runs", off <= 0.01)


def probabilities() -> Iterator[Reached]:
    """Probabilities of limits in closed form, each many times."""
    for state in STATES:
        found = repeated(state, "auto", REPETITIONS)
        yield Reached(
            f"probability: {state}",
            f"within 10 %, 95 % confidence kept in 92 to 98 %, {MOST} runs",
            f"within 10 % in {found.within:.1%}, kept in {found.held:.1%} of {REPETITIONS}, {found.runs} runs at most",
            found.within >= 0.95 and 0.92 <= found.held <= 0.98 and found.doubted <= 0.02 and found.runs <= MOST,
        )


def _held(outside: float) -> str:
    return "hold" if outside <= ROUNDING else f"miss {outside:.0e}"
