"""Motors and servos, against matrix exponentials of their equations, scipy and MuJoCo."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from controlled import FINE, ground, on_rail, pendulum, rod
from shoal.errors import InputError
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.linear_model import linearize
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

R, L, K, N, ROTOR, DISC, FRICTION = 0.8, 2e-3, 0.06, 20.0, 4e-5, 0.03, 0.05
J = DISC + N**2 * ROTOR
MOTOR = {
    "kind": "dc-motor", "joint": "hinge", "voltage": "u", "resistance": R, "inductance": L, "constant": K, "gear": N,
    "rotor": ROTOR,
}  # fmt: skip


def disc(**parts: Any) -> dict[str, Any]:
    """A disc on a hinge with viscous friction, and what drives it."""
    return {
        "name": "disc",
        "gravity": [0, 0],
        "bodies": {"disc": {"kind": "rigid-body", "mass": 1.0, "inertia": DISC}},
        "joints": {"hinge": {"first": ground(0, 0), "second": {"body": "disc"}, "friction": FRICTION}},
        "markers": {"disc": {"body": "disc"}},
        "solver": {**FINE, "integrator": "dop853"},
        **parts,
    }


def test_a_motor_under_a_voltage() -> None:
    """J w' = N k i - b w, L i' = u - R i - k N w."""
    a = np.array([[0, 1, 0], [0, -FRICTION / J, N * K / J], [0, -K * N / L, -R / L]])
    times, u = [0.01, 0.1, 0.5], 12.0
    found = simulate(Scene.parse(disc(signals={"u": u}, actuators={"drive": MOTOR})), np.array(times))
    for k, t in enumerate(times):
        whole = np.zeros((4, 4))
        whole[:3, :3], whole[2, 3] = a * t, u / L * t
        angle, _, current = scipy.linalg.expm(whole)[:3, 3]
        assert found.angles[k, 0, 0] == pytest.approx(angle, abs=1e-9)
        assert found.model["signals"]["drive_current"][k] == pytest.approx(current, abs=1e-9)
        assert found.model["signals"]["drive"][k] == pytest.approx(N * K * current, abs=1e-9)
    assert found.energy_drift[0] < 1e-8


def test_a_motor_whose_current_is_controlled() -> None:
    """u = kp (i_ref - i) + ki times its integral: a linear law of four states."""
    kp, ki, wanted = 1.5, 400.0, 3.0
    a = np.zeros((5, 5))
    a[0, 1], a[1, 1], a[1, 2] = 1.0, -FRICTION / J, N * K / J
    a[2, :] = np.array([0, -K * N, -R - kp, 1.0, kp * wanted]) / L
    a[3, 2], a[3, 4] = -ki, ki * wanted
    pid = {"kind": "pid", "of": "3 - drive_current", "kp": kp, "ki": ki}
    times = [0.002, 0.02, 0.3]
    for integrator in ("dop853", "radau5"):
        data = disc(controllers={"u": pid}, actuators={"drive": MOTOR})
        data["solver"] = {**FINE, "integrator": integrator, "step": 1e-4}
        found = simulate(Scene.parse(data), np.array(times))
        exact = [scipy.linalg.expm(a * t)[:, 4] for t in times]
        assert found.angles[:, 0, 0] == pytest.approx([x[0] for x in exact], abs=1e-9)
        assert found.model["signals"]["drive_current"] == pytest.approx([x[2] for x in exact], abs=1e-8)


def test_a_motor_without_inductance_has_the_linear_model_of_its_equations() -> None:
    scene = Scene.parse(disc(signals={"u": 0.0}, actuators={"drive": {**MOTOR, "inductance": 0.0}}))
    found = linearize(scene, ["u"], about="start")
    assert found.a == pytest.approx(np.array([[0.0, 1.0], [0.0, -40.21739130434782]]), abs=1e-9)
    assert found.b == pytest.approx(np.array([[0.0], [32.60869565217391]]), abs=1e-9)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_servo_in_the_joint_between_two_bodies(dimensions: int) -> None:
    """The torque acts on one body and reacts on the other, as a torsion spring with a damper does."""
    data: dict[str, Any] = {
        "name": "two-rods",
        "dimensions": dimensions,
        "gravity": [0, -9.81],
        "bodies": {"upper": rod(0.5, 2.0), "fore": rod(0.4, 1.5)},
        "joints": {
            "shoulder": {"first": ground(0, 0), "second": {"body": "upper"}},
            "elbow": {"first": {"body": "upper", "point": "end"}, "second": {"body": "fore"}},
        },
        "markers": {"hand": {"body": "fore", "point": "end"}},
        "solver": FINE,
    }
    servo = {"kind": "servo", "joint": "elbow", "position": "0.4", "kp": 20, "kd": 0.8}
    spring = {
        "kind": "torsion-spring", "first": {"body": "upper"}, "second": {"body": "fore"}, "stiffness": 20,
        "damping": 0.8, "angle": 0.4,
    }  # fmt: skip
    times = np.array([0.2, 1.0])
    one = simulate(Scene.parse({**data, "actuators": {"hold": servo}}), times)
    other = simulate(Scene.parse({**data, "loads": {"hold": spring}}), times)
    assert one.points == pytest.approx(other.points, abs=1e-8)


def stage(**parts: Any) -> dict[str, Any]:
    """A slide across a slide that turns: a point on a line that is fixed to a rotating arm."""
    return {
        "name": "stage",
        "gravity": [0, 0],
        "bodies": {"arm": rod(1.0, 2.0), "bead": {"kind": "point-mass", "mass": 0.5}},
        "joints": {
            "hinge": {"first": ground(0, 0), "second": {"body": "arm"}},
            "rail": {"kind": "slider", "first": {"body": "arm"}, "second": {"body": "bead"}},
        },
        "markers": {"bead": {"body": "bead"}},
        "initial": {"arm": {"rate": 2.0}, "bead": {"position": [0.3, 0.0]}},
        "solver": FINE,
        **parts,
    }


def test_a_servo_of_a_slide_on_a_body_that_moves() -> None:
    """Rotor: 4 kg of it for the motion along the arm. Lagrange's equations of angle and place by scipy."""
    arm, m, rotor = 2.0 / 3 + 0.01, 0.5, 400.0 * 0.01

    def rates(_: float, y: np.ndarray) -> list[float]:
        _, r, w, v = y
        force = 50 * (0.5 - r) - 3 * v
        return [w, v, -2 * m * r * v * w / (arm + m * r * r), (force + m * r * w * w) / (m + rotor)]

    servo = {"kind": "servo", "joint": "rail", "position": "0.5", "kp": 50, "kd": 3, "gear": 20, "rotor": 0.01}
    data = stage(actuators={"hold": servo})
    data["bodies"]["bead"] = {"kind": "rigid-body", "mass": 0.5, "inertia": 0.01}
    data["joints"]["rail"]["rotation"] = "locked"
    found = simulate(Scene.parse(data), np.array([0.5, 1.0]))
    exact = scipy.integrate.solve_ivp(rates, (0, 1), [0, 0.3, 2, 0], "DOP853", [0.5, 1.0], rtol=1e-12, atol=1e-13).y
    assert found.points[:, 0, 0, 0] == pytest.approx(exact[1] * np.cos(exact[0]), abs=1e-8)
    assert found.energy_drift[0] < 1e-8


