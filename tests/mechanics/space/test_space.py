"""Rigid machines in space, against closed forms, published figures, the plane and relative coordinates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Trajectory
from shoal_validation.spatial.machines import PUBLISHED, bricard

FINE = {"integrator": "dop853", "relative_tolerance": 1e-11, "absolute_tolerance": 1e-12}
GROUND = {"body": "ground", "point": [0.0, 0.0, 0.0]}


def scene(**parts: Any) -> Scene:
    """A scene in space of these parts, by an integrator of high order."""
    return Scene.parse({"name": "test", "dimensions": 3, "gravity": [0, 0, 0], "solver": FINE, **parts})


def motion(given: Scene, *times: float) -> Trajectory:
    """Its motion, which has to be good."""
    found = simulate(given, np.array(times))
    assert found.ok, found.message
    return found


def body(inertia: Any = (0.3, 0.5, 0.6), mass: float = 2.0, **more: Any) -> dict[str, Any]:
    """A rigid body with a tip on each axis."""
    tips = {"ex": [1, 0, 0], "ey": [0, 1, 0], "ez": [0, 0, 1]}
    return {"kind": "rigid-body", "mass": mass, "inertia": inertia, "named_points": tips, **more}


TIPS = {axis: {"body": "B", "point": f"e{axis}"} for axis in "xyz"}


def attitude(found: Trajectory, origin: str = "o") -> Any:
    """Axes of the body as columns, (samples, 3, 3)."""
    return np.stack([found.marker(axis) - found.marker(origin) for axis in "xyz"], axis=2)


def joint(kind: str, first: Any, second: Any, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "first": first, "second": second, **more}


# --- published figures and closed forms


def test_a_spherical_pendulum_ends_where_elliptic_functions_say() -> None:
    swinging = scene(
        gravity=[0, 0, -9.81],
        bodies={"P": {"kind": "point-mass", "mass": 1.0}},
        joints={"S": joint("distance", GROUND, {"body": "P"})},
        markers={"P": {"body": "P"}},
        initial={"P": {"position": [math.sin(math.pi / 3), 0, -0.5], "velocity": [0, 2 * math.sin(math.pi / 3), 0]}},
    )
    end = motion(swinging, 1.0).marker("P")[-1]
    assert end == pytest.approx([-0.738316659552752, -0.431492043650700, -0.518365823037175], abs=1e-10)


def test_bricards_mechanism_moves_as_published_and_its_redundancy_is_named() -> None:
    found = motion(bricard(), 0.0, 1.0)
    start, end = found.marker("P3")
    assert start == pytest.approx([1, -1, 1])
    assert end == pytest.approx(PUBLISHED, abs=1e-9)
    assert set(found.model["redundant_joints"]) == {f"R{k}" for k in range(1, 7)}


def test_a_bennett_linkage_closes_at_the_angle_of_its_closure() -> None:
    """Twists 30 and 60 degrees, lengths as their sines; first angle 1 rad, second 2.746877324015333 rad."""
    twists = np.radians([30.0, 60.0])
    lengths = np.sin(twists)
    first, second = 1.0, 2.746877324015333
    turn, shift, places, axes = np.eye(3), np.zeros(3), [np.zeros(3)], [np.array([0.0, 0.0, 1.0])]
    for length, twist, angle in zip([*lengths], [*twists], [first, second], strict=True):
        turn = turn @ Rotation.from_rotvec([0, 0, angle]).as_matrix()
        shift = shift + turn @ [length, 0, 0]
        turn = turn @ Rotation.from_rotvec([twist, 0, 0]).as_matrix()
        places.append(shift.copy())
        axes.append(turn[:, 2].copy())
    # The fourth hinge, on the ground, is a link of the second kind away from the first, along -x of its frame.
    last = Rotation.from_rotvec([-twists[1], 0, 0]).as_matrix()[:, 2]
    bodies = {name: body(0.1, 1.0) for name in "ABC"}
    origin = np.array([-lengths[1], 0, 0])
    hinges = [("ground", places[0], "A", axes[0]), ("A", places[1], "B", axes[1]), ("B", places[2], "C", axes[2]),
              ("C", origin, "ground", last)]  # fmt: skip
    joints = {
        f"R{k}": joint("revolute", {"body": one, "point": place.tolist()}, {"body": other, "point": place.tolist()},
                       axis=axis.tolist())
        for k, (one, place, other, axis) in enumerate(hinges)
    }  # fmt: skip
    linkage = scene(bodies=bodies, joints=joints, markers={"A": {"body": "A"}}, initial={"A": {"rate": 1.0}})
    found = motion(linkage, 1e-3)
    assert found.constraint_drift[0] < 1e-12
    assert found.model["redundant_joints"]


ROTATION, SPIN = Rotation.from_rotvec([0.3, -0.8, 0.5]), np.array([1.0, 4.0, -0.5])
FREE = {"rotation": ROTATION.as_rotvec().tolist(), "spin": SPIN.tolist(), "position": [0, 0, 0]}


def turned(inertia: Any, times: list[float]) -> Any:
    """Axes of a free body that begins so as columns, by Euler's equations with a quaternion, (times, 3, 3)."""

    def rate(_: float, state: Any) -> Any:
        quaternion, own = state[:4], state[4:]
        half = 0.5 * np.array([own[0], own[1], own[2]])
        v, w = quaternion[:3], quaternion[3]
        turning = [*(w * half + np.cross(v, half)), -v @ half]
        return [*turning, *np.linalg.solve(inertia, np.cross(inertia @ own, own))]

    begin = [*ROTATION.as_quat(), *ROTATION.inv().apply(SPIN)]
    exact = solve_ivp(rate, (0, times[-1]), begin, t_eval=times, method="DOP853", rtol=1e-12, atol=1e-13).y[:4].T
    return Rotation.from_quat(exact).as_matrix()


