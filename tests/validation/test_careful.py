"""The contenders of the benchmark of identification do what they are there for, and are no worse than they need be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.exudyn import ExudynEngine
from shoal.scene import Scene, load_scene
from shoal_validation.benchmarks import careful

TIMES = np.linspace(0.0, 0.05, 6)[1:]
TRUTH = np.array([0.7, 0.4])
PATHS = ["initial.OA.angle", "initial.AB.angle"]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("flexible-double-pendulum").with_values({"solver.step": 1e-4, "solver.integrator": "rk4"})


@pytest.fixture(scope="module")
def measured(scene: Scene) -> Any:
    run = get_engine("gauss").simulate(scene.with_values(dict(zip(PATHS, TRUTH.tolist(), strict=True))), TIMES)
    return run.points[:, run.markers.index("B"), :, 0]


def test_a_system_that_is_put_back_moves_as_one_that_is_built_anew(scene: Scene) -> None:
    kept = careful.Kept(scene, TIMES, 500)
    runs = [kept(angles) for angles in (TRUTH, TRUTH + 0.3, TRUTH)]
    assert np.array_equal(runs[0], runs[2])
    started = scene.with_values(dict(zip(PATHS, (TRUTH + 0.3).tolist(), strict=True)))
    anew = ExudynEngine(modified_newton=True).simulate(started, TIMES)
    assert np.allclose(runs[1], anew.points[:, anew.markers.index("B"), :, 0], rtol=0.0, atol=1e-8)


@pytest.mark.slow
def test_both_find_the_angles_and_say_how_well(scene: Scene, measured: Any) -> None:
    noise = 1e-7 * np.random.default_rng(0).standard_normal(measured.shape)
    around = {
        "exudyn": careful.around_exudyn(scene, TIMES, measured + noise),
        "casadi": careful.around_casadi(scene, PATHS, "B", TIMES, measured + noise, 2.5e-4),
    }
    for name, identify in around.items():
        found = identify(TRUTH + np.array([0.02, -0.03]))
        assert np.all(np.abs(found.angles - TRUTH) < 5 * found.deviations), name
        assert np.all(found.deviations < 1e-5), name
        assert found.fitness == pytest.approx(np.mean(np.sum(noise**2, axis=1)), rel=1.0)
        assert found.runs <= 20
