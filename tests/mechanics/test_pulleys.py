"""Ropes over pulleys, drums and eyes: closed forms, scipy and MuJoCo's tendons."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.rope_path import spans, tangents, wraps
from shoal.mechanics.simulate import simulate
from shoal.notebook import sweep
from shoal.scene import Scene

FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}
KEEPS = ["exactly", "at-most"]
G = 9.81


def pulley(x: float = 0.0, y: float = 0.0, radius: float = 0.1, side: str = "right", **more: Any) -> dict[str, Any]:
    return {"body": "ground", "point": [x, y], "radius": radius, "side": side, **more}


def hung(masses: dict[str, tuple[float, list[float], list[float]]], rope: dict[str, Any], **more: Any) -> Scene:
    """Point masses by name with mass, place and velocity, on a rope from the first to the last unless it says else."""
    first, last = next(iter(masses)), list(masses)[-1]
    joints = {"rope": {"kind": "rope", "first": {"body": first}, "second": {"body": last}} | rope}
    data = {
        "name": "hung", "bodies": {n: {"kind": "point-mass", "mass": m} for n, (m, _, _) in masses.items()},
        "joints": joints, "markers": {n: {"body": n} for n in masses}, "solver": {"duration": 0.5},
        "initial": {n: {"position": x, "velocity": v} for n, (_, x, v) in masses.items()},
    }  # fmt: skip
    return Scene.parse({key: value | more.pop(key, {}) if isinstance(value, dict) else value
                        for key, value in data.items()} | more)  # fmt: skip


STILL = [0.0, 0.0]
WEIGHTS = {"a": (3.0, [-0.1, -1.0], STILL), "b": (2.0, [0.1, -1.0], STILL)}
WHEEL = {"wheel": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.02}}
AXLE = {"axle": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "wheel", "point": [0.0, 0.0]}}}


@pytest.mark.parametrize("keeps", KEEPS)
@pytest.mark.parametrize("grips", [False, True])
def test_a_rope_over_a_pulley_slips_or_turns_it(keeps: str, grips: bool) -> None:
    """Atwood's machine with a pulley that the rope slips on, and with one of 0.02 kg m^2 that it turns."""
    guide = {"body": "wheel", "point": [0.0, 0.0], "radius": 0.1, "side": "right", "grips": grips}
    scene = hung(WEIGHTS, {"over": [guide], "keeps": keeps}, bodies=WHEEL, joints=AXLE)
    pace = G / (5.0 + 2.0 * grips)  # of the weights, less than the difference of both by their inertia
    found = simulate(scene.with_values(FINE), np.array([0.5]))
    assert found.ok, found.message
    assert found.marker("a")[0] == pytest.approx([-0.1, -1.0 - pace / 8], abs=1e-9)
    assert found.marker("b")[0] == pytest.approx([0.1, -1.0 + pace / 8], abs=1e-9)
    held = reactions(scene, [0.1])[0]
    assert held.ok
    tensions = [3.0 * (G - pace), 2.0 * (G + pace)]
    names = ["tension1", "tension2"] if grips else ["tension"]
    assert held.joints["rope"].components == pytest.approx(dict(zip(names, tensions, strict=False)), rel=1e-8)
    assert held.joints["axle"].force[1] == pytest.approx(G + (sum(tensions) if grips else 2 * tensions[0]), rel=1e-8)


@pytest.mark.parametrize("keeps", KEEPS)
def test_a_hoist_halves_the_force(keeps: str) -> None:
    """A load on a loose pulley, whose rope ends on the ground: half of its weight holds it in equilibrium."""
    masses = {"a": (2.0, [-0.1, -1.0], STILL), "load": (4.0, [0.3, -0.8], STILL)}
    over = [pulley(), {"body": "load", "radius": 0.2, "side": "left"}]
    spring = {"s": {"kind": "spring", "first": {"body": "ground", "point": [-0.1, -2.0]}, "second": {"body": "a"},
                    "stiffness": 300.0, "length": 0.9}}  # fmt: skip
    end = {"body": "ground", "point": [0.5, 0.0]}
    rope = {"over": over, "keeps": keeps, "second": end}
    scene = hung(masses, rope, loads=spring)
    rest = statics(scene)
    assert rest.ok, rest.message
    assert rest.marker("a")[1] == pytest.approx(-1.1, abs=1e-8)  # its weight is balanced: the spring is relaxed
    assert rest.marker("load") == pytest.approx([0.3, -0.75], abs=1e-7)
    found = simulate(scene.with_values(FINE), np.array([0.3]))
    inertia = 2.0 + 4.0 / 4.0
    pace = np.sqrt(300.0 / inertia)
    assert found.ok, found.message
    assert found.marker("a")[0][1] == pytest.approx(-1.1 + 0.1 * np.cos(0.3 * pace), abs=1e-8)
    if keeps == "exactly":
        least = min(abs(one.eigenvalue - 1j * pace) for one in modes(scene).modes)
        assert least < 1e-5 * pace