def test_a_body_in_free_flight_turns_as_eulers_equations_say() -> None:
    """Torque-free, three different moments, a rotated frame."""
    matrix = np.array([[0.5, 0.05, -0.02], [0.05, 0.4, 0.03], [-0.02, 0.03, 0.3]])
    flying = scene(
        bodies={"B": body(matrix.tolist())}, markers={**TIPS, "o": {"body": "B"}},
        initial={"B": {**FREE, "velocity": [0.1, 0.2, 0.3]}},
    )  # fmt: skip
    found = motion(flying, 0.5, 2.0)
    assert attitude(found) == pytest.approx(turned(matrix, [0.5, 2.0]), abs=2e-9)
    assert found.marker("o")[-1] == pytest.approx([0.2, 0.4, 0.6], abs=1e-10)


@pytest.mark.parametrize("ends", [(0.3, 0.3, 0.1), (0.1, 0.1, 0.3), (0.3, 0.1, 0.2)])
@pytest.mark.parametrize("rotary", [False, True])
def test_a_rigid_rod_has_the_inertia_of_its_length_and_of_its_sections(ends: Any, rotary: bool) -> None:
    """h^2 + w^2 about its own axis; L^2 about both others, with rotary inertia L^2 + w^2 about y and L^2 + h^2 about z.

    ends: height at both, and the width [m]. The integrals over the length are by Gauss's rule.
    """
    nodes, weights = np.polynomial.legendre.leggauss(8)
    (first, last, width), x = ends, (nodes + 1) / 2
    height = first + (last - first) * x
    part = 1000.0 * height * width * weights / 2
    along, tall, wide = (
        np.sum(part * (x - np.sum(part * x) / np.sum(part)) ** 2),
        part @ height**2,
        part.sum() * width**2,
    )
    moments = [(tall + wide) / 12, along + rotary * wide / 12, along + rotary * tall / 12]
    rod = {"kind": "rod", "length": 1.0, "height": first, "width": width, "density": 1000.0, "rotary_inertia": rotary}
    places = {"o": [0, 0, 0], "x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]}
    flying = scene(bodies={"B": rod | ({} if first == last else {"end_height": last})}, initial={"B": FREE},
                   markers={name: {"body": "B", "point": place} for name, place in places.items()})  # fmt: skip
    assert attitude(motion(flying, 0.5, 2.0)) == pytest.approx(turned(np.diag(moments), [0.5, 2.0]), abs=1e-8)


def test_a_torque_about_a_fixed_axis_spins_up_a_ball() -> None:
    axis = np.array([1.0, 2.0, -2.0]) / 3
    ball = scene(
        bodies={"B": body(0.5)}, markers={**TIPS, "o": {"body": "B"}}, initial={"B": {"position": [0, 0, 0]}},
        loads={"T": {"kind": "torque", "at": {"body": "B"}, "torque": 1.5, "axis": axis.tolist()}},
    )  # fmt: skip
    turned = Rotation.from_rotvec(axis * 0.5 * 3.0 * 1.2**2).as_matrix()
    assert attitude(motion(ball, 1.2))[-1] == pytest.approx(turned, abs=1e-9)


def test_a_force_that_turns_with_a_ball_at_its_centre_follows_its_axes() -> None:
    """Spinning about z with w and pushed along its own x: the velocity is F/(m w) (sin, 1 - cos)."""
    ball = scene(
        bodies={"B": body(0.5)}, markers={"o": {"body": "B"}},
        initial={"B": {"position": [0, 0, 0], "spin": [0, 0, 3.0]}},
        loads={"F": {"kind": "force", "at": {"body": "B"}, "force": [4.0, 0, 1.0], "follows": True}},
    )  # fmt: skip
    w, a, t = 3.0, 2.0, 0.9
    place = [a / w**2 * (1 - math.cos(w * t)), a / w * (t - math.sin(w * t) / w), 0.25 * t**2]
    assert motion(ball, t).marker("o")[-1] == pytest.approx(place, abs=1e-10)


# --- joints


SLOPE = np.array([0.6, 0.0, -0.8])


@pytest.mark.parametrize("kind", ["slider", "locked slider", "cylindrical", "planar", "free planar", "locked planar"])
def test_what_slides_on_an_incline_has_its_part_of_gravity(kind: str) -> None:
    held = {"slider": "free", "locked slider": "locked", "free planar": "free", "locked planar": "locked"}
    name = kind.split()[-1]
    axis = SLOPE if name != "planar" else np.array([0.8, 0.0, 0.6])
    more = {"rotation": held[kind]} if kind in held else {}
    sliding = scene(
        gravity=[0, 0, -9.81], bodies={"B": body()}, markers={"o": {"body": "B"}},
        joints={"S": joint(name, GROUND, {"body": "B"}, axis=axis.tolist(), **more)},
        initial={"B": {"position": [0, 0, 0]}},
    )  # fmt: skip
    found = motion(sliding, 0.7)
    assert found.marker("o")[-1] == pytest.approx(0.5 * 9.81 * 0.8 * 0.7**2 * SLOPE, abs=1e-9)
    assert not found.model["redundant_joints"]


@pytest.mark.parametrize("away", [0.0, 1.0])
@pytest.mark.parametrize("kind", ["cylindrical", "revolute"])
def test_a_universal_joint_passes_on_a_driven_shaft_as_cardan_says(kind: str, away: float) -> None:
    """tan(second) = tan(first) cos(bend), counted from where the first yoke is at a right angle to both shafts.

    The bearing of the second shaft, some way away, holds what the joint holds already.
    """
    bend, rate = 0.5, 2.0
    shaft = [math.cos(bend), math.sin(bend), 0.0]
    drive = scene(
        bodies={"A": body(), "B": body()},
        joints={
            "in": joint("revolute", GROUND, {"body": "A"}, axis=[1, 0, 0]),
            "cross": joint("universal", {"body": "A", "point": "ex"}, {"body": "B"}, axis=[0, 0, 1],
                           second_axis=[-shaft[1], shaft[0], 0]),
            "out": joint(kind, {"body": "ground", "point": [1 + away * shaft[0], away * shaft[1], 0.0]},
                         {"body": "B", "point": [away, 0, 0]}, axis=shaft),
        },
        initial={"A": {"spin": [rate, 0, 0]}, "B": {"rotation": [0, 0, bend]}},
        markers={"o": {"body": "A"}, "a": {"body": "A", "point": "ez"}, "p": {"body": "B"},
                 "z": {"body": "B", "point": "ez"}},
    )  # fmt: skip
    found = motion(drive, *np.linspace(0.1, 0.6, 6))
    at = found.marker("a") - found.marker("o")
    first = np.arctan2(-at[:, 1], at[:, 2])
    out = found.marker("z") - found.marker("p")
    across = np.array([-shaft[1], shaft[0], 0])
    second = np.arctan2(-out @ across, out[:, 2])
    assert np.tan(second) == pytest.approx(np.tan(first) * math.cos(bend), abs=1e-8)
    assert np.max(np.abs(second)) > 0.9


def test_axes_of_a_universal_joint_are_at_a_right_angle_in_every_lane() -> None:
    """Each of two numbers may be right beside what the scene states, and both together not."""
    cross = joint("universal", GROUND, {"body": "B"}, axis=[0, 0, 1], second_axis=[0, 1, 0])
    hinged = {"bodies": {"B": body(centre_of_mass=[0.3, 0, 0])}, "joints": {"U": cross}, "markers": TIPS}
    hung = scene(**hinged, gravity=[0, 0, -9.8])
    first, second = "joints.U.axis.0", "joints.U.second_axis.0"
    lanes = {first: np.array([0.3, 0.0]), second: np.array([0.0, 0.3])}
    found = get_engine("gauss").simulate_many(hung, lanes, [0.3])
    for lane in range(2):
        alone = motion(hung.with_values({path: column[lane] for path, column in lanes.items()}), 0.3)
        assert found.points[..., lane] == pytest.approx(alone.points[..., 0], abs=1e-9)
    with pytest.raises(InputError, match=r"joints\.U\.second_axis: must be at a right angle to axis in every lane"):
        get_engine("gauss").simulate_many(hung, {**lanes, first: np.array([0.3, 0.3])}, [0.3])


def test_a_driven_angle_turns_about_its_axis() -> None:
    axis = np.array([1.0, 1.0, 1.0]) / math.sqrt(3)
    driven = scene(
        bodies={"B": body()}, markers={**TIPS, "o": {"body": "B"}},
        joints={"R": joint("revolute", GROUND, {"body": "B"}, axis=axis.tolist()),
                "D": joint("driven-angle", GROUND, {"body": "B"}, angle="0.3*t**2", axis=axis.tolist())},
    )  # fmt: skip
    turned = Rotation.from_rotvec(axis * 0.3 * 1.5**2).as_matrix()
    assert attitude(motion(driven, 1.5))[-1] == pytest.approx(turned, abs=1e-8)


def test_a_torsion_spring_and_friction_act_about_the_axis_of_the_joint() -> None:
    """A damped oscillator about a tilted axis, through its centre of mass: a closed form."""
    axis, inertia, k, c, rate = np.array([2.0, -1.0, 2.0]) / 3, 0.4, 5.0, 0.3, 1.7
    turning = scene(
        gravity=[0, 0, -9.81], bodies={"B": body(inertia)}, markers={**TIPS, "o": {"body": "B"}},
        joints={"R": joint("revolute", GROUND, {"body": "B"}, axis=axis.tolist(), friction=c)},
        loads={"K": {"kind": "torsion-spring", "first": GROUND, "second": {"body": "B"}, "stiffness": k,
                     "axis": axis.tolist()}},
        initial={"B": {"spin": (rate * axis).tolist()}},
    )  # fmt: skip
    decay, t = c / (2 * inertia), 1.3
    w = math.sqrt(k / inertia - decay**2)
    angle = rate / w * math.exp(-decay * t) * math.sin(w * t)
    assert attitude(motion(turning, t))[-1] == pytest.approx(Rotation.from_rotvec(axis * angle).as_matrix(), abs=1e-8)


# --- the plane


PLANAR = ["andrews-squeezer", "equal-slider-crank", "n-four-bar-2", "parallelogram", "rigid-double-pendulum"]


def both(data: dict[str, Any], end: float) -> tuple[Trajectory, Trajectory]:
    """The motion of a scene of the plane, there and in space."""
    times = np.linspace(0.0, end, 5)
    data = {**data, "solver": {**data.get("solver", {}), **FINE}}
    there = simulate(Scene.parse({**data, "dimensions": 3}), times)
    return simulate(Scene.parse(data), times), there


def assert_same(plane: Trajectory, space: Trajectory, within: float) -> None:
    assert plane.ok
    assert space.ok, space.message
    assert np.max(np.abs(space.points[:, :, :2] - plane.points)) < within
    assert np.max(np.abs(space.points[:, :, 2])) < 1e-12
    assert np.max(np.abs(space.angles - plane.angles)) < within


@pytest.mark.parametrize("name", PLANAR)
def test_a_planar_scene_moves_in_space_as_in_the_plane(name: str) -> None:
    data = load_scene(name).model_dump(mode="json", exclude_unset=True)
    assert_same(*both(data, 0.02 if name == "andrews-squeezer" else 1.0), 1e-9)


def test_every_joint_and_load_of_the_plane_acts_in_space_as_there(many_joints: dict[str, Any]) -> None:
    assert_same(*both(many_joints, 0.5), 1e-8)


# --- relative coordinates: Featherstone's recursion


@pytest.mark.parametrize("seed", range(4))
def test_open_chains_move_as_relative_coordinates_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = ["revolute", "spherical", "revolute", "prismatic"]
    rng.shuffle(kinds)
    bodies, joints, before = {}, {}, "ground"
    for k, kind in enumerate(kinds):
        name, arm = f"B{k}", rng.normal(size=3) * 0.4
        axes = Rotation.random(random_state=int(rng.integers(1e6))).as_matrix()
        moments = axes @ np.diag([0.05, 0.06, 0.09]) @ axes.T
        centre, axis = rng.normal(size=3) * 0.2, rng.normal(size=3)
        bodies[name] = body(((moments + moments.T) / 2).tolist(), 1.0, centre_of_mass=centre.tolist())
        first = {"body": before, "point": ([0.0, 0.0, 0.0] if before == "ground" else arm.tolist())}
        if kind == "spherical":
            joints[f"J{k}"] = joint("spherical", first, {"body": name})
        elif kind == "revolute":
            joints[f"J{k}"] = joint("revolute", first, {"body": name}, axis=axis.tolist())
        else:
            joints[f"J{k}"] = joint("slider", first, {"body": name}, axis=axis.tolist(), rotation="locked")
        before = name
    tip = {"body": before, "point": [0.1, 0.2, 0.3]}
    machine = scene(gravity=[0, 0, -9.81], bodies=bodies, joints=joints, markers={"tip": tip})
    times = [0.3, 0.8]
    other = get_engine("tree").simulate(machine, times)
    assert motion(machine, *times).marker("tip") == pytest.approx(other.marker("tip"), abs=1e-8)


# --- what is refused


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dimensions": 2}, "dimensions: 3"),
        ({"bodies": {"B": body((0.1, 0.1, 0.3))}}, "bodies.B: inertia: no body has the principal moments"),
        ({"bodies": {"B": body([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]])}}, "not symmetric"),
        ({"initial": {"B": {"angle": 1.0, "rotation": [1.0, 0, 0]}}}, "initial.B.rotation: angle is stated as well"),
        ({"joints": {"J": joint("revolute", GROUND, {"body": "B"}, axis=[0, 0, 0])}}, "an axis needs a direction"),
    ],
)
def test_wrong_scenes_are_refused_by_the_field(change: dict[str, Any], message: str) -> None:
    parts = {"bodies": {"B": body()}, "joints": {"J": joint("spherical", GROUND, {"body": "B"})},
             "markers": {"o": {"body": "B"}}}  # fmt: skip
    with pytest.raises(InputError, match=message):
        scene(**{**parts, **change})


def test_a_start_that_no_joint_allows_is_refused() -> None:
    held = scene(
        bodies={"B": body()}, markers={"o": {"body": "B"}},
        joints={"J": joint("revolute", GROUND, {"body": "B"}, axis=[0, 0, 1])}, initial={"B": {"spin": [1.0, 0, 2.0]}},
    )  # fmt: skip
    with pytest.raises(InputError, match=r"initial\.B\.spin: contradicts the joints"):
        simulate(held, np.array([0.1]))
    apart = scene(
        bodies={"B": body()}, markers={"o": {"body": "B"}},
        joints={"J": joint("spherical", GROUND, {"body": "B"})}, initial={"B": {"position": [0.5, 0, 0]}},
    )  # fmt: skip
    with pytest.raises(InputError, match=r"initial\.B\.position: .* cannot be kept: joint J would stay 0\.5 m apart"):
        simulate(apart, np.array([0.1]))


def test_engines_of_the_plane_refuse_machines_in_space() -> None:
    with pytest.raises(InputError, match="cannot do machines in space"):
        get_engine("casadi").simulate(bricard())