def test_a_thrust_by_time_or_by_signals_is_the_same() -> None:
    times = np.array([0.5, 1.0])
    forces = ("2*sin(t)", "2*sin(t) + 0*slide(rail)*rate(hinge)")
    one, other = (
        simulate(Scene.parse(stage(loads={"push": {"kind": "thrust", "joint": "rail", "force": f}})), times)
        for f in forces
    )
    assert one.points == pytest.approx(other.points, abs=1e-9)
    data = on_rail(2.0, 0.0, "1")
    data["loads"] = {"push": {"kind": "thrust", "joint": "rail", "force": "3"}}
    found = simulate(Scene.parse(data), np.array([1.0]))
    assert found.points[0, 0, 0, 0] == pytest.approx(0.75, abs=1e-10)


def test_a_torque_falls_along_a_line_of_speed() -> None:
    """J w' = T (1 - w/w0) from rest, below a limit that ends at a speed: both in closed form."""
    motor = {"kind": "motor", "joint": "hinge", "torque": "100", "limit": 0.4, "stall": 0.6, "speed": 30}
    data = disc(actuators={"drive": motor})
    data["joints"]["hinge"]["friction"] = 0.0
    times = np.array([0.3, 1.0, 3.0])
    found = simulate(Scene.parse(data), times)
    w1 = 30 * (1 - 0.4 / 0.6)
    t1 = w1 * DISC / 0.4
    rate = np.where(times < t1, 0.4 / DISC * times, 30 - (30 - w1) * np.exp(-0.6 / 30 / DISC * (times - t1)))
    assert found.rates is not None
    assert found.rates[:, 0, 0] == pytest.approx(rate, abs=1e-8)


def test_a_velocity_servo_and_a_sampled_position_servo() -> None:
    servo = {"kind": "servo", "joint": "hinge", "velocity": "2", "kd": 0.5}
    data = disc(actuators={"drive": servo})
    found = simulate(Scene.parse(data), np.array([0.1]))
    pole = (0.5 + FRICTION) / DISC
    assert found.rates is not None
    assert found.rates[0, 0, 0] == pytest.approx(1.0 / 0.55 * (1 - math.exp(-pole * 0.1)), abs=1e-9)
    assert Scene.parse(Scene.parse(data).model_dump(mode="json")) == Scene.parse(data)
    assert Scene.parse(data).with_values({"signals.drive_kd": 0.7}).signals["drive_kd"].number == 0.7


