"""Statics and modes with stops, ropes and struts: obstacle problems, against closed forms and SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize, minimize_scalar
from shoal.errors import ComputationError, InputError
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.mechanics.analysis.going_on import as_stated
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.rest_contacts import RestContacts
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

G = 9.81
GROUND = {"body": "ground", "point": [0.0, 0.0]}
BAR = {"kind": "rod", "length": 1.0, "density": 5000.0, "height": 0.02, "width": 0.02, "element": "rigid"}


def _scene(bodies: dict[str, Any], joints: dict[str, Any], **more: Any) -> Scene:
    markers = {name: {"body": name} for name in bodies}
    return Scene.parse(
        {"name": "s", "gravity": [0.0, -G], "bodies": bodies, "joints": joints, "markers": markers} | more
    )


def _leaning(stop: float, **joint: Any) -> Scene:
    """A bar on a hinge that falls counter-clockwise from the horizontal to -90 degrees, with a stop before."""
    pin = {"first": GROUND, "second": {"body": "A"}, "stops": {"min": stop}} | joint
    return _scene({"A": BAR}, {"O": pin}, initial={"A": {"angle": 0.1}})


def _hung(length: float, keeps: str, y: float = -0.3, **more: Any) -> Scene:
    """A mass of 2 kg on a rope or a strut from the origin, and a second one from (1, 0)."""
    ends = {"a": [0.0, 0.0], "b": [1.0, 0.0]}
    joints = {
        name: {"kind": "distance", "keeps": keeps, "length": length, "first": {"body": "ground", "point": at},
               "second": {"body": "m"}}
        for name, at in ends.items()
    }  # fmt: skip
    return _scene({"m": {"kind": "point-mass", "mass": 2.0}}, joints, initial={"m": {"position": [0.4, y]}}, **more)


def test_a_bar_rests_on_a_stop_with_the_moment_of_its_weight() -> None:
    found = statics(_leaning(-0.7))
    assert found.ok, found.message
    assert found.contacts == {"joints.O.stops.min": pytest.approx(2.0 * G * 0.5 * np.cos(0.7), rel=1e-9)}
    assert found.to_json()["contacts"] == found.contacts


def test_a_stop_that_is_not_reached_does_not_matter() -> None:
    found = statics(_leaning(-2.0))
    assert found.ok
    assert found.contacts == {}
    assert found.angle("A") == pytest.approx(-np.pi / 2, abs=1e-8)


def test_a_mass_hangs_on_two_ropes_and_falls_between_two_struts() -> None:
    taut = statics(_hung(0.8, "at-most"))
    assert taut.ok, taut.message
    height = np.sqrt(0.8**2 - 0.5**2)
    np.testing.assert_allclose(taut.marker("m"), [0.5, -height], atol=1e-9)
    tension = 2.0 * G / 2.0 * 0.8 / height
    assert taut.contacts == {f"joints.{name}.keeps": pytest.approx(tension, rel=1e-9) for name in "ab"}
    assert modes(_hung(0.8, "at-most")).modes == ()
    assert statics(_hung(0.4, "at-least", y=0.6)).status is EquilibriumStatus.UNHELD  # it slides off between them


def test_a_mass_on_one_of_two_ropes_swings_as_a_pendulum() -> None:
    scene = _hung(0.8, "at-most").with_values({"joints.b.length": 3.0})
    found = statics(scene)
    assert found.contacts == {"joints.a.keeps": pytest.approx(2.0 * G, rel=1e-9)}
    (mode,) = modes(scene).modes
    assert mode.angular_frequency == pytest.approx(np.sqrt(G / 0.8), rel=1e-9)


def test_the_lowest_place_of_a_chain_with_a_stop_is_that_of_scipy() -> None:
    """Two bars in a row; the knee may not bend beyond 0.3 rad to one side, under a side force."""
    bodies = {"A": BAR, "B": BAR}
    knee = {"first": {"body": "A", "point": "end"}, "second": {"body": "B"}, "stops": {"max": 0.3, "min": -2.0}}
    force = {"kind": "force", "at": {"body": "B", "point": "end"}, "force": [30.0, 0.0]}
    scene = _scene(bodies, {"O": {"first": GROUND, "second": {"body": "A"}}, "k": knee}, loads={"f": force},
                   initial={"A": {"angle": -1.6}, "B": {"angle": -1.5}})  # fmt: skip
    found = statics(scene)
    assert found.ok, found.message

    def potential(x: Any) -> float:
        a, b = x
        weight = 2.0 * G * (0.5 * np.sin(a)) + 2.0 * G * (np.sin(a) + 0.5 * np.sin(b))
        return float(weight - 30.0 * (np.cos(a) + np.cos(b)))

    other = minimize(potential, [-1.6, -1.5], method="SLSQP", tol=1e-14,
                     constraints={"type": "ineq", "fun": lambda x: 0.3 - (x[1] - x[0])})  # fmt: skip
    np.testing.assert_allclose([found.angle("A"), found.angle("B")], other.x, atol=1e-6)
    b = found.angle("B")
    moment = -(2.0 * G * 0.5 * np.cos(b) + 30.0 * np.sin(b))
    assert found.contacts == {"joints.k.stops.max": pytest.approx(moment, rel=1e-8)}


def test_a_cantilever_on_a_rope_takes_the_load_that_its_stiffness_leaves() -> None:
    """Bent by its end load until the rope is taut: force P - 3 E I w / L^3 of small deflections."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 1e-3, "youngs_modulus": 2e11,
           "element": "ancf-cable", "elements": 8}  # fmt: skip
    rope = {"kind": "distance", "keeps": "at-most", "length": 1.001,
            "first": {"body": "ground", "point": [1.0, 1.0]}, "second": {"body": "A", "point": "end"}}  # fmt: skip
    load = {"kind": "force", "at": {"body": "A", "point": "end"}, "force": [0.0, -50.0]}
    scene = _scene({"A": rod}, {"w": {"kind": "weld", "first": GROUND, "second": {"body": "A"}}, "rope": rope},
                   loads={"P": load}, markers={"T": {"body": "A", "point": "end"}})  # fmt: skip
    found = statics(scene)
    assert found.ok, found.message
    assert found.marker("T")[1] == pytest.approx(-1e-3, abs=1e-8)
    rigidity = 2e11 * 0.02**4 / 12
    assert found.contacts == {"joints.rope.keeps": pytest.approx(50.0 - 3.0 * rigidity * 1e-3, rel=1e-4)}
    propped = modes(scene, count=1).modes[0].angular_frequency  # clamped and pinned
    wanted = 3.9266023120479**2 * np.sqrt(rigidity / (1e-3 * 4e-4))
    assert propped == pytest.approx(wanted, rel=2e-3)