@pytest.mark.parametrize("keeps", KEEPS)
def test_a_drum_winds_its_rope_over_many_turns(keeps: str) -> None:
    """Fifteen turns of a drum of 0.02 kg m^2 by a falling weight, from which its rope unwinds."""
    drum = {"body": "wheel", "point": [0.0, 0.0], "radius": 0.05, "side": "right"}
    scene = hung({"a": (3.0, [-0.05, -1.0], STILL)}, {"second": drum, "keeps": keeps}, bodies=WHEEL, joints=AXLE,
                 markers={"edge": {"body": "wheel", "point": [1.0, 0.0]}}, solver={"duration": 1.55})  # fmt: skip
    pace = 3.0 * G / (3.0 + 0.02 / 0.05**2)
    fallen = pace * 1.55**2 / 2
    found = simulate(scene.with_values(FINE), np.array([1.55]))
    assert found.ok, found.message
    assert found.marker("a")[0][1] == pytest.approx(-1.0 - fallen, abs=1e-8)
    angle = fallen / 0.05
    assert angle > 10 * np.pi
    assert found.marker("edge")[0] == pytest.approx([np.cos(angle), np.sin(angle)], abs=1e-6)
    torque = np.ravel(reactions(scene, [0.1])[0].joints["rope"].torque)[0]
    assert torque == pytest.approx(3.0 * (G - pace) * 0.05, rel=1e-7)


def tangent(place: Any, centre: Any, radius: float, sense: float) -> tuple[Any, float]:
    """Unit vector from a place to where its tangent meets a circle, and the length of that."""
    way = np.asarray(centre) - place
    away = np.hypot(*way)
    angle = np.arctan2(way[1], way[0]) + sense * np.arcsin(radius / away)
    return np.array([np.cos(angle), np.sin(angle)]), np.sqrt(away**2 - radius**2)


SWINGING = {"a": (3.0, [-0.5, -1.0], STILL), "b": (2.0, [1.7, -1.0], STILL)}
TWO = [pulley(), pulley(1.0, 0.3, 0.23)]


def swung(time: float) -> Any:
    """Places of both weights, by Newton's law with the tension that keeps the sum of both tangents and arcs."""
    m1, m2, weight = 3.0, 2.0, np.array([0.0, -G])

    def moves(_: float, x: Any) -> Any:
        a, b, va, vb = x.reshape(4, 2)
        (ua, sa), (ub, sb) = tangent(a, [0.0, 0.0], 0.1, 1.0), tangent(b, [1.0, 0.3], 0.23, -1.0)
        bias = sum((u[0] * v[1] - u[1] * v[0]) ** 2 / s for u, v, s in ((ua, va, sa), (ub, vb, sb)))
        force = (bias - (ua + ub) @ weight) / (1.0 / m1 + 1.0 / m2)
        return np.concatenate([va, vb, weight + force * ua / m1, weight + force * ub / m2])

    start = [-0.5, -1.0, 1.7, -1.0, 0.0, 0.0, 0.0, 0.0]
    return solve_ivp(moves, (0.0, time), start, rtol=1e-12, atol=1e-13).y[:4, -1]


@pytest.mark.parametrize("keeps", KEEPS)
def test_weights_that_swing_on_a_rope_over_two_pulleys_are_those_of_scipy(keeps: str) -> None:
    found = simulate(hung(SWINGING, {"over": TWO, "keeps": keeps}).with_values(FINE), np.array([0.5]))
    assert found.ok, found.message
    assert np.concatenate([found.marker(name)[0] for name in "ab"]) == pytest.approx(swung(0.5), abs=1e-8)


@pytest.mark.parametrize("integrator", ["rk4", "leapfrog", "generalized-alpha", "radau5"])
def test_every_integrator_moves_a_rope(integrator: str) -> None:
    scene = hung(SWINGING, {"over": TWO, "keeps": "exactly"}, solver={"duration": 0.5, "step": 5e-4})
    found = simulate(scene.with_values({"solver.integrator": integrator}), np.array([0.5]))
    assert found.ok, found.message
    assert np.concatenate([found.marker(name)[0] for name in "ab"]) == pytest.approx(swung(0.5), abs=2e-6)


def test_radii_vary_from_lane_to_lane() -> None:
    scene = hung(SWINGING, {"over": TWO})
    found = sweep(scene.with_values(FINE), {"joints.rope.over.0.radius": [0.05, 0.1, 0.2]}, 0.5).positions
    assert np.concatenate([found[name][1] for name in "ab"]) == pytest.approx(swung(0.5), abs=1e-8)
    alone = simulate(scene.with_values(FINE | {"joints.rope.over.0.radius": 0.2}), np.array([0.5]))
    assert found["a"][2] == pytest.approx(alone.marker("a")[0], abs=1e-7)


