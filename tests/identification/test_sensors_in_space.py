"""What sensors on machines in space show, against closed forms, the plane and Exudyn."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shoal.engines import get_engine
from shoal.engines.exudyn.build import library, silence
from shoal.engines.exudyn.engine import ExudynEngine
from shoal.engines.exudyn.record import choose_steps
from shoal.engines.exudyn.space.bodies import SolidPart
from shoal.identification.recording.observation import STRAIGHT, Camera, observe
from shoal.identification.recording.source import Channel
from shoal.identification.recording.virtual_sensors import engine_options, from_start, with_sensor_markers
from shoal.mechanics.analysis.reactions import reactions
from shoal.scene import Scene
from shoal.trajectory import Array

GRAVITY = 9.81
AXES = ("ax", "ay", "az", "wx", "wy", "wz")
LOADS = ("fx", "fy", "fz", "mx", "my", "mz")
GROUND = {"body": "ground", "point": [0.0, 0.0, 0.0]}
PLACE = (0.3, 0.05, 0.02)
TIMES = np.arange(1, 11) / 20


def seen(scene: Scene, channels: tuple[Channel, ...], times: Array = TIMES, view: Camera = STRAIGHT) -> Array:
    """What channels show, (samples, channels)."""
    engine, wanted = get_engine("gauss"), from_start(times, channels)
    motion = engine.simulate(with_sensor_markers(scene, channels), wanted, **engine_options(engine, scene, channels))
    assert motion.ok, motion.message
    return np.asarray(observe(motion, channels, view, scene)[0, len(wanted) - len(times) :])


def arm(**changes: Any) -> Scene:
    """An arm that swings on a post that turns, with friction in both joints."""
    data = {
        "name": "arm",
        "dimensions": 3,
        "gravity": [0.0, 0.0, -GRAVITY],
        "bodies": {
            "post": {"kind": "rigid-body", "mass": 2.0, "inertia": [0.02, 0.03, 0.01],
                     "centre_of_mass": [0.1, 0.05, 0.2], "named_points": {"hip": [0.3, 0.0, 0.4]}},
            "arm": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.01, 0.05, 0.04],
                    "centre_of_mass": [0.2, 0.02, -0.01]},
        },
        "joints": {
            "O": {"kind": "revolute", "first": GROUND, "second": {"body": "post"}, "friction": 0.05},
            "E": {"kind": "revolute", "first": {"body": "post", "point": "hip"}, "second": {"body": "arm"},
                  "axis": [0.0, 1.0, 0.0], "friction": 0.02},
        },
        "markers": {"imu": {"body": "arm", "point": [*PLACE]}},
        "initial": {"post": {"rate": 2.0}, "arm": {"position": [0.3, 0.0, 0.4]}},
        "solver": {"duration": 0.5, "integrator": "dop853"},
    }  # fmt: skip
    return Scene.parse({**data, **changes}, "arm")


def test_an_imu_on_an_arm_shows_what_exudyn_moves() -> None:
    """Exudyn's velocities are differentiated: its own output of accelerations is not their derivative."""
    scene = arm(solver={"duration": 0.5, "integrator": "generalized-alpha", "step": 2e-4})
    exu, engine = library(), ExudynEngine(integrator="generalized-alpha")
    built = engine.machine(exu, scene, 0.5)
    part, outputs = built.parts["arm"], exu.OutputVariableType
    assert isinstance(part, SolidPart)
    kinds, rows = (outputs.Velocity, outputs.AngularVelocityLocal, outputs.RotationMatrix), list[Array]()

    def take(mbs: Any, time: float) -> bool:
        shown = (np.ravel(mbs.GetObjectOutputBody(part.body, kind, [*PLACE])) for kind in kinds)
        rows.append(np.concatenate([[time], *shown]))
        return True

    built.mbs.SetPostStepUserFunction(take)
    settings = engine.simulation_settings(exu, built, choose_steps(TIMES, scene.solver.step, built.unknowns))
    with silence(exu):
        assert built.mbs.SolveDynamic(settings, showHints=False)
    table = np.array(rows)
    at = np.searchsorted(table[:, 0], TIMES[:-1] - 1e-9)
    change = (table[at + 1, 1:4] - table[at - 1, 1:4]) / (table[at + 1, 0] - table[at - 1, 0])[:, None]
    body, tilt = table[at, 7:].reshape(-1, 3, 3), (0.3, -0.2, 0.5)
    sensor = Rotation.from_rotvec(tilt).as_matrix()
    felt = np.einsum("nij,ni->nj", body @ sensor, change + np.array([0.0, 0.0, GRAVITY]))
    channels = tuple(Channel(marker="imu", quantity=axis, tilt=tilt) for axis in AXES)
    found = seen(arm(), channels)[:-1]
    np.testing.assert_allclose(found[:, :3], felt, atol=2e-5)
    np.testing.assert_allclose(found[:, 3:], table[at, 4:7] @ sensor, atol=1e-5)