def test_a_contact_that_only_touches_has_no_modes() -> None:
    scene = _leaning(-np.pi / 2)
    assert statics(scene).contacts == {"joints.O.stops.min": 0.0}
    with pytest.raises(ComputationError, match=r"joints\.O\.stops\.min touches without a force"):
        modes(scene)


def test_a_run_begins_where_the_machine_rests_on_its_stop() -> None:
    found = simulate(_leaning(-0.7).with_values({"initial.from": "statics"}), np.array([0.5]))
    assert found.ok, found.message
    assert found.angles[0, 0, 0] == pytest.approx(-0.7, abs=1e-12)


def test_loads_that_follow_are_refused_with_stops() -> None:
    load = {"kind": "force", "at": {"body": "A", "point": "end"}, "force": [0.0, -1.0], "follows": True}
    scene = Scene.parse(_leaning(-0.7).model_dump(exclude_unset=True) | {"loads": {"f": load}})
    with pytest.raises(InputError, match=r"joints\.O\.stops: statics takes one-sided constraints where the loads"):
        statics(scene)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_gaps_have_the_derivatives_of_differences(dimensions: int) -> None:
    axis = {"axis": [0.0, 0.0, 1.0]} if dimensions == 3 else {}
    point = [0.3, 0.2, 0.1][:dimensions]
    joints = {
        "O": {"first": GROUND | {"point": [0.0] * dimensions}, "second": {"body": "A"}, "stops": {"min": -2.0}} | axis,
        "r": {"kind": "distance", "keeps": "at-most", "length": 3.0,
              "first": {"body": "ground", "point": point}, "second": {"body": "A", "point": "end"}},
    }  # fmt: skip
    scene = _scene({"A": BAR}, joints, initial={"A": {"angle": 0.3}}, dimensions=dimensions,
                   gravity=[0.0, -G, 0.0][:dimensions])  # fmt: skip
    evaluator = as_stated(scene)
    contacts = RestContacts(evaluator)
    q, rng = evaluator.model.q0[:, 0], np.random.default_rng(0)
    way, step = rng.normal(size=len(q)), 1e-5
    values, rows = contacts.at(q)
    (before, rows_before), (after, rows_after) = (contacts.at(q + sign * step * way) for sign in (-1.0, 1.0))
    assert values[1] == pytest.approx(
        3.0 - np.linalg.norm(np.array([np.cos(0.3), np.sin(0.3), 0.0])[:dimensions] - point)
    )
    np.testing.assert_allclose(rows @ way, (after - before) / (2 * step), atol=1e-9)
    for number in range(2):
        bent = contacts.curvature(q, np.array([number]), np.array([1.7]))
        slope = (rows_after - rows_before)[[number]].toarray()[0] / (2 * step)
        np.testing.assert_allclose(bent @ way, 1.7 * slope, atol=1e-8)


