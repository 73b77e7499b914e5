"""Machines in space that rounded numbers lock; exact ones move as in the plane, and near a singular place they may."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

BAR = {"kind": "rigid-body", "mass": 1.0, "inertia": [0.08, 0.08, 0.001], "centre_of_mass": [0.0, 0.0, 0.25]}
COUPLER = {"kind": "rigid-body", "mass": 1.0, "inertia": [0.001, 0.08, 0.08], "centre_of_mass": [0.5, 0.0, 0.0]}


def four_bar(off: float, lean: float = 0.0, spin: float = 2.0, across: float = 0.5) -> Scene:
    """Two cranks of 0.5 m and a coupler of 1 m on hinges along y, but for the coupler's, which is off by an angle."""
    ground = [{"body": "ground", "point": [x, 0.0, 0.0]} for x in (0.0, 2 * across)]
    c, s = math.cos(lean), math.sin(lean)
    return Scene.parse({
        "name": "four-bar", "dimensions": 3, "gravity": [0.0, 0.0, -9.81],
        "bodies": {"a": BAR, "b": COUPLER, "c": BAR},
        "joints": {
            "A": {"first": ground[0], "second": {"body": "a"}, "axis": "y"},
            "B": {"first": {"body": "a", "point": [0.0, 0.0, 0.5]}, "second": {"body": "b"},
                  "axis": [0.0, math.cos(off), math.sin(off)]},
            "C": {"first": ground[1], "second": {"body": "c"}, "axis": "y"},
            "D": {"kind": "spherical", "first": {"body": "b", "point": [1.0, 0.0, 0.0]},
                  "second": {"body": "c", "point": [0.0, 0.0, 0.5]}},
        },
        "markers": {"B": {"body": "a", "point": [0.0, 0.0, 0.5]}},
        "initial": {"a": {"rotation": [0.0, lean, 0.0], "spin": [0.0, spin, 0.0]},
                    "b": {"position": [0.5 * s, 0.0, 0.5 * c], "rotation": [0.0, 0.0, 0.0]},
                    "c": {"rotation": [0.0, lean, 0.0]}},
        "solver": {"integrator": "dop853", "duration": 0.2},
    })  # fmt: skip