def test_mujoco_has_the_same_servo() -> None:
    """Its position actuator and its armature; steps of fourth order that are halved agree to their difference."""
    mujoco = pytest.importorskip("mujoco")
    servo = {"kind": "servo", "joint": "hinge", "position": "0.7", "kp": 30, "kd": 2, "gear": 10, "rotor": 1e-3}
    data = {**pendulum(), "loads": {}, "signals": {}, "actuators": {"hold": servo}, "initial": {"arm": {"angle": 0.2}}}
    found = simulate(Scene.parse(data), np.array([0.5]))
    inertia = 2.0 * 0.8**2 / 12
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="1e-4" integrator="RK4" gravity="0 -9.81 0"/><worldbody><body>
        <joint name="hinge" axis="0 0 1" armature="0.1"/>
        <inertial pos="0.4 0 0" mass="2" diaginertia="1e-3 {inertia:.17g} {inertia:.17g}"/></body></worldbody>
        <actuator><position joint="hinge" kp="30" kv="2"/></actuator></mujoco>"""
    )
    state = mujoco.MjData(model)
    state.qpos[0], state.ctrl[0] = 0.2, 0.7
    mujoco.mj_step(model, state, 5000)
    assert found.angles[0, 0, 0] == pytest.approx(state.qpos[0], abs=1e-8)


@pytest.mark.parametrize(
    ("actuator", "why"),
    [
        ({"kind": "servo", "joint": "hinge", "kp": 3}, "actuators.a.kp: is of an error of `position`"),
        ({"kind": "servo", "joint": "hinge"}, "actuators.a.position: missing"),
        ({"kind": "servo", "joint": "knee", "velocity": "1", "kd": 1}, "actuators.a.joint: no joint 'knee'; there are"),
        ({"kind": "motor", "joint": "hinge"}, "actuators.a.torque: Field required"),
        ({"kind": "motor", "joint": "hinge", "torque": "1", "speed": 3}, "actuators.a.speed: is the end of a line"),
        ({"kind": "motor", "joint": "hinge", "torque": "w"}, "signals.a_torque: 'w' has 'w', which is not known"),
        ({"kind": "dc-motor", "joint": "hinge", "voltage": "1", "constant": 1}, "actuators.a.resistance"),
        ({"kind": "engine"}, "actuators.a: no kind is called engine; there are 'motor', 'dc-motor', 'servo'"),
    ],
)
def test_actuators_are_refused_in_one_line(actuator: dict[str, Any], why: str) -> None:
    with pytest.raises(InputError) as caught:
        Scene.parse(disc(actuators={"a": actuator}))
    assert why in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_actuators_cannot_hold_to_is_refused() -> None:
    motor = {"kind": "motor", "joint": "rail", "torque": "1"}
    data = stage(actuators={"a": motor})
    data["joints"]["rail"] = {"kind": "weld", "first": {"body": "arm"}, "second": {"body": "bead"}}
    with pytest.raises(InputError, match=r"actuators.a.joint: rail is weld; actuators are of revolute and slider"):
        Scene.parse(data)
    with pytest.raises(InputError, match=r"loads.push.joint: 'hinge' is not a slider of this scene; there are rail"):
        Scene.parse(stage(loads={"push": {"kind": "thrust", "joint": "hinge", "force": "3"}}))


def test_a_thrust_is_known_to_reactions_and_equilibria() -> None:
    """A table on a guide of 30 degrees that a servo holds, by its weight along it."""
    guide = {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "table"}}
    data = {
        "name": "table", "bodies": {"table": {"kind": "rigid-body", "mass": 8.0, "inertia": 0.1}},
        "joints": {"guide": guide | {"direction": np.pi / 6, "rotation": "locked"}},
        "actuators": {"lift": {"kind": "servo", "joint": "guide", "position": 0.2, "kp": 3000, "kd": 150}},
        "markers": {"table": {"body": "table"}}, "initial": {"table": {"position": [0.0, 0.0]}},
    }  # fmt: skip
    rest = statics(Scene.parse(data))
    away = 0.2 - 8.0 * 9.81 * 0.5 / 3000
    assert rest.ok, rest.message
    np.testing.assert_allclose(rest.marker("table"), [away * np.sqrt(0.75), away * 0.5], atol=1e-9)
    (held,) = reactions(Scene.parse(data), [3.0])
    across = 8.0 * 9.81 * np.sqrt(0.75)
    assert np.linalg.norm(held.joints["guide"].force) == pytest.approx(across, rel=1e-6)