def test_a_rope_goes_slack_and_is_taut_again_by_an_impact() -> None:
    """A weight thrown up while the other falls: 3 t - g t^2 of slack, and an impact that takes 3 m/s."""
    thrown = {"a": (3.0, [-0.1, -1.0], [0.0, 3.0]), "b": (2.0, [0.1, -1.0], STILL)}
    found = simulate(hung(thrown, {"over": [pulley()]}).with_values(FINE), np.array([0.5]))
    assert found.ok, found.message
    (event,) = found.model["events"]
    assert event["time"] == pytest.approx(3.0 / G, abs=1e-9)
    assert event["impulse"] == pytest.approx(3.0 / (1 / 3.0 + 1 / 2.0), rel=1e-9)
    after = 0.5 - 3.0 / G
    rate = 3.0 - G * 3.0 / G + 3.6 / 3.0
    place = -1.0 + 3.0 * (3.0 / G) - G * (3.0 / G) ** 2 / 2 + rate * after - G / 5.0 * after**2 / 2
    assert found.marker("a")[0][1] == pytest.approx(place, abs=1e-8)


def test_a_longer_rope_is_slack_at_the_start() -> None:
    """The straight spans, half a turn around the pulley, and a tenth of a metre."""
    fixed = {"body": "ground", "point": [0.1, -1.0]}
    rope = {"over": [pulley()], "second": fixed, "length": 2.0 + 0.1 * np.pi + 0.1}
    found = simulate(hung({"a": WEIGHTS["a"]}, rope).with_values(FINE), np.array([0.5]))
    assert found.ok, found.message
    assert found.model["events"][0]["time"] == pytest.approx(np.sqrt(0.2 / G), abs=1e-9)
    assert found.marker("a")[0][1] == pytest.approx(-1.1, abs=1e-8)
    with pytest.raises(InputError, match=r"joints.rope.length: the machine starts beyond this limit, at 2.31416"):
        simulate(hung({"a": WEIGHTS["a"]}, rope | {"length": 2.2}), np.array([0.1]))


def test_a_rope_that_would_push_or_leaves_its_pulley_is_told() -> None:
    fixed = {"body": "ground", "point": [1.0, 0.0]}
    looped = {"a": (3.0, [-0.1, -1.0], [-5.5, 0.0])}
    rope = {"over": [pulley()], "second": fixed}
    found = simulate(hung(looped, rope | {"keeps": "exactly"}, solver={"duration": 0.9}), np.array([0.9]))
    assert {one.code for one in found.findings} == {"slack", "rope-leaves"}
    assert "rope rope would have to push" in found.message
    assert not found.ok
    thrown = simulate(hung(looped, rope, solver={"duration": 0.9}), np.array([0.9]))
    assert [one.code for one in thrown.findings] == ["rope-leaves"]


def test_an_end_that_meets_its_pulley_is_told() -> None:
    """A weight that is drawn into the pulley, where no span is left."""
    thrown = {"a": (3.0, [-0.1, -1.0], STILL), "b": (0.3, [0.1, -0.5], STILL)}
    found = simulate(hung(thrown, {"over": [pulley()]}), np.array([0.5]))
    assert not found.ok
    assert "span-vanishes" in {one.code for one in found.findings}


