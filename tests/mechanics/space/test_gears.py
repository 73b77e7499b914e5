"""Gears in space against closed forms and Exudyn: bevel gears, a planet, a differential, torques, many turns."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.integrators import INTEGRATORS
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

ROOT: dict[str, Any] = {"body": "ground", "point": [0.0, 0.0, 0.0]}
AWAY: dict[str, Any] = {"body": "ground", "point": [1.0, 0.0, 0.0]}
OBLIQUE = [0.0, 1.0, 1.0]
FLAT = {"kind": "gear", "first": {"body": "OA"}, "second": {"body": "AB"}, "ratio": 1, "second_axis": [1.0, 0.0, 0.0]}
LONG_TO_COMPILE = ("radau5", "implicit-gauss", "energy-momentum", "semi-implicit-euler")
"""No other test of machines in space with constraints takes them."""


def wheel(inertia: float) -> dict[str, Any]:
    return {"kind": "rigid-body", "mass": 1.0, "inertia": [inertia] * 3}


def bevel(ratio: Any, **fields: Any) -> Scene:
    """A wheel about x and one about an oblique axis, a torque on the first."""
    return Scene.parse(
        {
            "name": "bevel",
            "dimensions": 3,
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"one": wheel(0.02), "two": wheel(0.5)},
            "joints": {
                "A": {"first": ROOT, "second": {"body": "one"}, "axis": [1.0, 0.0, 0.0]},
                "B": {"first": AWAY, "second": {"body": "two"}, "axis": OBLIQUE},
                "mesh": {"kind": "gear", "first": {"body": "one"}, "second": {"body": "two"}, "ratio": ratio,
                         "axis": [1.0, 0.0, 0.0], "second_axis": OBLIQUE},
            },
            "loads": {"motor": {"kind": "torque", "at": {"body": "one"}, "torque": 0.3, "axis": [1.0, 0.0, 0.0]}},
            "markers": {"one": {"body": "one", "point": [0.0, 0.1, 0.0]},
                        "two": {"body": "two", "point": [0.1, 0.0, 0.0]}},
            "solver": {"duration": 2.0, "samples": 20},
        }
        | fields
    )  # fmt: skip


def rims(angle: Array, ratio: float) -> tuple[Array, Array]:
    """Where both markers are when the first wheel has turned so far."""
    other, across = ratio * angle, np.cross(np.array(OBLIQUE) / np.sqrt(2.0), [1.0, 0.0, 0.0])
    one = 0.1 * np.stack([0.0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    two = np.array([1.0, 0.0, 0.0]) + 0.1 * (np.outer(np.cos(other), [1.0, 0.0, 0.0]) + np.outer(np.sin(other), across))
    return one, two


@pytest.mark.parametrize(
    "integrator",
    [
        pytest.param(name, marks=[pytest.mark.slow] * (name in LONG_TO_COMPILE))
        for name in INTEGRATORS
        if name != "auto"
    ],
)
@pytest.mark.by_day(2)
def test_bevel_gears_turn_by_their_teeth_and_with_the_inertia_of_both(integrator: str) -> None:
    """phi_1 = t^2/2 T/(I_1 + r^2 I_2), phi_2 = r phi_1, each about its axis."""
    ratio = -17 / 40
    scene = bevel("-17/40", solver={"duration": 0.5, "samples": 5, "integrator": integrator, "step": 1e-3})
    run = get_engine("gauss").simulate(scene)
    assert run.ok, run.message
    one, two = rims(run.times**2 / 2 * 0.3 / (0.02 + ratio**2 * 0.5), ratio)
    slack = {"semi-implicit-euler": 1.5e-4, "implicit-gauss": 1.5e-4}.get(integrator, 1e-7)
    assert run.marker("one") == pytest.approx(one, abs=slack)
    assert run.marker("two") == pytest.approx(two, abs=slack)


@pytest.mark.slow
def test_a_run_of_many_turns_is_verified_and_exudyn_goes_the_same_way() -> None:
    scene = bevel("1/40", solver={"duration": 8.0, "samples": 8})
    run = verified(get_engine("gauss"), scene)
    assert run.ok, run.message
    turned = run.times**2 / 2 * 0.3 / (0.02 + 0.025**2 * 0.5)
    assert turned[-1] > 70 * 2 * np.pi
    one, two = rims(turned, 0.025)
    assert run.marker("one") == pytest.approx(one, abs=1e-8)
    assert run.marker("two") == pytest.approx(two, abs=1e-8)
    pytest.importorskip("exudyn")
    short = bevel("-17/40")
    other, mine = (get_engine(name).simulate(short) for name in ("exudyn", "gauss"))
    assert other.ok, other.message
    assert other.distance(mine) < 1e-6


def test_torques_are_as_the_teeth() -> None:
    """The wheels accelerate each other: the second by I_2 r phi_1'', the first by what is left of the motor."""
    ratio, (state,) = -0.425, reactions(bevel("-17/40"), [0.1])
    assert state.unbalanced < 1e-9
    bend = 0.3 / (0.02 + ratio**2 * 0.5)
    along = np.array(OBLIQUE) / np.sqrt(2.0)
    assert state.joints["mesh"].torque == pytest.approx(0.5 * ratio * bend * along, abs=1e-9)
    assert state.redundancy == 0


def carried(joints: dict[str, Any], inertia: float) -> Scene:
    """Wheels one and two and an arm that turn about an oblique axis; a torque on the arm."""
    return Scene.parse(
        {
            "name": "carried",
            "dimensions": 3,
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"arm": wheel(0.1), "one": wheel(inertia), "two": wheel(0.03)},
            "joints": {"A": {"first": ROOT, "second": {"body": "arm"}, "axis": OBLIQUE},
                       "B": {"first": ROOT, "second": {"body": "one"}, "axis": OBLIQUE}} | joints,
            "loads": {"motor": {"kind": "torque", "at": {"body": "arm"}, "torque": 0.2, "axis": OBLIQUE}},
            "markers": {name: {"body": name, "point": [1.0, 0.0, 0.0]} for name in ("arm", "one", "two")},
            "solver": {"duration": 2.0, "samples": 10},
        }
    )  # fmt: skip


def angles(points: Array, centre: Array) -> Array:
    """By which a marker has turned about the oblique axis, which began 1 m ahead along x."""
    across = np.cross(np.array(OBLIQUE) / np.sqrt(2.0), [1.0, 0.0, 0.0])
    away = points - centre
    return np.unwrap(np.concatenate([[0.0], np.arctan2(away @ across, away[:, 0])]))[1:]


def test_a_planet_rolls_inside_its_ring() -> None:
    """A fixed ring of 60 teeth and a planet of 20 at 0.4 m on the arm: it turns by -2 of the arm's angle."""
    pin = {"body": "arm", "point": [0.4, 0.0, 0.0]}
    joints = {"C": {"first": pin, "second": {"body": "two"}, "axis": OBLIQUE},
              "teeth": {"kind": "gear", "first": ROOT, "second": {"body": "two"}, "ratio": 3.0, "axis": OBLIQUE,
                        "carrier": {"body": "arm"}}}  # fmt: skip
    run = verified(get_engine("gauss"), carried(joints, 0.2))
    assert run.ok, run.message
    turned = run.times**2 / 2 * 0.2 / (0.1 + 1.0 * 0.4**2 + 0.03 * 2.0**2)
    assert angles(run.marker("arm"), np.zeros(3)) == pytest.approx(turned, abs=1e-8)
    assert angles(run.marker("two"), 0.4 * run.marker("arm")) == pytest.approx(-2.0 * turned, abs=1e-8)