def cart(off: float) -> Scene:
    """A body that may turn about x and slide along a rail, which is at a right angle to x but for an angle."""
    at: dict[str, Any] = {"first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "b"}}
    return Scene.parse({
        "name": "cart", "dimensions": 3, "gravity": [0.0, 0.0, -9.81],
        "bodies": {"b": {**BAR, "centre_of_mass": [0.0, 0.0, 0.0]}},
        "joints": {"plane": {"kind": "planar", **at, "axis": "x", "rotation": "axis"},
                   "rail": {"kind": "slider", **at, "axis": [math.sin(off), math.cos(off), 1.0], "rotation": "free"}},
        "markers": {"b": {"body": "b"}}, "initial": {"b": {"rotation": [0, 0, 0], "position": [0, 0, 0]}},
    })  # fmt: skip


@pytest.mark.parametrize("off", [1e-8, 3.7e-6, 1e-4])
@pytest.mark.parametrize("spin", [2.0, 0.0])
def test_a_linkage_that_rounding_locks_is_refused_with_its_joints(off: float, spin: float) -> None:
    """It was at rest and called right, and a stated spin of 2 rad/s was taken for a rounded 0."""
    with pytest.raises(InputError, match=r"joints\.[ABCD]: with .* forbids a motion by .* state them with more digits"):
        simulate(four_bar(off, 0.3, spin), np.array([0.1]))


@pytest.mark.parametrize("off", [3e-7, 1e-5])
def test_a_rail_that_rounding_locks_is_refused(off: float) -> None:
    with pytest.raises(InputError, match=r"joints\.plane: .*forbids a motion"):
        simulate(cart(off), np.array([0.1]))


def test_exact_ones_move() -> None:
    """The rail lets fall along y + z: half of the weight's acceleration along each."""
    fallen = simulate(cart(0.0), np.array([0.4]))
    assert fallen.ok, fallen.message
    np.testing.assert_allclose(fallen.marker("b")[0], [0.0, -0.25 * 9.81 * 0.16, -0.25 * 9.81 * 0.16], atol=1e-9)
    turned = simulate(four_bar(0.0, 0.3), np.array([0.2]))
    assert turned.ok, turned.message
    # Cranks of equal angle: (2 (0.08 + 0.25^2) + 0.5^2) angle'' = (2 * 0.25 + 0.5) g sin(angle).
    assert turned.marker("B")[0, 0] == pytest.approx(0.5 * math.sin(pendulum(0.3, 2.0, 0.2)), abs=1e-7)


@pytest.mark.parametrize("lean", [np.pi / 2 - 1e-4, np.pi / 2 - 1e-6, np.pi / 2 - 3.7e-6, np.pi / 2])
def test_near_a_singular_place_it_is_no_rounding(lean: float) -> None:
    """All bars of the parallelogram on one line: there rows nearly depend on others as well."""
    run = simulate(four_bar(0.0, lean, spin=-3.0), np.array([0.1]))
    assert run.ok, run.message
    assert run.marker("B")[0, 0] == pytest.approx(0.5 * math.sin(pendulum(lean, -3.0, 0.1)), abs=1e-6)


@pytest.mark.parametrize("lever", [math.pi * 1e-4, math.e * 3e-4])
def test_a_short_lever_told_to_all_digits_is_no_rounding(lever: float) -> None:
    """Two places of a body that far apart run along two lines along x: 3 freedoms, and all falls along x."""
    ground = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    beside = {"body": "ground", "point": [0.0, -lever * math.cos(0.7), -lever * math.sin(0.7)]}
    place = {"body": "b", "point": [0.0, -lever * math.cos(0.7), -lever * math.sin(0.7)]}
    body = {**BAR, "centre_of_mass": [0.0, 0.0, 0.0]}
    still = {"rotation": [0, 0, 0], "position": [0, 0, 0]}
    short = Scene.parse({
        "name": "short", "dimensions": 3, "gravity": [9.81, 0.0, 0.0], "bodies": {"a": body, "b": body},
        "joints": {"tube": {"kind": "cylindrical", "first": ground, "second": {"body": "a"}, "axis": "x"},
                   "ball": {"kind": "spherical", "first": {"body": "a"}, "second": {"body": "b"}},
                   "rail": {"kind": "slider", "first": beside, "second": place, "axis": "x", "rotation": "free"}},
        "markers": {"b": {"body": "b"}}, "initial": {"a": still, "b": still},
    })  # fmt: skip
    run = simulate(short, np.array([0.4]))
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("b")[0], [0.5 * 9.81 * 0.16, 0.0, 0.0], atol=1e-9)


def test_the_same_angle_told_by_three_digits_is_one() -> None:
    """0.001 may be 0; sin(0.001) is as it stands."""
    exact = four_bar(0.001, 0.3, 0.0)
    rounded = exact.with_values({"joints.B.axis": [0.0, 1.0, 0.001]})
    with pytest.raises(InputError, match=r"joints\.[ABCD]: .* forbids a motion"):
        simulate(rounded, np.array([0.1]))
    simulate(exact, np.array([0.1]))


def pendulum(angle: float, rate: float, end: float) -> float:
    """The angle of both cranks, by scipy."""
    from scipy.integrate import solve_ivp

    inertia, weight = 2 * (0.08 + 0.25**2) + 0.5**2, (2 * 0.25 + 0.5) * 9.81
    found = solve_ivp(
        lambda t, y: [y[1], weight / inertia * np.sin(y[0])], (0, end), [angle, rate], "DOP853", rtol=1e-11, atol=1e-12
    )
    return float(found.y[0, -1])
