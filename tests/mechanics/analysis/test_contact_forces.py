"""Forces of contacts, stops and ropes in motion and at rest, and of the joints beside them, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.identification.recording.observation import observe
from shoal.identification.recording.source import Channel
from shoal.mechanics.analysis.joint_reactions import Reactions
from shoal.mechanics.analysis.reaction_findings import ReactionsStatus
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.reactions_verified import verified
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.response.limits.limit import limit
from shoal.scene import Scene

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
G = 9.81
GROUND = {"body": "ground", "point": [0.0, 0.0]}
BLOCK = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.02}


def _scene(bodies: dict[str, Any], initial: dict[str, Any], **more: Any) -> Scene:
    markers = {name: {"body": name, "point": [0.0, 0.0]} for name in bodies}
    given = {"name": "s", "gravity": [0.0, -G], "bodies": bodies, "initial": initial, "markers": markers}
    return Scene.parse(given | more)


def _slope(mu: float, angle: float, speed: float = 0.0) -> Scene:
    """A point mass of 2 kg on a slope that rises to the right."""
    contact = {"first": {"body": "b"}, "second": {"body": "ground", "line": angle}, "mu": mu}
    start = {"position": [0.0, 0.0], "velocity": [speed * np.cos(angle), speed * np.sin(angle)]}
    return _scene({"b": {"kind": "point-mass", "mass": 2.0}}, {"b": start}, contacts={"f": contact})


def _balanced(found: Reactions) -> Reactions:
    assert found.ok, found.message
    assert found.unbalanced < 1e-12
    return found


@pytest.mark.parametrize(("mu", "state"), [(0.5, "sticks"), (0.2, "slips")])
def test_a_block_on_a_slope_sticks_by_its_weight_or_slips_by_the_normal_force(mu: float, state: str) -> None:
    angle, weight = 0.3, 2.0 * G
    for found in reactions(_slope(mu, angle), [0.0, 0.4]):
        one = _balanced(found).contacts["f"]
        assert one.state == state
        assert one.unique
        assert one.normal == pytest.approx(weight * np.cos(angle), rel=1e-12)
        # Along the normal turned clockwise, up the slope.
        friction = weight * np.sin(angle) if state == "sticks" else mu * weight * np.cos(angle)
        assert one.friction == pytest.approx(friction, rel=1e-9)


def test_friction_turns_where_a_block_that_was_pushed_up_slides_back() -> None:
    mu, angle, speed = 0.1, 0.3, 1.0
    turns = speed / (G * (np.sin(angle) + mu * np.cos(angle)))
    up, back = (one.contacts["f"].friction for one in reactions(_slope(mu, angle, speed), [0.9 * turns, 1.1 * turns]))
    assert up == pytest.approx(-mu * 2.0 * G * np.cos(angle), rel=1e-12)
    assert back == pytest.approx(-up, rel=1e-12)


def _swing(speed: float) -> Scene:
    """A mass of 2 kg that hangs on a rope of 1 m, and is thrown to the right."""
    rope = {"kind": "distance", "keeps": "at-most", "length": 1.0, "first": GROUND, "second": {"body": "b"},
            "restitution": 0.3}  # fmt: skip
    start = {"position": [0.0, -1.0], "velocity": [speed, 0.0]}
    return _scene({"b": {"kind": "point-mass", "mass": 2.0}}, {"b": start}, joints={"rope": rope})


def test_a_rope_has_the_tension_of_a_pendulum_until_it_goes_slack_and_an_impulse_when_it_is_taut_again() -> None:
    speed, scene = 5.6, _swing(5.6)
    events = simulate(scene, np.array([1.3])).model["events"]
    slack, taut = events[0], events[1]
    times = [0.0, 0.5 * slack["time"], 0.5 * (slack["time"] + taut["time"])]
    for found in reactions(scene, times[:2]):
        joint = _balanced(found).joints["rope"]
        # From the balance of energy, by the height of the mass: m (v^2/L + g cos), v^2 = v0^2 - 2 g L (1 - cos).
        fall = -joint.at[1]
        tension = 2.0 * (speed**2 - 2.0 * G * (1.0 - fall) + G * fall)
        np.testing.assert_allclose(joint.force, -tension * np.array(joint.at), rtol=1e-9)
        assert joint.components["axial"] == pytest.approx(-tension, rel=1e-9)
    (free,) = reactions(scene, times[2:])
    assert free.joints["rope"].force == (0.0, 0.0)
    # It leaves where the tension is zero, on a parabola that meets the circle again.
    c = (2.0 * G - speed**2) / (3.0 * G)
    place, along = np.array([np.sqrt(1.0 - c**2), -c]), np.array([c, np.sqrt(1.0 - c**2)])
    rate = np.sqrt(-G * c) * along
    # |place + rate t + g t^2 / 2|^2 = 1, of whose roots three are zero.
    span = -4.0 * rate[1] / -G
    speed_out = (place + rate * span + 0.5 * np.array([0.0, -G]) * span**2) @ (rate + np.array([0.0, -G]) * span)
    assert taut["time"] - slack["time"] == pytest.approx(span, abs=1e-9)
    assert taut["impulse"] == pytest.approx(2.0 * 1.3 * speed_out, rel=1e-9)


def test_at_an_impact_there_is_an_impulse_and_no_force() -> None:
    floor = {"first": {"body": "b"}, "second": {"body": "ground", "line": 0.0}, "restitution": 0.5}
    scene = _scene({"b": {"kind": "point-mass", "mass": 2.0}}, {"b": {"position": [0.0, 1.0]}}, contacts={"f": floor})
    falls = float(np.sqrt(2.0 / G))
    before, at, after = verified(scene, [0.9 * falls, falls, 1.1 * falls])
    assert before.contacts["f"].normal == after.contacts["f"].normal == 0.0
    assert before.contacts["f"].state == "open"
    assert after.contacts["f"].force_error == 0.0
    assert at.status is ReactionsStatus.IMPACT
    assert np.isnan(at.contacts["f"].normal)
    assert at.impacts[0]["impulse"] == pytest.approx(2.0 * 1.5 * np.sqrt(2.0 * G), rel=1e-12)
    assert "impulse of 13.2883" in at.message


def test_a_bar_on_its_stop_presses_as_the_moment_of_its_weight_in_the_plane_and_in_space() -> None:
    for dimensions in (2, 3):
        bar = {"kind": "rigid-body", "mass": 2.0, "centre_of_mass": [0.5, 0.0], "inertia": 0.3}
        start: dict[str, Any] = {"angle": 0.0}
        if dimensions == 3:
            bar |= {"centre_of_mass": [0.5, 0.0, 0.0], "inertia": [0.3, 0.3, 0.3]}
            start = {}
        pin = {"kind": "revolute", "first": {"body": "ground", "point": [0.0] * dimensions}, "second": {"body": "A"},
               "stops": {"min": 0.0}}  # fmt: skip
        pin["second"] = {"body": "A", "point": [0.0] * dimensions}
        scene = Scene.parse({"name": "s", "dimensions": dimensions, "gravity": [0.0, -G, 0.0][:dimensions],
                             "bodies": {"A": bar}, "joints": {"O": pin}, "initial": {"A": start} if start else {},
                             "markers": {"A": {"body": "A", "point": [0.0] * dimensions}}})  # fmt: skip
        for found in (*reactions(scene, [0.0, 0.1]), statics(scene).reactions):
            assert found is not None
            joint = _balanced(found).joints["O"]
            np.testing.assert_allclose(np.atleast_1d(joint.torque)[-1], 2.0 * G * 0.5, rtol=1e-12)
            np.testing.assert_allclose(joint.force, [0.0, 2.0 * G, 0.0][:dimensions], atol=1e-12)
            assert joint.components["stop"] == pytest.approx(2.0 * G * 0.5, rel=1e-12)


def test_a_clamped_beam_presses_on_the_support_of_its_end_with_three_eighths_of_its_load() -> None:
    rod = {"kind": "rod", "length": 1.0, "density": 1000.0, "height": 0.05, "width": 0.02, "element": "ancf-cable",
           "youngs_modulus": 1e11, "elements": 8}  # fmt: skip
    weld = {"kind": "weld", "first": GROUND, "second": {"body": "r"}}
    prop = {"first": {"body": "r", "point": "end"}, "second": {"body": "ground", "point": [0.0, 0.0], "line": 0.0}}
    scene = _scene({"r": rod}, {"r": {"angle": 0.0}}, joints={"wall": weld}, contacts={"prop": prop})
    found = statics(scene)
    assert found.ok, found.message
    assert found.reactions is not None
    load = 1000.0 * 0.05 * 0.02 * G
    # The slope of the end, which shortens the beam, is some 1e-5.
    assert found.reactions.contacts["prop"].normal == pytest.approx(3.0 / 8.0 * load, rel=1e-4)
    assert found.reactions.joints["wall"].torque == pytest.approx(load / 8.0, rel=1e-4)
    assert found.reactions.joints["wall"].force[1] == pytest.approx(5.0 / 8.0 * load, rel=1e-4)


def test_a_disc_that_rolls_down_a_plane_in_space_is_held_by_a_third_of_its_weight_along_it() -> None:
    angle, mass, r = 0.2, 3.0, 0.1
    n = [-np.sin(angle), 0.0, np.cos(angle)]
    i = 0.25 * mass * r**2
    disc = {"kind": "rigid-body", "mass": mass, "inertia": [i, 2.0 * i, i], "centre_of_mass": [0.0, 0.0, 0.0]}
    side = {"body": "d", "point": [0.0, 0.0, 0.0], "radius": r, "axis": [0.0, 1.0, 0.0]}
    ground = {"body": "ground", "point": [0.0, 0.0, 0.0], "plane": n}
    place = (r * np.array(n)).tolist()
    scene = Scene.parse({"name": "s", "dimensions": 3, "gravity": [0.0, 0.0, -G], "bodies": {"d": disc},
                         "contacts": {"road": {"first": side, "second": ground, "mu": 0.5}},
                         "initial": {"d": {"position": place}},
                         "markers": {"d": {"body": "d", "point": [0.0] * 3}}})  # fmt: skip
    for found in reactions(scene, [0.0, 0.3]):
        one = _balanced(found).contacts["road"]
        assert one.state == "sticks"
        assert one.normal == pytest.approx(mass * G * np.cos(angle), rel=1e-9)
        assert one.friction == pytest.approx(mass * G * np.sin(angle) / 3.0, rel=1e-9)
    np.testing.assert_allclose(np.dot(one.at, n), 0.0, atol=1e-9)


def test_three_feet_on_one_line_share_a_load_that_the_motion_does_not_divide() -> None:
    feet = {name: {"first": {"body": "b", "point": [x, 0.0]}, "second": {"body": "ground", "line": 0.0}}
            for name, x in (("a", -1.0), ("b", 0.0), ("c", 1.0))}  # fmt: skip
    scene = _scene({"b": BLOCK}, {"b": {"position": [0.0, 0.0]}}, contacts=feet)
    (found,) = reactions(scene, [0.1])
    assert sum(one.normal for one in found.contacts.values()) == pytest.approx(2.0 * G, rel=1e-12)
    assert found.not_unique == ("a", "b", "c")
    two = scene.model_copy(update={"contacts": {name: scene.contacts[name] for name in "ac"}})
    (alone,) = reactions(two, [0.1])
    assert alone.not_unique == ()


def test_dry_friction_of_a_joint_that_sticks_bears_what_it_must() -> None:
    bar = {"kind": "rigid-body", "mass": 2.0, "centre_of_mass": [0.5, 0.0], "inertia": 0.3}
    pin = {"first": GROUND, "second": {"body": "A", "point": [0.0, 0.0]}, "coulomb": 12.0, "stick": "exact"}
    scene = _scene({"A": bar}, {"A": {"angle": 0.0}}, joints={"O": pin})
    (sticks,) = reactions(scene, [0.1])
    assert _balanced(sticks).joints["O"].torque == pytest.approx(2.0 * G * 0.5, rel=1e-12)
    (slips,) = reactions(scene.with_values({"joints.O.coulomb": 3.0}), [0.1])
    assert _balanced(slips).joints["O"].torque == pytest.approx(3.0, rel=1e-12)


def test_a_load_cell_below_a_contact_shows_weight_and_friction_and_nothing_at_an_impact() -> None:
    """A ball falls on a slope, rests on it, and slides."""
    angle, mu = 0.3, 0.1
    contact = {"first": {"body": "b"}, "second": {"body": "ground", "line": angle}, "mu": mu}
    scene = _scene({"b": {"kind": "point-mass", "mass": 2.0}}, {"b": {"position": [0.0, 1.0]}}, contacts={"f": contact})
    falls = float(np.sqrt(2.0 / G))
    channels = tuple(Channel(contact="f", quantity=what) for what in ("normal", "friction", "fx", "fy"))
    found = observe(simulate(scene, np.array([0.0, falls, 1.0]), whole=True), channels, scene=scene)[0]
    normal = 2.0 * G * np.cos(angle)
    np.testing.assert_array_equal(found[0], 0.0)
    assert np.all(np.isnan(found[1]))
    np.testing.assert_allclose(found[2, :2], [normal, mu * normal], rtol=1e-9)
    along, up = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    np.testing.assert_allclose(found[2, 2:], normal * up + mu * normal * along, rtol=1e-9)


def test_an_accelerometer_feels_the_floor() -> None:
    scene = _slope(0.5, 0.0).with_values({"bodies.b": {**BLOCK}})
    channels = tuple(Channel(marker="b", quantity=what) for what in ("ax", "ay"))
    found = observe(simulate(scene, np.array([0.0, 0.5]), whole=True), channels, scene=scene)[0]
    np.testing.assert_allclose(found, [[0.0, G], [0.0, G]], atol=1e-9)


def test_limits_are_of_contacts_too_and_other_names_are_refused() -> None:
    scene = _slope(0.2, 0.3)
    asked = limit("f.friction > 3", scene)
    motion = simulate(asked.scene(scene), np.array([0.0, 0.4]), {"contacts.f.mu": np.array([0.1, 0.2])}, whole=True)
    margins = asked.margins(motion, scene, {"contacts.f.mu": np.array([0.1, 0.2])})
    expected = 3.0 - np.array([0.1, 0.2]) * 2.0 * G * np.cos(0.3)
    np.testing.assert_allclose(margins, np.stack([expected, expected], axis=1), rtol=1e-9)
    with pytest.raises(InputError, match=r"no contact 'b'.*there are f"):
        limit("b.friction > 3", scene)
    with pytest.raises(ValueError, match="normal is measured at a contact"):
        Channel(joint="f", quantity="normal")


def test_a_pin_in_a_wider_hole_and_a_gear_with_backlash_bear_what_tight_ones_do() -> None:
    """Pins and teeth that rest on each other; the balance of free bodies is an equation of its own."""
    wheel = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.02}
    hang = {"first": GROUND, "second": {"body": "b", "point": [0.0, 0.0]}, "radius": 0.05, "play": 1e-3}
    scene = _scene({"b": wheel}, {"b": {"position": [0.0, -1e-3]}}, joints={"O": hang})
    for found in reactions(scene, [0.0, 0.1]):
        np.testing.assert_allclose(_balanced(found).joints["O"].force, [0.0, 2.0 * G], atol=1e-9)
    pins = {name: {"first": {"body": "ground", "point": [x, 0.0]}, "second": {"body": name, "point": [0.0, 0.0]}}
            for name, x in (("b", 0.0), ("c", 0.3))}  # fmt: skip
    mesh = {"kind": "gear", "first": {"body": "b"}, "second": {"body": "c"}, "ratio": -2, "backlash": 2e-3}
    torque = {"kind": "torque", "at": {"body": "b", "point": [0.0, 0.0]}, "torque": 0.6}
    geared = _scene({"b": wheel, "c": wheel}, {}, gravity=[0.0, 0.0], joints=pins | {"mesh": mesh}, loads={"m": torque})
    tight = geared.with_values({"joints.mesh.backlash": None})
    turns = 0.6 / (0.02 + 4.0 * 0.02)
    one, other = (_balanced(reactions(each, [0.3])[0]) for each in (geared, tight))
    assert one.joints["mesh"].torque == pytest.approx(-2.0 * turns * 0.02, rel=1e-9)
    assert other.joints["mesh"].torque == pytest.approx(-2.0 * turns * 0.02, rel=1e-9)


def test_a_box_on_a_slope_and_a_point_in_a_notch_bear_their_weight_at_two_places() -> None:
    angle, weight = 0.2, 2.0 * G
    box = [[-0.2, -0.1], [0.2, -0.1], [0.2, 0.1], [-0.2, 0.1]]
    first = {"body": "b", "point": [0.0, 0.0], "polygon": box}
    contact = {"first": first, "second": {"body": "ground", "line": angle}, "mu": 0.5}
    start = {"position": [-0.1 * np.sin(angle), 0.1 * np.cos(angle)], "angle": angle}
    scene = _scene({"b": BLOCK}, {"b": start}, contacts={"f": contact})
    one = _balanced(reactions(scene, [0.1])[0]).contacts["f"]
    assert one.unique  # though its corners could share friction otherwise
    assert one.normal == pytest.approx(weight * np.cos(angle), rel=1e-9)
    assert one.friction == pytest.approx(weight * np.sin(angle), rel=1e-9)
    # The force passes below the centre of mass.
    assert one.at[0] == pytest.approx(start["position"][0], abs=1e-9)
    cell = (Channel(contact="f", quantity="normal"), Channel(contact="f", quantity="fy"))
    seen = observe(simulate(scene, np.array([0.0, 0.1]), whole=True), cell, scene=scene)[0]
    np.testing.assert_allclose(seen, [[weight * np.cos(angle), weight]] * 2, rtol=1e-9)
    notch = [[1.0, 1.0], [1.0, -2.0], [-1.0, -2.0], [-1.0, 1.0], [0.0, 0.0]][::-1]
    side = {"body": "ground", "point": [0.0, 0.0], "polygon": notch}
    point = {"kind": "point-mass", "mass": 2.0}
    scene = _scene(
        {"b": point}, {"b": {"position": [0.0, 0.0]}}, contacts={"v": {"first": {"body": "b"}, "second": side}}
    )
    found = _balanced(reactions(scene, [0.0])[0]).contacts["v"]
    np.testing.assert_allclose(found.force, [0.0, weight], atol=1e-9)
    assert found.normal == pytest.approx(2.0 * weight / np.sqrt(2.0), rel=1e-9)