def test_mounting_turns_an_imu_about_its_own_axis_and_biases_are_added() -> None:
    channels = tuple(Channel(marker="imu", quantity=axis, tilt=(0.3, -0.2, 0.5)) for axis in AXES)
    plain = seen(arm(), channels)
    found = seen(arm(), channels, view=Camera(mounting=0.2, bias_az=0.5, bias_wx=-0.1))
    turned = Rotation.from_rotvec([0.0, 0.0, -0.2]).as_matrix()
    wanted = np.concatenate(
        [plain[:, :3] @ turned.T + np.eye(3)[2] / 2, plain[:, 3:] @ turned.T - np.eye(3)[0] / 10], axis=1
    )
    np.testing.assert_allclose(found, wanted, atol=1e-12)


def test_load_cells_hold_an_arm_as_its_momentum_says() -> None:
    """All that acts on post and arm from outside: gravity and the lower joint, whose axis only rubs."""
    cells = tuple(Channel(joint="O", quantity=axis) for axis in LOADS)
    found = seen(arm(), cells)
    step, scene = 1e-3, arm(markers={"p": {"body": "post", "point": [0.1, 0.05, 0.2]},
                                    "a": {"body": "arm", "point": [0.2, 0.02, -0.01]}})  # fmt: skip
    around = (TIMES[:, None] + step * np.array([-2, -1, 0, 1, 2])).ravel()
    motion = get_engine("gauss").simulate(scene, around)
    assert motion.velocities is not None
    momentum = np.einsum("nmd,m->nd", motion.velocities[..., 0], [2.0, 1.0]).reshape(-1, 5, 3)
    change = (momentum[:, 0] - 8 * momentum[:, 1] + 8 * momentum[:, 3] - momentum[:, 4]) / (12 * step)
    np.testing.assert_allclose(found[:, :3], change + np.array([0.0, 0.0, 3.0 * GRAVITY]), atol=1e-6)
    turning = seen(arm(markers={"imu": {"body": "post"}}), (Channel(marker="imu", quantity="wz"),))
    np.testing.assert_allclose(found[:, 5], -0.05 * turning[:, 0], atol=1e-10)


def test_an_unbalanced_shaft_pulls_at_its_drive_as_euler_says() -> None:
    """w = 7 t: F = m (w' x r + w x (w x r)) and M = I w' + w x I w + r x F in the bearing; the drive has M along z."""
    inertia = np.array([[0.3, 0.05, -0.04], [0.05, 0.4, 0.03], [-0.04, 0.03, 0.5]])
    centre = np.array([0.1, -0.2, 0.3])
    shaft = {"kind": "rigid-body", "mass": 2.0, "inertia": inertia.tolist(), "centre_of_mass": centre.tolist()}
    sides = {"first": GROUND, "second": {"body": "B"}}
    scene = arm(
        gravity=[0.0, 0.0, 0.0], bodies={"B": shaft}, initial={}, markers={"o": {"body": "B"}},
        joints={"J": {"kind": "revolute", **sides}, "D": {"kind": "driven-angle", **sides, "angle": "3.5*t**2"}},
    )  # fmt: skip
    cells = tuple(Channel(joint="J", quantity=axis) for axis in LOADS)
    found = seen(scene, (*cells, Channel(joint="D", quantity="torque"), Channel(joint="D", quantity="mz")))
    for t, row in zip(TIMES.tolist(), found, strict=True):
        turn = Rotation.from_rotvec([0.0, 0.0, 3.5 * t**2]).as_matrix()
        r, here = turn @ centre, turn @ inertia @ turn.T
        w, change = np.array([0.0, 0.0, 7.0 * t]), np.array([0.0, 0.0, 7.0])
        force = 2.0 * (np.cross(change, r) + np.cross(w, np.cross(w, r)))
        torque = here @ change + np.cross(w, here @ w) + np.cross(r, force)
        np.testing.assert_allclose(row, [*force, torque[0], torque[1], 0.0, torque[2], torque[2]], atol=1e-7)


HIP = {"first": {"body": "post", "point": "hip"}, "second": {"body": "arm"}}


