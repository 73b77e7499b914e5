"""Linear models against closed forms, differences of runs, MuJoCo's accelerations and eigenfrequencies."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
import scipy.linalg
import shoal
from shoal.errors import ComputationError, InputError
from shoal.mechanics.linear_model import linearize
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

pytestmark = pytest.mark.compiles("kernels of signals")
G, MASS, LENGTH, CART = 9.81, 0.2, 0.6, 1.0
PIN = {"first": {"body": "cart"}, "second": {"body": "rod"}}
RAIL = {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "cart"}}


def cart_pole(angle: float = np.pi / 2, scale: Any = "u", **signals: Any) -> Scene:
    """A cart with a rod on a pin, upright; the force on the cart follows a signal u."""
    rod = {"kind": "rod", "length": LENGTH, "height": 0.02, "width": 0.02, "density": MASS / LENGTH / 4e-4}
    push = {"kind": "force", "at": {"body": "cart"}, "force": [1.0, 0.0], "scale": scale}
    return Scene.parse({
        "name": "cart-pole", "bodies": {"cart": {"kind": "point-mass", "mass": CART}, "rod": rod},
        "joints": {"rail": RAIL | {"direction": 0.0}, "pin": PIN}, "signals": {"u": 0.0, **signals},
        "loads": {"push": push}, "markers": {"tip": {"body": "rod", "point": "end"}},
        "initial": {"rod": {"angle": angle}}, "solver": {"duration": 1.0},
    })  # fmt: skip


def test_a_cart_and_pole_has_the_matrices_of_the_textbook() -> None:
    found = linearize(cart_pole(), ["u"], ["slide(rail)", "position(tip, x)"], about="start")
    whole = 4.0 * CART + MASS
    fall, across = 6.0 * (CART + MASS) * G / (whole * LENGTH), 3.0 * MASS * G / whole
    assert found.states == ("slide(rail)", "angle(rod)", "slide_rate(rail)", "rate(rod)")
    np.testing.assert_allclose(found.a[:2], np.eye(4)[2:], atol=1e-12)
    np.testing.assert_allclose(found.a[2:], [[0, across, 0, 0], [0, fall, 0, 0]], atol=1e-10)
    np.testing.assert_allclose(found.b[:, 0], [0, 0, 4.0 / whole, 6.0 / (whole * LENGTH)], atol=1e-12)
    np.testing.assert_allclose(found.c, [[1, 0, 0, 0], [1, -LENGTH, 0, 0]], atol=1e-12)
    assert not np.any(found.d)
    np.testing.assert_allclose(found.at, [0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.poles, [0.0, 0.0, -np.sqrt(fall), np.sqrt(fall)], atol=1e-10)
    assert found.ok
    assert found.codes == ["unstable-pole"]


def test_zeros_and_response_are_those_of_the_transfer_function() -> None:
    found = linearize(cart_pole(), ["push"], ["position(tip, x)"], about="start")
    whole = 4.0 * CART + MASS
    fall, across = 6.0 * (CART + MASS) * G / (whole * LENGTH), 3.0 * MASS * G / whole
    # X = (4 + across 6/L/(s^2 - fall)) / whole / s^2, tip = X - L PHI
    s = 2j
    angle = 6.0 / (whole * LENGTH) / (s**2 - fall)
    slide = (4.0 / whole + across * angle) / s**2
    np.testing.assert_allclose(found.response(np.array([2.0]))[0, 0, 0], slide - LENGTH * angle, rtol=1e-12)
    assert found.zeros is not None
    np.testing.assert_allclose(
        np.sort(found.zeros.imag), [-np.sqrt(2 * G * 1.5 / LENGTH), np.sqrt(2 * G * 1.5 / LENGTH)], rtol=1e-9
    )


def test_feedback_is_part_of_the_model_and_a_reference_is_an_input() -> None:
    rod = {"kind": "rod", "length": 0.8, "height": 0.02, "width": 0.02, "density": 2.0 / (0.8 * 4e-4)}
    hinge = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "arm"}}
    scene = Scene.parse({
        "name": "pd", "bodies": {"arm": rod}, "joints": {"hinge": hinge}, "gravity": [0.0, 0.0],
        "signals": {"ref": "0.3*sin(2*t)", "off": "ref - angle(hinge)"},
        "loads": {"motor": {"kind": "torque", "at": {"body": "arm"}, "torque": "60*off - 6*rate(hinge)"}},
        "markers": {"tip": {"body": "arm", "point": "end"}},
    })  # fmt: skip
    found = linearize(scene, ["ref"], ["angle(hinge)", "off", "rate(hinge)"])
    inertia = 2.0 * 0.8**2 / 3.0
    np.testing.assert_allclose(found.a, [[0, 1], [-60 / inertia, -6 / inertia]], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.b[:, 0], [0, 60 / inertia], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.c, [[1, 0], [-1, 0], [0, 1]], atol=1e-12)
    np.testing.assert_allclose(found.d[:, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(np.sort_complex(found.poles), np.sort_complex(np.roots([inertia, 6, 60])), rtol=1e-9)


ARM = {"kind": "rod", "length": 0.5, "height": 0.03, "width": 0.03, "density": 900.0}


def arm(first: float, second: float, rates: tuple[float, float] = (0.0, 0.0), **solver: Any) -> Scene:
    """Two links that hang from a hinge, with a torque in the second and a spring in the first."""
    sides = {"first": {"body": "a", "point": "end"}, "second": {"body": "b"}}
    return Scene.parse({
        "name": "arm", "bodies": {"a": ARM, "b": ARM | {"length": 0.4}},
        "joints": {"A": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "a"}}, "B": sides},
        "signals": {"u": 0.0},
        "loads": {
            "motor": {"kind": "torque", "at": {"body": "b"}, "reaction": {"body": "a"}, "torque": "u"},
            "hold": {"kind": "torsion-spring", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "a"},
                     "stiffness": 3.0, "damping": 0.2, "angle": 0.0},
        },
        "initial": {"a": {"angle": first, "rate": rates[0]}, "b": {"angle": first + second, "rate": sum(rates)}},
        "markers": {"tip": {"body": "b", "point": "end"}}, "solver": {"duration": 0.05, **solver},
    })  # fmt: skip


def test_runs_from_beside_the_equilibrium_move_by_the_exponential_of_a() -> None:
    found = linearize(arm(0.1, -0.4), ["u"])
    assert found.states == ("angle(A)", "angle(B)", "rate(A)", "rate(B)")
    step, columns = 1e-4, []

    def end(state: Any) -> Any:
        scene = arm(*state[:2], rates=tuple(state[2:]), relative_tolerance=1e-12, absolute_tolerance=1e-14)
        run = simulate(scene, np.array([0.05]))
        assert run.velocities is not None
        return run

    base = np.array([*found.at, 0.0, 0.0])
    tip = linearize(arm(0.1, -0.4), ["u"], ["position(tip, x)", "position(tip, y)"])
    moved = scipy.linalg.expm(found.a * 0.05)
    for unit in np.eye(4):
        ahead, back = (end(base + sign * step * unit).points[-1, 0, :, 0] for sign in (1.0, -1.0))
        columns.append((ahead - back) / (2.0 * step))
    np.testing.assert_allclose(np.stack(columns, axis=1), tip.c @ moved, atol=1e-7)


@pytest.mark.parametrize("rates", [(0.0, 0.0), (2.0, -3.0)])
def test_a_state_out_of_balance_or_in_motion_accelerates_as_in_mujoco(rates: tuple[float, float]) -> None:
    """Differences of MuJoCo's accelerations by places, rates and controls."""
    found = linearize(arm(0.3, -0.9, rates), ["u"], about="start")
    spring = "<joint name='A' axis='0 -1 0' stiffness='3' damping='0.2' springref='0'/>"
    links = [
        f"<inertial pos='{length / 2} 0 0' mass='{mass}' diaginertia='1 {mass * length**2 / 12} 1'/>"
        for length, mass in ((0.5, 0.5 * 0.81), (0.4, 0.4 * 0.81))
    ]
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><compiler angle='radian'/><option gravity='0 0 -9.81'><flag contact='disable'/></option><worldbody>"
        f"<body>{links[0]}{spring}<body pos='0.5 0 0'>{links[1]}<joint name='B' axis='0 -1 0'/></body></body>"
        f"</worldbody><actuator><motor joint='B'/></actuator></mujoco>"
    )
    data = mujoco.MjData(model)
    base = np.array([0.3, -0.9, *rates, 0.0])

    def acceleration(state: Any) -> Any:
        data.qpos[:], data.qvel[:], data.ctrl[:] = state[:2], state[2:4], state[4:]
        mujoco.mj_forward(model, data)
        return data.qacc.copy()

    h = 1e-5
    slopes = [(acceleration(base + h * unit) - acceleration(base - h * unit)) / (2 * h) for unit in np.eye(5)]
    np.testing.assert_allclose(np.hstack([found.a[2:], found.b[2:]]), np.stack(slopes, axis=1), atol=1e-5)
    assert found.ok
    assert "by-differences" in found.codes


