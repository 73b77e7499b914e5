"""A sweep says how far it is off, and is not believed where a more careful run of one of its points is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.spot_checks import POINTS, spot_checked
from shoal.engines.sweep import sweep
from shoal.scene import load_scene
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
    assert found.check.mesh_error == pytest.approx(away, rel=0.3)
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
    assert checked.check.mesh_error is None
    assert checked.check.time_error is not None
    assert checked.check.time_error < 1e-6
    two = sweep(scene, {"initial.OA.angle": np.array([0.1, 0.2])}, get_engine("gauss"))
    failed = replace(two, status=(Status.DIVERGED, Status.OK))
    seen = spot_checked(failed, get_engine("gauss")).check
    assert seen is not None
    assert seen.looked_at == 1