def test_an_elastic_rope_swings_as_mujocos_tendon() -> None:
    """A spatial tendon that wraps a cylinder, with a spring that only pulls."""
    mujoco: Any = pytest.importorskip("mujoco")
    masses = {"a": (1.0, [-0.4, -1.0], [0.0, 0.0]), "b": (0.7, [0.5, -0.8], [0.0, 0.0])}
    law = {"stiffness": 100.0, "exponent": 1.0}
    length = 2.4
    scene = hung(masses, {"over": [pulley(radius=0.2)], "law": law, "length": length})
    ours = simulate(scene.with_values(FINE), np.array([0.3]))
    assert ours.ok, ours.message
    bodies = "".join(
        f'<body pos="{x[0]} {x[1]} 0"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
        f'<inertial pos="0 0 0" mass="{m}" diaginertia="1 1 1"/><site name="{name}"/></body>'
        for name, (m, x, _) in masses.items()
    )
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><option gravity="0 -9.81 0" integrator="RK4" timestep="5e-5"/>
      <worldbody>{bodies}<geom name="p" type="cylinder" size=".2 .1" contype="0" conaffinity="0"/>
      <site name="side" pos="0 .5 0"/></worldbody><tendon><spatial stiffness="100" springlength="0 {length}">
      <site site="a"/><geom geom="p" sidesite="side"/><site site="b"/></spatial></tendon></mujoco>""")
    there = mujoco.MjData(model)
    mujoco.mj_step(model, there, 6000)
    mujoco.mj_kinematics(model, there)
    for name in masses:
        assert ours.marker(name)[0] == pytest.approx(there.site(name).xpos[:2], abs=1e-6)


@pytest.mark.parametrize("keeps", KEEPS)
def test_in_space_a_rope_goes_over_eyes(keeps: str) -> None:
    """A bead on a rope between two posts keeps to an ellipsoid: its energy, and the sum of both spans."""
    rope = {"first": {"body": "ground", "point": [-1.0, 0.0, 0.0]}, "over": [{"body": "bead"}], "keeps": keeps,
            "second": {"body": "ground", "point": [1.0, 0.2, 0.0]}}  # fmt: skip
    scene = hung({"bead": (1.0, [0.3, -0.8, 0.0], [0.0, 0.0, 1.5])}, rope, dimensions=3, gravity=[0.0, -G, 0.0])
    found = simulate(scene.with_values(FINE), np.linspace(0.0, 0.5, 6))
    assert found.ok, found.message
    way = found.marker("bead")
    spans = np.linalg.norm(way - [-1.0, 0.0, 0.0], axis=1) + np.linalg.norm(way - [1.0, 0.2, 0.0], axis=1)
    assert spans == pytest.approx(spans[0], abs=1e-9)
    speed = np.sqrt(np.sum(found.velocities[:, 0, :, 0] ** 2, axis=1))  # type: ignore[index]
    assert speed**2 / 2 + G * way[:, 1] == pytest.approx(1.5**2 / 2 - 0.8 * G, abs=1e-8)


def test_the_path_of_a_rope_is_as_long_as_its_spans_and_arcs() -> None:
    centres = np.array([[[-0.1, -1.0], [0.0, 0.0], [1.0, 0.0], [1.0 + 0.2, -2.0]]])
    radii = [0.0, -0.1, -0.2, 0.0]
    begin, end = spans(centres, radii)
    along, _ = tangents(centres, radii)
    straight = np.sum(np.linalg.norm(end - begin, axis=-1))
    slope = np.arcsin(0.1)
    exact = 1.0 + 0.1 * (np.pi / 2 - slope) + np.sqrt(1.0 - 0.1**2) + 0.2 * (np.pi / 2 + slope) + 2.0
    assert straight + wraps(along, radii, [0, 0])[0] @ [0.1, 0.2] == pytest.approx(exact, rel=1e-12)
    assert straight + wraps(along, radii, [0, 1])[0] @ [0.1, 0.2] == pytest.approx(exact + 0.4 * np.pi, rel=1e-12)


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "an eye that grips": ({"over": [{"body": "ground", "point": [0.0, 0.0], "grips": True}]}, "grips: is of a pulley"),
    "a law that holds": ({"keeps": "exactly", "law": {"stiffness": 1.0}}, "law: is of a rope that keeps at-most"),
    "no span": ({"over": [pulley(-0.1, -1.0, 0.3)]}, "joints.rope: two places that follow each other are"),
    "a length of parts": ({"second": pulley(), "length": 1.0}, "length: is of a rope of one part with fixed ends"),
    "no such body": ({"over": [{"body": "x", "radius": 0.1}]}, "joints.rope.over.0.body: no body 'x'"),
    "a drum without a direction": ({"second": {"body": "b", "radius": 0.1}}, "b is a point mass, which has no"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_rope_that_is_none_is_refused_by_name(case: str) -> None:
    rope, message = BAD[case]
    with pytest.raises(InputError) as refused:
        simulate(hung(WEIGHTS, rope), np.array([0.0]))
    assert message in str(refused.value)


def test_other_engines_refuse_ropes_by_name() -> None:
    with pytest.raises(InputError, match=r"joints.rope: engine exudyn cannot do rope|rope is not among"):
        get_engine("exudyn").simulate(hung(WEIGHTS, {"over": [pulley()]}))
    flat = {n: (m, [*x, 0.0], [*v, 0.0]) for n, (m, x, v) in WEIGHTS.items()}
    with pytest.raises(InputError, match=r"joints.rope.over.0.radius: in space a rope goes over eyes"):
        hung(flat, {"over": [pulley()]}, dimensions=3)


def test_a_rope_that_is_watched_by_its_tension_refuses_samples_in_its_own_words() -> None:
    law = {"f": {"kind": "force", "at": {"body": "a"}, "force": [0.0, 1.0], "scale": "u"}}
    sampled = {"u": {"sample": "position(a, y)", "period": 0.01}}
    scene = hung(WEIGHTS, {"over": [pulley()], "keeps": "exactly"}, loads=law, signals=sampled)
    with pytest.raises(InputError, match=r"^signals.u: sampled every 0.01 s: joints.rope.keeps: exactly is watched"):
        simulate(scene, np.array([0.1]))