def test_a_rod_that_bends_is_described_by_its_modes() -> None:
    strip = ARM | {"element": "ancf-quintic", "elements": 4, "youngs_modulus": 2e9}
    clamp = {"kind": "weld", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "strip"}}
    tip = {"kind": "force", "at": {"body": "strip", "point": "end"}, "force": [0.0, 1.0], "scale": 0.0}
    scene = Scene.parse({"name": "strip", "bodies": {"strip": strip}, "joints": {"clamp": clamp}, "loads": {"tip": tip},
                         "markers": {"end": {"body": "strip", "point": "end"}}})  # fmt: skip
    found = linearize(scene, ["tip"], ["position(end, y)"])
    assert found.states[0] == "mode 1"
    with pytest.raises(InputError, match="outputs: missing"):
        linearize(scene, ["tip"])
    modes = shoal.modes(scene, count=5, verify=False)
    swings = found.poles[found.poles.imag > 0.0]
    np.testing.assert_allclose(swings.imag[:5] / (2 * np.pi), modes.frequencies, rtol=1e-9)
    # The deflection under a constant force, E I = 2e9 0.03^4 / 12: F L^3 / 3 E I, stiffened by nothing.
    weight = found.response(np.array([0.0]))[0, 0, 0].real
    assert weight == pytest.approx(0.5**3 / (3 * 2e9 * 0.03**4 / 12), rel=1e-3)


