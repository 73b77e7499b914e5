"""Linkages of equal cranks that rest on one line, where branches of their motion cross, against their one equation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines.gauss import GaussEngine
from shoal.engines.verification import verified
from shoal.scene import Scene

G = 9.81
TIMES = np.linspace(0.0, 3.0, 31)[1:]


def draw(seed: int, count: int, rate: float, **solver: Any) -> tuple[Scene, Any]:
    """A coupler on parallel cranks of 1 m with random bodies, flat at the start, and the tip of the first crank."""
    rng = np.random.default_rng(seed)
    masses, places, inertias = rng.uniform(0.3, 3.0, count), rng.uniform(0.2, 0.9, count), rng.uniform(0.02, 0.3, count)
    pins = np.cumsum(np.append(0.0, rng.uniform(0.3, 1.0, count - 1)))
    mass, place, inertia = rng.uniform(0.3, 3.0), rng.uniform(0.0, 2.0), rng.uniform(0.05, 0.5)
    bodies, joints, initial = {}, {}, {"c": {"angle": 0.0}}
    body = {"kind": "rigid-body", "mass": mass, "inertia": inertia, "centre_of_mass": [place, 0.0]}
    bodies["c"] = body | {"named_points": {f"p{k}": [pin, 0.0] for k, pin in enumerate(pins)}}
    for k, pin in enumerate(pins):
        crank = {"kind": "rigid-body", "mass": masses[k], "inertia": inertias[k], "centre_of_mass": [places[k], 0.0]}
        bodies[f"k{k}"] = crank | {"named_points": {"e": [1.0, 0.0]}}
        joints[f"P{k}"] = {"first": {"body": "ground", "point": [pin, 0.0]}, "second": {"body": f"k{k}"}}
        joints[f"Q{k}"] = {"first": {"body": f"k{k}", "point": "e"}, "second": {"body": "c", "point": f"p{k}"}}
        initial[f"k{k}"] = {"angle": 0.0} | ({"rate": rate} if rate else {})
    scene = Scene.parse(
        {
            "name": "cranks",
            "gravity": [0.0, -G],
            "bodies": bodies,
            "joints": joints,
            "markers": {"tip": {"body": "k0", "point": "e"}},
            "initial": initial,
            "solver": {"duration": TIMES[-1], **solver},
        }
    )
    whole = np.sum(inertias + masses * places**2) + mass
    pull = G * (np.sum(masses * places) + mass) / whole
    angle = solve_ivp(
        lambda t, y: [y[1], -pull * np.cos(y[0])],
        (0.0, TIMES[-1]),
        [0.0, rate],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
        t_eval=TIMES,
    ).y[0]
    return scene, np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("rate", [0.0, -1.0])
def test_cranks_leave_and_pass_their_flat_position(count: int, rate: float) -> None:
    scene, tip = draw(count, count, rate)
    run = GaussEngine().simulate(scene, TIMES)
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("tip"), tip, atol=1e-8)
    assert run.steps < 3000  # steps do not end at round-off: 30,000 for a hundredth of a millisecond once
    assert run.model["distance_from_singular"] < 1e-5


def _check(seed: int) -> None:
    """The estimated error of a random machine of the kind by a random integrator covers the true one by half."""
    rng = np.random.default_rng(1000 + seed)
    tolerance = float(rng.choice([1e-12, 1e-10, 1e-8, 1e-6]))
    integrator = str(rng.choice(["dop853", "dop853", "radau5", "rk4"]))
    settings = {"relative_tolerance": tolerance, "absolute_tolerance": 0.1 * tolerance, "integrator": integrator}
    scene, tip = draw(seed, int(rng.integers(2, 6)), float(rng.choice([0.0, 0.0, -1.0, -4.0, 2.0])), **settings)
    run = verified(GaussEngine(), scene, TIMES)
    if run.ok:
        error = float(np.max(np.linalg.norm(run.marker("tip") - tip, axis=1)))
        assert error <= 2.0 * run.model["verification"]["time_error"], seed
    else:
        assert run.message


@pytest.mark.parametrize("seed", range(4))
def test_the_estimated_error_covers_the_true_one(seed: int) -> None:
    _check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4, 80))
def test_the_estimated_error_covers_the_true_one_of_many(seed: int) -> None:
    _check(seed)


@pytest.mark.slow
def test_lanes_move_as_single_runs_do() -> None:
    scene, _ = draw(3, 3, 0.0)
    rates = np.linspace(-1.0, 0.0, 9)
    lanes = GaussEngine().simulate_many(scene, {f"initial.k{k}.rate": rates for k in range(3)}, TIMES)
    for number, rate in enumerate(rates):
        alone = GaussEngine().simulate(scene.with_values({f"initial.k{k}.rate": rate for k in range(3)}), TIMES)
        # Cranks that turn back just behind their flat position magnify round-off ten thousand times.
        np.testing.assert_allclose(lanes.points[:, 0, :, number], alone.points[:, 0, :, 0], rtol=0, atol=1e-6)


def test_the_distance_from_singular_positions_is_that_of_the_transmission_angle() -> None:
    """Four-bars that turn near to their change point, where coupler and rocker come near to one line."""
    rng = np.random.default_rng(7)
    ways = []
    for _ in range(8):
        crank, ground, rocker = rng.uniform(0.3, 0.6), rng.uniform(1.0, 1.5), rng.uniform(0.7, 1.3)
        coupler = (ground + rocker - crank) * (1.0 - 10.0 ** rng.uniform(-6, -2))
        bodies = {}
        for name, length in (("k", crank), ("c", coupler), ("r", rocker)):
            body = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.2, "centre_of_mass": [0.5 * length, 0.0]}
            bodies[name] = body | {"named_points": {"e": [length, 0.0]}}
        origin = [0.0, 0.0]
        ends = [(["ground", origin], ["k", origin]), (["k", "e"], ["c", origin])]
        ends += [(["c", "e"], ["r", "e"]), (["ground", [ground, 0.0]], ["r", origin])]
        joints = {}
        for number, ((one, here), (other, there)) in enumerate(ends):
            sides = {"first": {"body": one, "point": here}, "second": {"body": other, "point": there}}
            joints[f"J{number}"] = sides
        way = ground - crank * np.exp(1j)
        turn = np.arccos((coupler**2 + abs(way) ** 2 - rocker**2) / (2 * coupler * abs(way)))
        initial = {"k": {"angle": 1.0, "rate": 6.0}, "c": {"angle": float(np.angle(way) + turn)}}
        markers = {"c": {"body": "c"}, "r": {"body": "r"}}
        data = {"name": "bars", "gravity": [0.0, 0.0], "bodies": bodies, "joints": joints, "markers": markers}
        run = GaussEngine().simulate(Scene.parse(data | {"initial": initial}), np.linspace(0.0, 2.0, 2001)[1:])
        assert run.ok, run.message
        least = float(np.min(np.abs(np.sin(run.angles[:, 0, 0] - run.angles[:, 1, 0]))))
        assert 0.2 * least < run.model["distance_from_singular"] < 5.0 * least
        ways.append(least)
    assert min(ways) < 3e-3 < 3e-2 < max(ways)
