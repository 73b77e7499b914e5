"""A prepared scene gives what a simulation gives, every time, to everybody who asks."""

from __future__ import annotations

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
import shoal
from shoal.engines import get_engine
from shoal.engines.prepared import Prepared
from shoal.errors import InputError
from shoal.mechanics import simulate as simulating
from shoal.mechanics.integrators import INTEGRATORS, pick
from shoal.scene import Scene, load_scene, scene_names
from shoal.trajectory import Status, Trajectory

FLEXIBLE = load_scene("flexible-double-pendulum")
RIGID = load_scene("rigid-double-pendulum")
SPRING = {
    "kind": "torsion-spring",
    "first": {"body": "ground", "point": [0.0, 0.0]},
    "second": {"body": "OA", "point": "start"},
    "stiffness": 3.0,
    "damping": 0.1,
    "angle": 7.0,
}
LONG_TO_COMPILE = ("flyball-governor", "swinging-strip", "flexible-spherical-double-pendulum")
"""Their time loops in space take up to a minute."""


def assert_same(one: Trajectory, other: Trajectory) -> None:
    """Equal to the last bit, but for the seconds it took."""
    for field in fields(Trajectory):
        if field.name != "wall_s":
            np.testing.assert_equal(getattr(one, field.name), getattr(other, field.name), err_msg=field.name)


def repeated(scene: shoal.Scene, **asked: Any) -> Trajectory:
    """The third of three runs, after another one between."""
    prepared = Prepared(scene)
    prepared(**asked)
    prepared(times=[3 * scene.solver.step])
    prepared(**asked)
    return prepared(**asked)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG_TO_COMPILE)) for name in scene_names()],
)
@pytest.mark.by_day(3)
def test_every_scene_repeats_itself(name: str) -> None:
    scene = load_scene(name)
    times = scene.solver.step * np.array([1.0, 7.5, 10.0])
    assert_same(repeated(scene, times=times), Prepared(scene)(times=times))
    assert_same(repeated(scene, times=times), shoal.simulate(scene, times, verify=False))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_every_integrator_starts_afresh(integrator: str) -> None:
    scene = FLEXIBLE.with_values({"solver.integrator": integrator})
    times = 5e-4 * np.array([0.0, 4.2, 8.0])
    assert_same(repeated(scene, times=times), Prepared(scene)(times=times))


@pytest.mark.parametrize(
    "values",
    [
        pytest.param({"initial.OA.angle": 0.3, "bodies.AB.length": 1.5}, id="numbers"),
        pytest.param({"gravity": [0.0, -1.6]}, id="a vector"),
    ],
)
def test_values_are_those_of_the_scene(values: dict[str, Any]) -> None:
    times = np.array([0.01, 0.02])
    assert_same(repeated(RIGID, values=values, times=times), shoal.simulate(RIGID, times, set=values, verify=False))


@pytest.mark.parametrize(
    ("path", "value"), [("initial.OA.angle", 0.6), ("initial.AB.rate", 0.6), ("bodies.AB.length", 2.2)]
)
def test_lanes_are_those_of_the_engine(path: str, value: float) -> None:
    lanes = np.linspace(0.9, 1.1, 19) * value
    times = np.array([0.01, 0.02])
    found = repeated(FLEXIBLE, values={path: lanes, "bodies.OA.density": 5000.0}, times=times)
    lighter = FLEXIBLE.with_values({"bodies.OA.density": 5000.0})
    assert_same(found, get_engine("gauss").simulate_many(lighter, {path: lanes}, times))
    alone = shoal.simulate(lighter, times, set={path: float(lanes[11])}, verify=False)
    np.testing.assert_allclose(found.points[..., 11], alone.points[..., 0], rtol=0, atol=1e-11)


def test_a_wound_spring_is_wound_again() -> None:
    scene = RIGID.with_values({"loads": {"spring": SPRING}})
    assert_same(repeated(scene, times=[0.5]), Prepared(scene)(times=[0.5]))


