"""Machines that hang on a crank which is driven, at rest or not: against scipy on the equations of what hangs on it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines.gauss import GaussEngine
from shoal.engines.verification import verified
from shoal.mechanics.assembly.build import build
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.trajectory import Array

GROUND = {"body": "ground", "point": [0.0, 0.0]}


def hanging(angle: Any, crank: float, arm: float, start: dict[str, float], **solver: Any) -> Scene:
    """A uniform rod on the end of a crank that turns by a function of time."""
    rod = {"kind": "rod", "height": 0.005, "width": 0.005, "density": 7800.0}
    return Scene.parse({
        "name": "hanging", "bodies": {"c": rod | {"length": crank}, "p": rod | {"length": arm}},
        "joints": {"O": {"first": GROUND, "second": {"body": "c"}},
                   "q": {"first": {"body": "c", "point": "end"}, "second": {"body": "p"}},
                   "D": {"kind": "driven-angle", "first": GROUND, "second": {"body": "c"}, "angle": angle}},
        "markers": {"e": {"body": "p", "point": "end"}}, "initial": {"p": start}, "solver": solver,
    })  # fmt: skip


def swung(drive: Any, crank: float, arm: float, start: dict[str, float], times: Array, longest: float) -> Array:
    """Where the end of the rod is; drive: angle [rad] of the crank with two derivatives."""

    def rates(t: float, y: Any) -> list[float]:
        angle, rate, bend = drive(t)
        x = -crank * (np.sin(angle) * bend + np.cos(angle) * rate**2)
        up = crank * (np.cos(angle) * bend - np.sin(angle) * rate**2) + 9.81
        return [y[1], 1.5 / arm * (np.sin(y[0]) * x - np.cos(y[0]) * up)]

    found = solve_ivp(rates, (0, times[-1]), [start["angle"], start["rate"]], "DOP853", times, rtol=1e-13, atol=1e-14,
                      max_step=longest).y[0]  # fmt: skip
    angle = np.array([drive(t)[0] for t in times])
    return np.stack([crank * f(angle) + arm * f(found) for f in (np.cos, np.sin)], axis=1)


def ramp(x: float) -> tuple[float, float, float]:
    x = min(max(x, 0.0), 1.0)
    return 10 * x**3 - 15 * x**4 + 6 * x**5, 30 * x**2 * (1 - x) ** 2, 60 * x - 180 * x**2 + 120 * x**3


@pytest.mark.parametrize("seed", range(4))
def test_a_crank_that_rests_lets_go_on_what_hangs_on_it(seed: int) -> None:
    """Round-off of a row that is no part of the drive was taken for a condition while the crank was at rest."""
    rng = np.random.default_rng(seed)
    crank, arm = rng.uniform(0.05, 0.5, 2)
    way, begin, long = rng.uniform(0.05, 2.0), float(rng.choice([0.0, 0.3])), rng.uniform(0.2, 0.8)
    start = {"angle": rng.uniform(-3, 3), "rate": float(rng.choice([0.0, rng.normal()]))}
    times = np.array([0.5, 1.0, 1.5])

    def drive(t: float) -> tuple[float, float, float]:
        value, rate, bend = ramp((t - begin) / long)
        return way * value, way * rate / long, way * bend / long**2

    wanted = swung(drive, crank, arm, start, times, 0.01)
    scene = hanging(f"{way}*ramp((t - {begin})/{long})", crank, arm, start, duration=1.5)
    run = simulate(scene, times)
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("e"), wanted, atol=1e-6)
    # Side by side as well: a tile has a way of its own.
    lanes = simulate(scene, times, {"initial.p.rate": start["rate"] + np.linspace(0.0, 0.1, 9)})
    assert lanes.ok
    np.testing.assert_allclose(lanes.points[:, 0, :, 0], wanted, atol=1e-6)


@pytest.mark.parametrize("integrator", ["generalized-alpha", "energy-momentum"])
def test_drives_leave_multipliers_unique(integrator: str) -> None:
    """A driven direction has its length by the drive: one more constraint for that made the power of implicit steps
    round-off times multipliers without a bound, where the direction passes an axis."""
    rng = np.random.default_rng(5)
    times = np.array([0.5, 1.0])
    for _ in range(6):
        crank, arm = rng.uniform(0.1, 0.5, 2)
        way, pace, start = rng.uniform(-2, 2), rng.uniform(1, 3), {"angle": rng.uniform(-3, 3), "rate": 0.0}
        radius, step = rng.uniform(0, 1), 2.5e-4

        def drive(t: float, way: float = way, pace: float = pace) -> tuple[float, float, float]:
            s, c = np.sin(pace * t), np.cos(pace * t)
            return way * s, way * pace * c, -way * pace**2 * s

        settings = {"integrator": integrator, "spectral_radius": radius, "step": step, "duration": 1.0}
        scene = hanging(f"{way}*sin({pace}*t)", crank, arm, start, **settings)
        model = build(scene)
        assert model.constraints.size == 3  # two of the drive, and the length of what hangs on it
        run = simulate(scene, times)
        assert run.ok, run.message
        np.testing.assert_allclose(run.marker("e"), swung(drive, crank, arm, start, times, 0.01), atol=1e-3)


@pytest.mark.by_day(1)
@pytest.mark.parametrize("tolerance", [1e-10, 1e-12])
def test_the_estimated_error_of_an_open_chain_is_that_of_its_tolerance(tolerance: float) -> None:
    """A drive closes no loop: the looser run is a hundred times worse, and nothing near a singular position."""
    rng = np.random.default_rng(11)
    times = np.linspace(0.0, 2.0, 9)[1:]
    for _ in range(6):
        crank, arm = rng.uniform(0.05, 0.3, 2)
        way, pace, start = rng.uniform(0.5, 2), rng.uniform(1, 3), {"angle": rng.uniform(-3, 3), "rate": 0.0}

        def drive(t: float, way: float = way, pace: float = pace) -> tuple[float, float, float]:
            s, c = np.sin(pace * t), np.cos(pace * t)
            return way * s, way * pace * c, -way * pace**2 * s

        tolerances = {"relative_tolerance": tolerance, "absolute_tolerance": 0.1 * tolerance}
        scene = hanging(f"{way}*sin({pace}*t)", crank, arm, start, duration=2.0, **tolerances)
        run = verified(GaussEngine(), scene, times)
        assert run.ok, run.message
        wanted = swung(drive, crank, arm, start, times, 0.01)
        error = float(np.max(np.linalg.norm(run.marker("e") - wanted, axis=1)))
        assert 0.5 * error <= run.model["verification"]["time_error"] <= 100.0 * error
        assert run.model["distance_from_singular"] > 0.1


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("unit", [1.0, 1e-2, 1e-4, 1e-6])
@pytest.mark.by_day(2)
def test_a_drive_may_be_as_fast_as_it_likes(unit: float, dimensions: int) -> None:
    """What it asks of the start is its derivative there, and no difference over a tenth of a millisecond."""
    rate = 20.0 / unit
    start = {"angle": 0.7, "rate": 0.0}
    times = unit * np.array([0.2, 0.5, 1.0])

    def drive(t: float) -> tuple[float, float, float]:
        return 0.5 * np.sin(rate * t), 0.5 * rate * np.cos(rate * t), -0.5 * rate**2 * np.sin(rate * t)

    wanted = swung(drive, 0.1, 0.12, start, times, 1e-3 * unit)
    run = simulate(placed(hanging(f"0.5*sin({rate}*t)", 0.1, 0.12, start, duration=unit), dimensions), times)
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("e")[:, :2], wanted, atol=1e-6)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_drive_may_begin_where_it_has_a_limit_only(dimensions: int) -> None:
    """It was refused: "joint D starts nan m apart"."""

    def drive(t: float) -> tuple[float, float, float]:
        # Where t is small the terms cancel; the series leaves out t**8.
        if t < 0.1:
            square = t * t
            return (
                1 - square / 6 * (1 - square / 20 * (1 - square / 42)),
                -t / 3 * (1 - square / 10 * (1 - square / 28)),
                -1 / 3 + square / 10 * (1 - 5 * square / 84),
            )
        s, c = np.sin(t) / t, np.cos(t)
        return s, (c - s) / t, -s - 2 * (c - s) / t**2

    start, times = {"angle": 0.7, "rate": 0.0}, np.array([0.5, 1.0, 2.0])
    wanted = swung(drive, 0.1, 0.12, start, times, 0.01)
    run = simulate(placed(hanging("sin(t)/t", 0.1, 0.12, start, duration=2.0), dimensions), times)
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("e")[:, :2], wanted, atol=1e-6)


def placed(scene: Scene, dimensions: int) -> Scene:
    """The scene as it is, or in space with the same weight."""
    if dimensions == 2:
        return scene
    data = scene.model_dump(mode="json", exclude_unset=True)
    return Scene.parse(data | {"dimensions": 3, "gravity": [0.0, -9.81, 0.0]})