def _ball(**second: Any) -> Scene:
    """A disc of 2 kg on its centre's spring to the side, and a surface."""
    disc = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.01}
    contact = {
        "floor": {"first": {"body": "A", "radius": 0.1}, "second": {"body": "ground", "point": [0.0, 0.0]} | second}
    }
    spring = {"kind": "spring", "first": {"body": "ground", "point": [-2.0, 0.2]}, "second": {"body": "A"},
              "stiffness": 50.0, "length": 2.0}  # fmt: skip
    turn = {"kind": "torsion-spring", "first": GROUND, "second": {"body": "A"}, "stiffness": 1.0}
    return _scene({"A": disc}, {}, loads={"s": spring, "t": turn}, contacts=contact,
                  initial={"A": {"position": [0.0, 0.3]}})  # fmt: skip


def test_a_disc_rests_on_a_line_and_in_a_hole() -> None:
    flat = statics(_ball(line=0.0))
    assert flat.ok, flat.message
    assert flat.marker("A")[1] == pytest.approx(0.1, abs=1e-12)
    x = flat.marker("A")[0] + 2.0
    length = np.hypot(x, 0.1)
    pull = 50.0 * (length - 2.0) / length
    assert flat.contacts == {"contacts.floor": pytest.approx(2.0 * G - pull * 0.1, rel=1e-8)}
    hole = statics(_ball(hole=0.6))
    place = hole.marker("A")
    assert hole.ok, hole.message
    assert np.hypot(*place) == pytest.approx(0.5, abs=1e-12)

    def potential(angle: float) -> float:
        at = 0.5 * np.array([np.cos(angle), np.sin(angle)])
        return float(2.0 * G * at[1] + 25.0 * (np.hypot(*(at - [-2.0, 0.2])) - 2.0) ** 2)

    best = minimize_scalar(potential, bounds=(-np.pi, 0.0), method="bounded", options={"xatol": 1e-12}).x
    assert np.arctan2(place[1], place[0]) == pytest.approx(best, abs=1e-7)


def test_contacts_that_give_way_are_refused_by_name() -> None:
    law = {"stiffness": 1e6, "exponent": 1.5}
    scene = _ball(line=0.0).with_values({"contacts.floor.law": law})
    with pytest.raises(InputError, match=r"contacts\.floor\.law: equilibria and modes take rigid contacts"):
        statics(scene)