def test_a_differential_shares_its_cage() -> None:
    """Seen from the cage both wheels turn against each other, so that their mean is its own turn."""
    joints = {"C": {"first": ROOT, "second": {"body": "two"}, "axis": OBLIQUE},
              "spiders": {"kind": "gear", "first": {"body": "one"}, "second": {"body": "two"}, "ratio": -1,
                          "axis": OBLIQUE, "carrier": {"body": "arm"}}}  # fmt: skip
    run = verified(get_engine("gauss"), carried(joints, 0.05))
    assert run.ok, run.message
    # With equal torques t on the wheels: I phi'' = t each, and the cage has T - 2 t and the mean of both.
    push = 0.2 / (0.1 * (1 / 0.05 + 1 / 0.03) / 2 + 2)
    for name, inertia in (("one", 0.05), ("two", 0.03)):
        found = angles(run.marker(name), np.zeros(3))
        assert found == pytest.approx(run.times**2 / 2 * push / inertia, abs=1e-8)


def test_a_stated_rate_turns_both() -> None:
    run = get_engine("gauss").simulate(bevel("-1/2", loads={}, initial={"one": {"spin": [3.0, 0.0, 0.0]}}))
    assert run.marker("two") == pytest.approx(rims(3.0 * run.times, -0.5)[1], abs=1e-9)
    wrong = {"one": {"spin": [3.0, 0.0, 0.0]}, "two": {"spin": [0.0, 1.0, 1.0]}}
    with pytest.raises(InputError, match=r"initial\.two\.spin: contradicts the joints and the other rates"):
        get_engine("gauss").simulate(bevel("-1/2", initial=wrong))


def test_lanes_are_singles() -> None:
    torques = np.array([0.1, 0.3, 0.7])
    singles = [get_engine("gauss").simulate(bevel(-1.5).with_values({"bodies.two.mass": t})) for t in torques]
    lanes = get_engine("gauss").simulate_many(bevel(-1.5), {"bodies.two.mass": torques})
    assert lanes.points == pytest.approx(np.concatenate([one.points for one in singles], axis=-1), abs=1e-9)


def test_what_is_no_gear_is_refused_in_one_line() -> None:
    free = {"A": {"kind": "spherical", "first": ROOT, "second": {"body": "one"}}}
    told = bevel(2).model_dump(mode="json", exclude_none=True)
    with pytest.raises(InputError, match=r"joints\.mesh: one does not turn about an axis at rest, \(1, 0, 0\) at the"):
        get_engine("gauss").simulate(Scene.parse(told | {"joints": told["joints"] | free}))
    with pytest.raises(InputError, match=r"joints\.mesh: carrier: gears whose axes differ are carried by the ground"):
        bevel(2).with_values({"joints.mesh.carrier.body": "two"})
    flat = load_scene("rigid-double-pendulum").model_dump(mode="json", exclude_none=True)
    with pytest.raises(InputError, match=r"joints\.mesh\.second_axis: this is for scenes in space"):
        Scene.parse(flat | {"joints": flat["joints"] | {"mesh": FLAT}})