@pytest.mark.parametrize(
    "joint",
    [
        {"kind": "weld"},
        {"kind": "spherical"},
        {"kind": "revolute", "axis": [0.0, 0.6, 0.8], "friction": 0.02, "drag": 0.01, "mu": 0.2, "radius": 0.05},
        {"kind": "universal", "axis": [0.0, 1.0, 0.0], "second_axis": [1.0, 0.0, 0.0]},
        {"kind": "cylindrical", "axis": [0.0, 0.6, 0.8]},
        {"kind": "planar", "axis": [1.0, 0.0, 0.0], "rotation": "locked"},
        {"kind": "slider", "axis": [0.0, 0.6, 0.8], "rotation": "locked", "coulomb": 0.3, "friction": 0.1},
        {"kind": "distance", "first": {"body": "post", "point": "start"}},
    ],
    ids=lambda joint: "-".join(str(joint[part]) for part in ("kind", "rotation") if part in joint),
)
@pytest.mark.by_day(2)
def test_load_cells_along_a_motion_show_the_reactions_at_its_instants(joint: dict[str, Any]) -> None:
    """The wrenches of all samples at once against work per displacement, one state after the other."""
    scene = arm(
        joints={"O": {"kind": "revolute", "first": GROUND, "second": {"body": "post"}, "friction": 0.05},
                "E": HIP | joint},
        initial={"post": {"rate": 2.0}, "arm": {"position": [0.3, 0.0, 0.4], "spin": [0.0, 0.0, 2.0]}},
        loads={"s": {"kind": "spring", "first": GROUND, "second": {"body": "arm"}, "stiffness": 40.0, "damping": 0.3}},
        solver={"duration": 0.5, "integrator": "dop853"},
    )  # fmt: skip
    if joint["kind"] in ("spherical", "universal", "distance"):
        start = {"position": [0.3, 0.0, 0.4]}
        scene = scene.with_values({"initial": {"post": {"rate": 2.0, "guess": ["rate"]}, "arm": start}})
    few = TIMES[:2]
    found = seen(scene, tuple(Channel(joint=name, quantity=axis) for name in "OE" for axis in LOADS), few)
    for row, told in zip(found, reactions(scene, few.tolist()), strict=True):
        wanted = [np.concatenate([told.joints[name].force, told.joints[name].torque]) for name in "OE"]
        np.testing.assert_allclose(row, np.concatenate(wanted), atol=1e-7 * max(1.0, np.max(np.abs(row))))


@pytest.mark.parametrize("lanes", [pytest.param(1, marks=pytest.mark.slow), 2])
@pytest.mark.parametrize("law", ["friction", "drag", "coulomb"])
def test_the_motor_of_a_hinge_works_against_the_resistance_of_its_lane(law: str, lanes: int) -> None:
    """M = I a + k w, k w |w| or k tanh(w/0.01) about an axis that is none of the ground's; the hinge has the rest."""
    sides = {"first": GROUND, "second": {"body": "B"}, "axis": [1 / 3, 2 / 3, 2 / 3]}
    scene = arm(
        gravity=[0.0, 0.0, 0.0], bodies={"B": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.03}}, initial={},
        markers={"o": {"body": "B"}},
        joints={"J": {"kind": "revolute", **sides, law: 0.01}, "D": {"kind": "driven-angle", **sides, "angle": "2*t"}},
    )  # fmt: skip
    channels = (Channel(joint="D", quantity="torque"), Channel(joint="J", quantity="mx"))
    engine, wanted, sizes = get_engine("gauss"), from_start(TIMES, channels), np.array([0.05, 0.2])[:lanes]
    values = {f"joints.J.{law}": sizes}
    motion = engine.simulate_many(
        with_sensor_markers(scene, channels), values, wanted, **engine_options(engine, scene, channels)
    )
    found = observe(motion, channels, STRAIGHT, scene, values)[:, len(wanted) - len(TIMES) :]
    against = sizes * {"friction": 2.0, "drag": 4.0, "coulomb": 1.0}[law]
    np.testing.assert_allclose(found[..., 0], np.broadcast_to(against[:, None], found.shape[:2]), atol=1e-9)
    np.testing.assert_allclose(found[..., 1], -found[..., 0] / 3, atol=1e-9)


