"""A sweep says how far it is off, and is not believed where a more careful run of one of its points is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.spot_checks import POINTS, spot_checked
from shoal.engines.sweep import sweep
from shoal.scene import Scene, load_scene
from shoal.trajectory import Status

FINE = {"bodies.OA.elements": 16, "bodies.AB.elements": 32}


def test_the_mesh_error_is_that_against_exudyns_fine_mesh() -> None:
    scene, angles = load_scene("flexible-double-pendulum"), {"initial.OA.angle": np.array([0.75])}
    found = spot_checked(sweep(scene, angles, get_engine("gauss")), get_engine("gauss"))
    exact = get_engine("exudyn").simulate(
        scene.with_values({**FINE, "solver.step": 5e-4, "initial.OA.angle": 0.75}), [scene.solver.duration]
    )
    away = max(float(np.linalg.norm(found.positions[name][0] - exact.marker(name)[-1])) for name in exact.markers)
    assert found.ok
    assert found.check is not None
    assert found.errors.estimates["mesh"] == pytest.approx(away, rel=0.3)
    assert away > 0.01


def test_a_step_that_keeps_the_energy_and_loses_the_motion_is_told() -> None:
    settings = {"solver.integrator": "energy-momentum", "solver.step": 0.05, "solver.duration": 10.0}
    scene = load_scene("rigid-double-pendulum").with_values(settings)
    found = sweep(scene, {"initial.OA.angle": np.linspace(0.0, 1.5, 3)}, get_engine("gauss"))
    assert found.ok
    checked = spot_checked(found, get_engine("gauss"))
    assert not checked.ok
    assert "initial.OA.angle = " in checked.complaint
    assert checked.to_json()["status"] == "failed"


def test_points_from_the_first_to_the_last_are_looked_at_and_failed_ones_are_not() -> None:
    scene = load_scene("single-pendulum").with_values({"solver.duration": 0.2})
    found = sweep(scene, {"initial.OA.angle": np.linspace(0.0, 1.0, 4 * POINTS)}, get_engine("gauss"))
    checked = spot_checked(found, get_engine("gauss"))
    assert checked.check is not None
    assert (checked.check.looked_at, checked.check.points) == (POINTS, 4 * POINTS)
    assert "mesh" not in checked.errors.estimates
    assert 0.0 < checked.errors.known["time"] < 1e-6
    two = sweep(scene, {"initial.OA.angle": np.array([0.1, 0.2])}, get_engine("gauss"))
    failed = replace(two, status=(Status.DIVERGED, Status.OK))
    seen = spot_checked(failed, get_engine("gauss")).check
    assert seen is not None
    assert seen.looked_at == 1


def test_points_that_fail_side_by_side_go_on_as_one_alone_does() -> None:
    """A rod that turns at 30 rad/s is longer and stiffer than at the start, which tells leapfrog its step."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.02, "density": 2700.0, "element": "ancf-cable"}
    scene = Scene.parse(
        {
            "name": "spinning",
            "gravity": [0.0, 0.0],
            "bodies": {"r": rod | {"youngs_modulus": 7.0e10, "elements": 4}},
            "joints": {"O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "r", "point": "start"}}},
            "markers": {"e": {"body": "r", "point": "end"}},
            "initial": {"r": {"rate": 30.0}},
            "solver": {"duration": 1.0, "samples": 10},
        }
    )
    rates = {"initial.r.rate": np.array([0.1, 28.0, 30.0, 32.0])}
    failed = get_engine("gauss").simulate_many(scene, rates, [1.0]).status
    assert failed[0] is Status.OK
    assert Status.OK not in failed[1:]
    found = sweep(scene, rates, get_engine("gauss"))
    assert found.ok, found.complaint
    reached = np.linalg.norm(found.positions["e"], axis=1)
    # (EA u')' = -rho A w^2 x, small strains: the rod is longer by rho w^2 L^3 / (3 E).
    longer = 2700 * rates["initial.r.rate"] ** 2 / (3 * 7e10)
    np.testing.assert_allclose(reached - 1, longer, rtol=0.01, atol=2e-10)
