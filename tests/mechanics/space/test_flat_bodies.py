"""Bodies without thickness, which move no mass along one of their axes, against Newton's and Euler's equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from shoal.mechanics.assembly.masses import second_moments
from shoal.mechanics.simulate import simulate, stable_step
from shoal.scene import RigidBody, Scene
from shoal_validation.stability.singular_in_space import MACHINES, TURN

FLAT = [0.04, 0.01, 0.03]
THICK = [0.036, 0.01, 0.03]
OBLIQUE = Rotation.from_rotvec([0.4, 0.7, -0.3]).as_matrix() @ np.diag(FLAT) @ np.array(
    Rotation.from_rotvec([0.4, 0.7, -0.3]).as_matrix()
).T  # fmt: skip
AXIS = [0.2, 0.3, 1.0]
BEGIN, SPIN = Rotation.from_rotvec([0.3, -0.2, 0.5]), np.array([1.0, 4.0, -0.5])
PIN, HOOK, HUNG = np.array([0.1, 0.05, 0.0]), np.array([-0.1, 0.2, 0.1]), np.array([0.3, 0.4, 0.5])
APART = np.array([0.0, 0.0, 2.0])

_N = np.array(AXIS) / np.linalg.norm(AXIS)
_ACROSS = [*np.linalg.svd(_N[None])[2][1:]]
JOINTS: dict[str, tuple[dict[str, Any] | None, list[Any], list[Any]]] = {
    "planar": ({"kind": "planar", "axis": AXIS}, [_N], _ACROSS),
    "point in a plane": ({"kind": "planar", "axis": AXIS, "rotation": "free"}, [_N], []),
    "cylindrical": ({"kind": "cylindrical", "axis": AXIS}, _ACROSS, _ACROSS),
    "slider": ({"kind": "slider", "axis": AXIS, "rotation": "free"}, _ACROSS, []),
    "spherical": ({"kind": "spherical"}, [*np.eye(3)], []),
    "revolute": ({"kind": "revolute", "axis": AXIS}, [*np.eye(3)], _ACROSS),
    "free": (None, [], []),
}
"""The joint of a plate with the ground, directions in which it holds the pin, and those about which nothing turns."""


def plates(kind: str, inertia: Any, count: int = 1, **solver: Any) -> Scene:
    """Plates of 2 kg on a joint and a spring, which have nothing to do with each other."""
    joint, _, held = JOINTS[kind]
    spin = np.zeros(3) if held else SPIN
    arm = BEGIN.apply(PIN)
    bodies, joints, loads, initial, markers = {}, {}, {}, {}, {}
    for k in range(count):
        body = {"body": f"B{k}"}
        bodies[f"B{k}"] = {"kind": "rigid-body", "mass": 2.0, "inertia": np.asarray(inertia).tolist(),
                           "named_points": {"pin": PIN.tolist(), "x": [1, 0, 0], "y": [0, 1, 0]}}  # fmt: skip
        if joint:
            ground = {"body": "ground", "point": (k * APART).tolist()}
            joints[f"J{k}"] = {**joint, "first": ground, "second": {**body, "point": "pin"}}
        loads[f"S{k}"] = {"kind": "spring", "stiffness": 200.0, "length": 0.3,
                          "first": {"body": "ground", "point": (HUNG + k * APART).tolist()},
                          "second": {**body, "point": HOOK.tolist()}}  # fmt: skip
        initial[f"B{k}"] = {"rotation": BEGIN.as_rotvec().tolist(), "spin": spin.tolist()}
        if kind in ("planar", "point in a plane", "free"):
            initial[f"B{k}"] |= {"position": (k * APART - arm).tolist(), "velocity": (-np.cross(spin, arm)).tolist()}
        markers |= {f"{name}{k}": {**body, "point": name} for name in ("pin", "x", "y")}
    return Scene.parse(
        {"name": kind, "dimensions": 3, "gravity": [0, -9.81, 0], "bodies": bodies, "joints": joints, "loads": loads,
         "initial": initial, "markers": markers, "solver": {"integrator": "dop853", "max_steps": 2000, **solver}}
    )  # fmt: skip


def end(scene: Scene, time: float) -> tuple[Any, int]:
    """Where the markers end, (markers, 3), and after how many steps."""
    found = simulate(scene, np.array([0.0, time]))
    assert found.ok, found.message
    return np.array([found.marker(name)[-1] for name in scene.markers]), found.steps


def moved(kind: str, inertia: Any, time: float) -> Any:
    """The same of one plate, by Newton's and Euler's equations with the reactions of the joint."""
    own = np.asarray(inertia) if np.ndim(inertia) == 2 else np.diag(inertia)
    _, places, turns = JOINTS[kind]

    def rate(_: float, state: Any) -> Any:
        x, turn, v, spin = state[:3], state[3:12].reshape(3, 3), state[12:15], state[15:]
        pin, hook, about = turn @ PIN, turn @ HOOK, turn @ own @ turn.T
        way = x + hook - HUNG
        pull = -200.0 * (1 - 0.3 / np.linalg.norm(way)) * way
        weight = np.array([0, -9.81 * 2.0, 0])
        count = len(places) + len(turns)
        matrix, load = np.zeros((6 + count, 6 + count)), np.zeros(6 + count)
        matrix[:3, :3], matrix[3:6, 3:6] = 2.0 * np.eye(3), about
        load[:6] = [*(pull + weight), *(np.cross(hook, pull) - np.cross(spin, about @ spin))]
        for k, direction in enumerate(places):
            matrix[6 + k, :6] = matrix[:6, 6 + k] = [*direction, *np.cross(pin, direction)]
            load[6 + k] = -direction @ np.cross(spin, np.cross(spin, pin))
        for k, direction in enumerate(turns, len(places)):
            matrix[6 + k, 3:6] = matrix[3:6, 6 + k] = direction
        return [*v, *np.cross(spin, turn.T).T.ravel(), *np.linalg.solve(matrix, load)[:6]]

    spin = np.zeros(3) if turns else SPIN
    arm = BEGIN.apply(PIN)
    begin = [*-arm, *BEGIN.as_matrix().ravel(), *-np.cross(spin, arm), *spin]
    state = solve_ivp(rate, (0, time), begin, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    x, turn = state[:3], state[3:12].reshape(3, 3)
    return np.array([x + turn @ PIN, x + turn[:, 0], x + turn[:, 1]])


@pytest.mark.parametrize("kind", list(JOINTS))
@pytest.mark.by_day(2)
def test_a_plate_moves_as_newton_and_euler_say_in_as_few_steps_as_a_thick_one(kind: str) -> None:
    places, steps = end(plates(kind, FLAT), 0.2)
    assert places == pytest.approx(moved(kind, FLAT, 0.2), abs=1e-9)
    assert steps < 1.5 * end(plates(kind, THICK), 0.2)[1]


@pytest.mark.parametrize("kind", ["slider", "free"])
def test_a_plate_may_lie_askew_in_its_own_frame(kind: str) -> None:
    places, steps = end(plates(kind, OBLIQUE), 0.2)
    assert places == pytest.approx(moved(kind, OBLIQUE, 0.2), abs=1e-9)
    assert steps < 100


@pytest.mark.parametrize("kind", ["slider", "point in a plane"])
def test_many_plates_move_as_one(kind: str) -> None:
    """So many have the sparse saddle point problem at every position."""
    places, steps = end(plates(kind, FLAT, 4), 0.1)
    one, few = end(plates(kind, FLAT), 0.1)
    shifts = np.repeat(np.arange(4)[:, None] * APART, 3, axis=0)
    assert places == pytest.approx(np.tile(one, (4, 1)) + shifts, abs=1e-11)
    assert steps < 1.5 * few


@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.slow
def test_plates_side_by_side_move_as_alone(count: int) -> None:
    largest = 0.04 * (1 - np.tile([0.0, 1e-7, 1e-3, 0.1], 4))
    scene = plates("slider", FLAT, count)
    found = simulate(scene, np.array([0.0, 0.1]), {f"bodies.B{k}.inertia.0": largest for k in range(count)})
    assert found.ok, found.message
    for lane in range(4):
        alone, _ = end(plates("slider", [largest[lane], *FLAT[1:]], count), 0.1)
        assert [found.marker(name, lane)[-1] for name in scene.markers] == pytest.approx(alone, abs=1e-12)


@pytest.mark.parametrize("method", ["kkt", "augmented-lagrangian", "proximal", "baumgarte"])
def test_other_ways_to_the_acceleration_find_the_same(method: str) -> None:
    places, _ = end(plates("slider", FLAT, acceleration=method), 0.1)
    assert places == pytest.approx(moved("slider", FLAT, 0.1), abs=1e-9)


@pytest.mark.parametrize("kind", ["slider", "point in a plane", "free"])
@pytest.mark.parametrize("integrator", ["leapfrog", "rk4"])
@pytest.mark.by_day(2)
def test_no_joint_shortens_the_stable_step_of_a_plate(kind: str, integrator: str) -> None:
    """Springs make it as long as for a body with some thickness."""
    limit = stable_step(plates(kind, FLAT), integrator)
    assert limit == pytest.approx(stable_step(plates(kind, [0.04 * (1 - 1e-3), 0.01, 0.03]), integrator), rel=0.5)
    places, _ = end(plates(kind, FLAT, integrator=integrator, step=5e-4), 0.2)
    assert places == pytest.approx(moved(kind, FLAT, 0.2), abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["slider", "point in a plane", "free"])
@pytest.mark.parametrize("integrator", ["generalized-alpha", "energy-momentum", "radau5"])
@pytest.mark.parametrize("thickness", [0.0, 1e-3, 1e-2])
def test_implicit_steps_of_thin_plates(kind: str, integrator: str, thickness: float) -> None:
    inertia = [0.04 * (1 - thickness**2), 0.01, 0.03]
    places, steps = end(plates(kind, inertia, integrator=integrator, step=5e-4, relative_tolerance=1e-9), 0.2)
    assert places == pytest.approx(moved(kind, inertia, 0.2), abs=1e-3)
    assert steps <= 400


def test_a_flat_platform_passes_its_singular_position() -> None:
    """It never turns, so that its inertia is of no consequence."""
    machine, reference = MACHINES["platform"]
    scene = machine(0.6)
    scene["bodies"]["plate"]["inertia"] = [0.12, 0.28, 0.4]
    times = np.linspace(0.05, 1.0, 20)
    run = simulate(Scene.parse({**scene, "solver": {"max_steps": 2000}}), times)
    assert run.ok, run.message
    assert TURN.inv().apply(run.marker("A")) == pytest.approx(reference(0.6)(times), abs=1e-8)


@pytest.mark.parametrize("inertia", [FLAT, OBLIQUE.tolist(), [0.0, 0.03, 0.03]])
def test_every_direction_of_a_flat_body_has_a_little_inertia(inertia: Any) -> None:
    body = RigidBody(mass=1.0, inertia=inertia)
    moments = np.array(second_moments(body), dtype=float)
    assert np.min(np.linalg.eigvalsh(moments)) > 0.5e-11 * np.trace(moments)
    assert np.trace(moments) * np.eye(3) - moments == pytest.approx(body.inertia_matrix, abs=1e-12)