@pytest.mark.parametrize("element", ["rigid", "director-rod"])
def test_what_stays_in_the_plane_shows_the_same_in_space(element: str) -> None:
    """A pendulum about z: of a rod that bends hardly, and of a rigid one."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.05, "width": 0.05, "density": 1000.0}
    bends = {"element": element, "youngs_modulus": 2e9, "elements": 4, "retardation": 1e-3}
    solver = {"duration": 0.5, "integrator": "dop853", "relative_tolerance": 1e-10, "absolute_tolerance": 1e-11}
    data = {
        "gravity": [0.0, -GRAVITY],
        "joints": {"O": {"kind": "revolute", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "rod"}}},
        "markers": {"imu": {"body": "rod", "point": "end"}, "gauge": {"body": "rod", "point": [0.4, 0.0]}},
        "initial": {"rod": {"angle": 0.4, "rate": 1.0}},
        "solver": solver if element == "rigid" else {"duration": 0.5, "integrator": "generalized-alpha", "step": 5e-4},
    }
    bodies = {"rod": {**rod, **({} if element == "rigid" else bends)}}
    in_plane = {"rod": {**rod, **({} if element == "rigid" else {**bends, "element": "ancf-cable"})}}
    channels = ("ax", "ay"), ("fx", "fy")
    common = [Channel(marker="imu", quantity=q) for q in channels[0]] + [
        Channel(joint="O", quantity=q) for q in channels[1]
    ]
    gauge = [Channel(marker="gauge", quantity="strain", height=0.02)] if element != "rigid" else []
    solid = seen(arm(**data, bodies=bodies), (*common, Channel(marker="imu", quantity="wz"), *gauge))
    flat = seen(arm(**data, bodies=in_plane, dimensions=2), (*common, Channel(marker="imu", quantity="rate"), *gauge))
    size = np.max(np.abs(flat), axis=0)
    np.testing.assert_allclose(solid / size, flat / size, atol=1e-7 if element == "rigid" else 0.02)


def cantilever(**changes: Any) -> Scene:
    """A director rod that is clamped at its start and pushed and pulled at its end, at rest."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.03, "density": 1000.0, "youngs_modulus": 2e9,
           "element": "director-rod", "elements": 8}  # fmt: skip
    data = {
        "name": "cantilever",
        "gravity": [0.0, 0.0, 0.0],
        "bodies": {"rod": rod},
        "joints": {"O": {"kind": "weld", "first": GROUND, "second": {"body": "rod"}}},
        "loads": {"tip": {"kind": "force", "at": {"body": "rod", "point": "end"}, "force": [20.0, 0.05, 0.08]}},
        "markers": {"gauge": {"body": "rod", "point": [0.3, 0.0]}, "tip": {"body": "rod", "point": "end"}},
        "initial": {"from": "statics"},
        "solver": {"duration": 0.01, "integrator": "generalized-alpha", "step": 1e-3},
    }
    return arm(**{**data, **changes})


def test_strain_gauges_show_bending_about_both_axes_and_stretch() -> None:
    """N / (E A) - M_z y / (E I_z) + M_y z / (E I_y), where the pull N makes the rod stiffer."""
    spots = [(0.0, 0.0), (0.01, 0.0), (0.0, 0.015), (-0.01, 0.015)]
    gauges = tuple(Channel(marker="gauge", quantity="strain", height=y, side=z) for y, z in spots)
    found = seen(cantilever(), gauges, np.array([0.0]))[0]
    wanted = []
    for y, z in spots:
        total = 20.0 / (2e9 * 0.02 * 0.03)
        for push, place, second in ((0.05, y, 0.03 * 0.02**3 / 12), (0.08, z, 0.02 * 0.03**3 / 12)):
            k = math.sqrt(20.0 / (2e9 * second))
            total -= place * push / (2e9 * second) * math.sinh(k * 0.7) / (k * math.cosh(k))
        wanted.append(total)
    np.testing.assert_allclose(found, wanted, rtol=0.01)


def test_an_imu_on_a_rod_that_turns_shows_the_rate_and_what_pulls_inwards() -> None:
    """A stiff rod welded to a shaft about x that turns evenly, with the sensor on it between two nodes."""
    sides = {"first": GROUND, "second": {"body": "rod"}, "axis": [0.0, 0.0, 1.0]}
    rod = {"kind": "rod", "length": 0.5, "height": 0.02, "width": 0.03, "density": 100.0, "youngs_modulus": 2e11,
           "element": "director-rod", "elements": 3}  # fmt: skip
    damped = {"duration": 0.3, "step": 1e-4, "integrator": "generalized-alpha", "spectral_radius": 0.5}
    scene = cantilever(
        bodies={"rod": rod}, loads={}, joints={"O": {"kind": "revolute", **sides}}, markers={"imu": {"body": "rod",
        "point": [0.3, 0.0]}}, initial={"rod": {"rate": 5.0}}, solver=damped,
    )  # fmt: skip
    channels = tuple(Channel(marker="imu", quantity=axis) for axis in AXES)
    found = seen(scene, channels, np.array([0.25, 0.3]))
    np.testing.assert_allclose(found, np.tile([-25.0 * 0.3, 0.0, 0.0, 0.0, 0.0, 5.0], (2, 1)), atol=1e-3)
