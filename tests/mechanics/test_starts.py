"""Many starts of one scene: by the law that is found once, and by walking along the joints for every one."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.mechanics.assembly.build import build, with_start
from shoal.mechanics.assembly.starts import Starts
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene

LANES = 7
ROD = {"kind": "rod", "height": 0.02, "width": 0.04, "density": 5540.0, "element": "rigid"}
THROWN = {
    "name": "thrown",
    "gravity": [0.0, -9.81],
    "bodies": {"one": {**ROD, "length": 1.0}, "two": {**ROD, "length": 2.0}},
    "joints": {
        "A": {"kind": "revolute", "first": {"body": "one", "point": "end"}, "second": {"body": "two", "point": "start"}}
    },
    "markers": {"B": {"body": "two", "point": "end"}},
    "initial": {"one": {"position": [0.3, -0.2], "velocity": [1.0, 2.0]}},
    "solver": {"duration": 1.0, "step": 1e-3, "integrator": "dop853", "samples": 10},
}


def scenes() -> dict[str, Scene]:
    names = "flexible-double-pendulum", "kaheman-double-pendulum", "parallelogram"
    return {name: load_scene(name) for name in names} | {"thrown": Scene.parse(THROWN, "thrown")}


@pytest.mark.parametrize("name", scenes())
def test_starts_by_angles_and_rates_are_those_of_the_walk(name: str) -> None:
    scene = scenes()[name]
    rng = np.random.default_rng(0)
    body = next(iter(scene.bodies))
    some = [f"initial.{body}.angle"]
    every = [f"initial.{body}.{quantity}" for body in scene.bodies for quantity in ("angle", "rate")]
    for paths in (some,) if name == "parallelogram" else (some, every):
        values = {path: rng.uniform(-0.4, 0.4, LANES) for path in paths}
        model = build(scene)
        quick = Starts(scene, model).at(values, LANES)
        walked = with_start(model, scene.with_lanes(values), LANES)
        assert quick.lanes == walked.lanes == LANES
        for part in ("q0", "v0", "start_angles"):
            one, other = getattr(quick, part), getattr(walked, part)
            assert np.allclose(one, np.broadcast_to(other, one.shape), rtol=0.0, atol=3e-15)


@pytest.mark.parametrize("name", ["flexible-double-pendulum", "kaheman-double-pendulum", "thrown"])
def test_the_start_by_itself_is_what_a_motion_begins_with(name: str) -> None:
    scene = scenes()[name].with_values({"solver.integrator": "rk4"})
    rng = np.random.default_rng(1)
    paths = [f"initial.{body}.{quantity}" for body in scene.bodies for quantity in ("angle", "rate")]
    values = {path: rng.uniform(-4.0, 4.0, LANES) for path in paths}
    for lanes in (values, None):
        still, moving = (simulate(scene, times, lanes) for times in (np.zeros(1), np.array([0.0, 1e-5])))
        assert still.status == moving.status
        assert still.ok
        for part in ("points", "angles", "velocities", "rates"):
            assert np.allclose(getattr(still, part)[0], getattr(moving, part)[0], rtol=0.0, atol=1e-13), part
        assert (still.steps, still.model.get("initial")) == (0, moving.model.get("initial"))
        assert not np.any(still.energy_drift)