def test_a_model_at_a_switch_says_so() -> None:
    found = linearize(cart_pole(scale="-3*max(slide(rail), 0) + u"), ["u"], about="start")
    assert "on-a-kink" in found.codes


BAD = {
    "unknown input": (["v"], [], r"inputs: no signal 'v', nor a load .* there are u, follows, push"),
    "input of the motion": (["follows"], [], r"inputs: signals\.follows follows the motion"),
    "unknown place": (["u"], ["position(top, x)"], r"outputs: position\(top, x\): no marker, body or point"),
    "no formula": (["u"], ["slide(rail"], "outputs: 'slide"),
    "of time": (["u"], ["2*t"], r"outputs: '2\*t' does not depend on the motion"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_an_input_or_an_output_is_refused_by_name(case: str) -> None:
    inputs, outputs, message = BAD[case]
    with pytest.raises(InputError, match=message):
        linearize(cart_pole(follows="slide(rail)"), inputs, outputs, about="start")


def test_along_a_trajectory_it_is_that_of_the_state_reached() -> None:
    scene = arm(0.3, -0.9)
    there = linearize(scene, ["u"], ["angle(A)", "angle(B)", "rate(A)", "rate(B)"], about="trajectory", time=0.05)
    first, second, *rates = there.at
    again = linearize(arm(first, second, tuple(rates)), ["u"], about="start")
    np.testing.assert_allclose(there.a, again.a, rtol=1e-6, atol=1e-6)


def test_both_ways_agree_where_both_may_be_used() -> None:
    """About rest all is exact; a rate of nearly nothing takes differences."""
    exact = linearize(cart_pole(), ["u"], ["position(tip, y)", "rate(rod)"], about="start")
    moving = linearize(
        cart_pole().with_values({"initial.rod.rate": 1e-8}), ["u"], ["position(tip, y)", "rate(rod)"], about="start"
    )
    np.testing.assert_allclose(moving.a, exact.a, atol=1e-7)
    np.testing.assert_allclose(moving.b, exact.b, atol=1e-9)
    np.testing.assert_allclose(moving.c, exact.c, atol=1e-7)


def test_a_governor_in_steady_rotation_has_the_frequency_of_its_closed_form() -> None:
    """A thin rod on a free shaft: w^2 = W^2 sin^2 + 4 I W^2 sin^2 cos^2 / (J + I sin^2) of its angle."""
    mass, length, speed, shaft = 1.0, 0.5, 8.0, 0.05
    inertia, angle = mass * length**2 / 3.0, np.arccos(3.0 * G / (2.0 * length * speed**2))
    spin = {"spin": [0.0, 0.0, speed]}
    rod = {"kind": "rigid-body", "mass": mass, "centre_of_mass": [length / 2, 0.0, 0.0],
           "inertia": [1e-12, mass * length**2 / 12, mass * length**2 / 12]}  # fmt: skip
    scene = Scene.parse({
        "name": "governor", "dimensions": 3, "gravity": [0.0, 0.0, -G],
        "bodies": {"shaft": {"kind": "rigid-body", "mass": 1.0, "inertia": [shaft, shaft, shaft]}, "rod": rod},
        "joints": {
            "S": {"first": {"body": "ground", "point": [0.0, 0.0, 0.0]}, "second": {"body": "shaft"},
                  "axis": [0, 0, 1]},
            "H": {"first": {"body": "shaft"}, "second": {"body": "rod"}, "axis": [0, 1, 0]},
        },
        "loads": {"drive": {"kind": "torque", "at": {"body": "shaft"}, "torque": 0.0, "axis": [0, 0, 1]}},
        "initial": {"shaft": spin, "rod": {"rotation": [0.0, np.pi / 2 - angle, 0.0], **spin}},
        "markers": {"tip": {"body": "rod"}},
    })  # fmt: skip
    found = linearize(scene, ["drive"], about="start")
    own = speed**2 * np.sin(angle) ** 2
    square = own + 4.0 * inertia * own * np.cos(angle) ** 2 / (shaft + inertia * np.sin(angle) ** 2)
    assert found.states == ("angle(S)", "angle(H)", "rate(S)", "rate(H)")
    assert np.max(found.poles.imag) == pytest.approx(np.sqrt(square), rel=1e-7)
    np.testing.assert_allclose(found.b[2:, 0], [1.0 / (shaft + inertia * np.sin(angle) ** 2), 0.0], atol=1e-8)


def test_states_of_the_user_are_states() -> None:
    """A motor with an inductance, a gear and viscous friction turns a disc: the textbook's third order."""
    resistance, inductance, constant, gear, inertia, friction = 0.8, 2e-3, 0.06, 20.0, 0.046, 0.05
    disc = {"kind": "rigid-body", "mass": 1.0, "inertia": inertia}
    pin = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "disc"}}
    scene = Scene.parse({
        "name": "motor", "bodies": {"disc": disc}, "joints": {"axle": pin}, "signals": {"u": 0.0},
        "states": {"i": {"rate": f"(u - {resistance}*i - {gear * constant}*rate(axle))/{inductance}", "size": 10.0}},
        "loads": {"motor": {"kind": "torque", "at": {"body": "disc"},
                            "torque": f"{gear * constant}*i - {friction}*rate(axle)"}},
        "markers": {"rim": {"body": "disc"}},
    })  # fmt: skip
    found = linearize(scene, ["u"], ["rate(axle)", "i"], about="start")
    assert found.states == ("angle(axle)", "rate(axle)", "i")
    by = gear * constant
    np.testing.assert_allclose(
        found.a,
        [[0, 1, 0], [0, -friction / inertia, by / inertia], [0, -by / inductance, -resistance / inductance]],
        rtol=1e-8, atol=1e-7,
    )  # fmt: skip
    np.testing.assert_allclose(found.b[:, 0], [0, 0, 1 / inductance], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.c, [[0, 1, 0], [0, 0, 1]], atol=1e-9)