def test_what_somebody_does_to_a_trajectory_stays_with_it() -> None:
    prepared, untouched = Prepared(RIGID), Prepared(RIGID)(times=[0.01])
    times = np.array([0.01])
    run = prepared(times=times)
    run.points[:] = np.nan
    run.model["initial"]["OA"]["angle"] = 0.0
    times[0] = 0.02
    assert_same(prepared(times=[0.01]), untouched)
    assert prepared(times=times).times[0] == 0.02


def test_threads_share_a_prepared_scene() -> None:
    prepared = Prepared(RIGID)
    asked = [np.linspace(0.0, end, 5)[1:] for end in (0.2, 0.3)] * 20
    with ThreadPoolExecutor(4) as pool:
        runs = list(pool.map(lambda times: prepared(times=times), asked))
    for run, times in zip(runs, asked, strict=True):
        assert_same(run, Prepared(RIGID)(times=times))


def test_a_copy_starts_with_the_scene_alone() -> None:
    prepared = Prepared(RIGID)
    run = prepared(times=[0.01])
    for other in (pickle.loads(pickle.dumps(prepared)), copy.deepcopy(prepared)):
        assert_same(other(times=[0.01]), run)


def test_a_run_that_fails_does_so_each_time() -> None:
    scene = RIGID.with_values({"solver.integrator": "leapfrog", "solver.step": 0.05, "initial.AB.rate": 20.0})
    prepared = Prepared(scene)
    first, second = prepared(times=[2.0]), prepared(times=[2.0])
    assert first.status[0] is not Status.OK
    assert_same(first, second)
    assert_same(first, shoal.simulate(scene, [2.0], verify=False))


def test_bad_questions_are_refused_each_time() -> None:
    prepared = Prepared(FLEXIBLE.with_values({"solver.step": 1e-2}))
    for _ in range(2):
        with pytest.raises(InputError, match="stability limit"):
            prepared(times=[0.1])
        with pytest.raises(InputError, match=r"at: must increase, found 0\.1 after 0\.2 s"):
            prepared(times=[0.2, 0.1])
        with pytest.raises(InputError, match="no such field"):
            prepared({"bodies.OA.colour": 1.0})
        with pytest.raises(InputError, match="bodies"):
            prepared({"bodies.OA.length": np.array([1.0, -1.0])}, [0.1])


@pytest.mark.parametrize(("axis", "shared"), [([0, 0, 1], True), ([1, 0, 1], False)])
def test_lanes_in_space_share_the_model_unless_joints_take_numbers_from_their_start(
    axis: list[float], shared: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene.parse({
        "name": "pendulum", "dimensions": 3,
        "bodies": {"OA": {"kind": "rod", "length": 1.0, "height": 0.1, "width": 0.05, "density": 1000.0}},
        "joints": {"O": {"kind": "revolute", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "OA"},
                         "axis": axis}},
        "markers": {"A": {"body": "OA", "point": "end"}},
        "initial": {"OA": {"angle": 0.3}},
        "solver": {"integrator": "rk4", "step": 1e-2, "duration": 0.2},
    })  # fmt: skip
    angles, times = np.array([0.3, 0.8, 1.3]), [0.1, 0.2]
    run = Prepared(scene)
    assert run(times=times).ok
    made = []
    monkeypatch.setattr(simulating, "pick", lambda *asked: made.append(asked) or pick(*asked))
    found = run({"initial.OA.angle": angles}, times)
    assert found.ok
    assert len(made) == (not shared)
    for lane, angle in enumerate(angles):
        alone = Prepared(scene.with_values({"initial.OA.angle": float(angle)}))(times=times)
        np.testing.assert_allclose(found.points[..., lane], alone.points[..., 0], atol=1e-12)


def test_later_changes_of_a_scene_do_not_reach_it() -> None:
    scene = load_scene("single-pendulum")
    run = Prepared(scene)
    before = run(times=[0.1]).points
    dict.clear(scene.initial)
    dict.clear(run.scene.initial)
    assert np.array_equal(run(times=[0.1]).points, before)
