"""Linkages of equal cranks that are driven out of their flat position, where branches of their motion cross.

The crank has the angle of its drive, so the closure alone defines each branch: the coupler is parallel (c = 0), or of
two cranks a distance L apart the other root c of |exp(i angle) + L exp(i c) - L| = 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from shoal.engines.gauss import GaussEngine
from shoal.scene import Scene

TIMES = np.array([1e-6, 1e-4, 1e-3, 0.01, 0.1, 0.3])


def draw(seed: int, count: int, drive: str, rates: dict[str, float]) -> tuple[Scene, Any]:
    """Cranks of 1 m with random bodies at rest or with stated rates [rad/s], and the places of their pins [m]."""
    rng = np.random.default_rng(seed)
    pins = np.cumsum(np.append(0.0, rng.uniform(0.3, 0.8, count - 1)))
    bodies, joints = {}, {}
    body = {"kind": "rigid-body", "mass": rng.uniform(0.3, 3.0), "inertia": rng.uniform(0.05, 0.5)}
    points = {f"p{k}": [pin, 0.0] for k, pin in enumerate(pins)}
    bodies["c"] = body | {"centre_of_mass": [rng.uniform(0.0, 2.0), 0.0], "named_points": points}
    ground: dict[str, Any] = {"body": "ground", "point": [0.0, 0.0]}
    for k, pin in enumerate(pins):
        mass, inertia = rng.uniform(0.3, 3.0), rng.uniform(0.02, 0.3)
        crank = {"kind": "rigid-body", "mass": mass, "inertia": inertia, "named_points": {"e": [1.0, 0.0]}}
        bodies[f"k{k}"] = crank | {"centre_of_mass": [rng.uniform(0.2, 0.9), 0.0]}
        joints[f"P{k}"] = {"first": {"body": "ground", "point": [pin, 0.0]}, "second": {"body": f"k{k}"}}
        joints[f"Q{k}"] = {"first": {"body": f"k{k}", "point": "e"}, "second": {"body": "c", "point": f"p{k}"}}
    joints["D"] = {"kind": "driven-angle", "first": ground, "second": {"body": "k0"}, "angle": drive}
    initial = {name: {"angle": 0.0} | ({"rate": rates[name]} if name in rates else {}) for name in bodies}
    data = {"name": "cranks", "gravity": [0.0, -9.81], "bodies": bodies, "joints": joints, "initial": initial}
    markers, solver = {"c": {"body": "c"}, "k": {"body": "k0"}}, {"duration": TIMES[-1], "max_steps": 1000}
    return Scene.parse(data | {"markers": markers, "solver": solver}), pins


def mirrored(angle: float, distance: float) -> float:
    """The coupler's angle [rad] on the antiparallel branch of two cranks a distance [m] apart, at a small angle."""

    def open_by(turn: float) -> float:  # 0 too at turn = 0, which is divided out
        way = np.exp(1j * angle) + distance * (np.exp(1j * turn) - 1.0)
        return float((abs(way) ** 2 - 1.0) / turn)

    near = 2.0 * angle / (1.0 - distance)
    return float(brentq(open_by, 0.5 * near, 1.5 * near, xtol=1e-15, rtol=1e-14))


def off_branch(run: Any, pins: Any) -> float:
    """How far the coupler is from the nearer of the branches of its motion [rad], at most over time."""
    angles = run.angles[:, :, 0]
    parallel = np.abs(angles[:, 0])
    if len(pins) > 2:  # the others cannot be mirrored all at once
        return float(np.max(parallel))
    other = np.array([mirrored(crank, pins[1]) for crank in angles[:, 1]])
    return float(min(np.max(parallel), np.max(np.abs(angles[:, 0] - other))))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.by_day(1)
def test_a_drive_that_moves_at_once_starts_on_a_branch(count: int, seed: int) -> None:
    """Rates were met by the nearest change: of no branch, on to which the motion snapped after milliseconds."""
    rate = np.random.default_rng(seed).uniform(0.2, 2.0)
    scene, pins = draw(seed, count, f"{rate}*sin(2*t)/2", {})
    run = GaussEngine().simulate(scene, TIMES)
    assert run.ok, run.message
    np.testing.assert_allclose(run.angles[:, 1, 0], 0.5 * rate * np.sin(2 * TIMES), atol=1e-12)
    assert off_branch(run, pins) < 1e-11
    assert run.energy_drift[0] < 1e-6


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("drive", ["0.4*(1-cos(2*t))", "1.5*t**2", "0.3*t**3", "0.5*t**5", "max(0,t-0.05)**2"])
@pytest.mark.by_day(7)
def test_a_drive_that_sets_out_from_rest_leaves_on_a_branch(count: int, seed: int, drive: str) -> None:
    """Its first derivatives by time vanish there: the motion left on no branch, or crept beside it to its last step."""
    scene, pins = draw(seed, count, drive, {})
    run = GaussEngine().simulate(scene, TIMES)
    assert run.ok, run.message
    assert run.steps < 300
    assert off_branch(run, pins) < 1e-11
    assert run.energy_drift[0] < 1e-6


@pytest.mark.parametrize("count", [2, 3])
def test_a_held_crank_holds_the_others(count: int) -> None:
    """No branch passes with the crank at rest; a coordinate that the crank holds was taken for the direction of one."""
    scene, pins = draw(0, count, "0", {})
    run = GaussEngine().simulate(scene, TIMES)
    assert run.ok, run.message
    assert off_branch(run, pins) < 1e-12


def test_a_run_that_creeps_names_the_singular_position() -> None:
    scene, _ = draw(0, 2, "0.3*t**3", {})
    run = GaussEngine().simulate(scene.with_values({"solver.max_steps": 3}), TIMES)
    assert not run.ok
    assert run.codes == ["creeps-at-singular-position"]