def test_smoothed_friction_is_a_slope_where_differences_are_taken() -> None:
    """At the start out of balance: coulomb / coulomb_speed over the inertia."""
    link = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.1, "centre_of_mass": [0.3, 0.0]}
    hinge = {
        "first": {"body": "ground", "point": [0.0, 0.0]},
        "second": {"body": "a"},
        "coulomb": 5.0,
        "coulomb_speed": 1e-3,
    }
    scene = Scene.parse({
        "name": "rubs", "bodies": {"a": link}, "joints": {"J": hinge}, "markers": {"m": {"body": "a"}},
        "loads": {"t": {"kind": "torque", "at": {"body": "a"}, "torque": 0.0}}, "initial": {"a": {"angle": -0.3}},
    })  # fmt: skip
    found = linearize(scene, ["t"], about="start")
    assert found.a[1, 1] == pytest.approx(-5.0 / 1e-3 / (0.1 + 2.0 * 0.09), rel=1e-6)
    assert "friction-as-slope" in found.codes


def test_contacts_that_stick_are_refused_by_name() -> None:
    contact = {"first": {"body": "b", "radius": 0.05}, "second": {"body": "ground", "line": 0.0}, "rolling": True}
    scene = Scene.parse({
        "name": "rolls", "bodies": {"b": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.002}},
        "contacts": {"f": contact}, "markers": {"m": {"body": "b"}}, "initial": {"b": {"position": [0.0, 0.05]}},
        "loads": {"t": {"kind": "torque", "at": {"body": "b"}, "torque": 0.0}},
    })  # fmt: skip
    with pytest.raises(ComputationError, match=r"contacts\.f has friction"):
        linearize(scene, ["t"], about="start")
    with pytest.raises(ComputationError, match=r"contacts\.f has friction"):
        shoal.modes(scene, about="start")


def test_the_command_writes_the_matrices_for_other_tools(tmp_path: Any) -> None:
    import yaml
    from click.testing import CliRunner
    from scipy.io import loadmat
    from shoal.cli import main

    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump(cart_pole().model_dump(mode="json", exclude_none=True)))
    for name in ("model.mat", "model.npz", "model.json", "bode.png"):
        run = CliRunner().invoke(main, [
            "linearize", str(path), "--inputs", "u", "--outputs", "slide(rail), position(tip, x)", "--about", "start",
            "--out", str(tmp_path / name),
        ])  # fmt: skip
        assert run.exit_code == 0, run.output
    expected = linearize(cart_pole(), ["u"], ["slide(rail)", "position(tip, x)"], about="start")
    np.testing.assert_allclose(loadmat(tmp_path / "model.mat")["A"], expected.a)
    np.testing.assert_allclose(np.load(tmp_path / "model.npz")["C"], expected.c)
    assert np.load(tmp_path / "model.npz")["states"].tolist() == list(expected.states)
