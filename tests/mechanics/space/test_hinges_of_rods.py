"""Friction, springs and motors about the axes of hinges that flexible rods carry."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.scene import Scene

AXIS = [0.3, 1.0, 0.4]
BETWEEN = {"first": {"body": "A", "point": "end"}, "second": {"body": "B"}}
LOADS = {
    "spring": {"kind": "torsion-spring", "axis": AXIS, "stiffness": 0.3, "damping": 0.005, "angle": 0.2} | BETWEEN,
    "motor": {"kind": "torque", "at": {"body": "B"}, "reaction": BETWEEN["first"], "axis": AXIS, "torque": 0.2},
}
RUBS = {"friction": 0.03, "coulomb": 0.04}


def chain(kinds: tuple[str, str], *, turned: bool = False, rubs: Any = RUBS, **more: Any) -> Scene:
    """Two rods that hang on each other by hinges with oblique axes; turned: first and second exchanged."""

    def rod(element: str) -> dict[str, Any]:
        stiff = {"element": "rigid", "rotary_inertia": True}
        bends = {"element": element, "elements": 1, "youngs_modulus": 1e15}
        sizes = {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.01, "density": 2700.0}
        return sizes | (stiff if element == "rigid" else bends)

    def hinge(first: Any, second: Any, axis: list[float]) -> dict[str, Any]:
        sides = {"first": second, "second": first} if turned else {"first": first, "second": second}
        return {"kind": "revolute", "axis": axis} | sides | rubs

    return Scene.parse({
        "name": "chain", "dimensions": 3, "gravity": [0.0, -9.81, 0.0],
        "bodies": dict(zip("AB", map(rod, kinds), strict=True)),
        "joints": {"O": hinge({"body": "ground", "point": [0.0, 0.0, 0.0]}, {"body": "A"}, [1.0, 2.0, -1.0]),
                   "P": hinge(BETWEEN["first"], BETWEEN["second"], AXIS)},
        "markers": {"e": {"body": "A", "point": "end"}, "f": {"body": "B", "point": "end"}},
        "initial": {"A": {"rotation": [0.3, -0.2, 0.5]}, "B": {"rotation": [0.1, 0.6, -0.4]}},
        "solver": {"integrator": "radau5", "relative_tolerance": 1e-7, "absolute_tolerance": 1e-8},
    } | more)  # fmt: skip


def moved(scene: Scene) -> Any:
    run = get_engine("gauss").simulate(scene, np.linspace(0.0, 0.1, 5))
    assert run.ok, run.message
    assert run.energy_drift[0] < 1e-6
    return np.concatenate([run.marker("e"), run.marker("f")])


def check_stiff(kinds: tuple[str, str], loads: dict[str, Any], *, turned: bool) -> None:
    """What friction, spring and motor change in the motion, they change to one part in 200: sections turn inertly."""
    rigid = moved(chain(("rigid", "rigid"), loads=loads))
    change = float(np.abs(rigid - moved(chain(("rigid", "rigid"), rubs={}))).max())
    assert change > 1e-3
    assert moved(chain(kinds, turned=turned, loads=loads)) == pytest.approx(rigid, abs=change / 200)


@pytest.mark.slow
@pytest.mark.parametrize("turned", [False, True])
def test_a_stiff_director_rod_at_a_rigid_one_moves_as_that(turned: bool) -> None:
    check_stiff(("rigid", "director-rod"), LOADS, turned=turned)


@pytest.mark.slow
@pytest.mark.parametrize("kinds", [("director-rod", "director-rod"), ("director-rod", "rigid")])
@pytest.mark.parametrize("loads", [{}, LOADS])
def test_stiff_director_rods_move_as_rigid_ones(kinds: tuple[str, str], loads: dict[str, Any]) -> None:
    check_stiff(kinds, loads, turned=True)


@pytest.mark.slow
@pytest.mark.parametrize("turned", [False, True])
def test_a_shaft_that_friction_brakes_about_its_own_axis_runs_down(turned: bool) -> None:
    """A disc at its end turns by w J/c (1 - exp(-c t/J)); the shaft has 1e-4 of its inertia."""
    spin, inertia, friction, times = 3.0, 0.1, 0.5, np.array([0.0, 0.05, 0.1])
    shaft = {"kind": "rod", "length": 0.2, "height": 0.02, "width": 0.02, "density": 2000.0, "youngs_modulus": 2e11,
             "element": "director-rod", "elements": 1}  # fmt: skip
    disc = {"kind": "rigid-body", "mass": 1.0, "inertia": inertia, "named_points": {"rim": [0.0, 1.0, 0.0]}}
    ground, start = {"body": "ground", "point": [0.0, 0.0, 0.0]}, {"body": "shaft"}
    sides = {"first": start, "second": ground} if turned else {"first": ground, "second": start}
    run = get_engine("gauss").simulate(Scene.parse({
        "name": "shaft", "dimensions": 3, "gravity": [0.0, 0.0, 0.0], "bodies": {"shaft": shaft, "disc": disc},
        "joints": {"O": {"kind": "revolute", "axis": [1.0, 0.0, 0.0], "friction": friction} | sides,
                   "W": {"kind": "weld", "first": {"body": "shaft", "point": "end"}, "second": {"body": "disc"}}},
        "markers": {"rim": {"body": "disc", "point": "rim"}},
        "initial": {"shaft": {"spin": [spin, 0.0, 0.0]}, "disc": {"spin": [spin, 0.0, 0.0]}},
        "solver": {"integrator": "radau5", "relative_tolerance": 1e-8, "absolute_tolerance": 1e-9},
    }), times)  # fmt: skip
    assert run.ok, run.message
    turn = spin * inertia / friction * (1 - np.exp(-friction * times / inertia))
    assert np.arctan2(run.marker("rim")[:, 2], run.marker("rim")[:, 1]) == pytest.approx(turn, rel=1e-3)


@pytest.mark.parametrize("first", ["ground", "rod"])
@pytest.mark.parametrize("element", ["ancf-cable", pytest.param("ancf-quintic", marks=pytest.mark.slow)])
def test_a_cable_with_friction_at_its_hinge_moves_as_in_the_plane(element: str, first: str) -> None:
    ground, cable = {"body": "ground", "point": [0.0, 0.0]}, {"body": "R"}
    sides = {"first": ground, "second": cable} if first == "ground" else {"first": cable, "second": ground}
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 2700.0, "youngs_modulus": 1e8,
           "element": element, "elements": 2}  # fmt: skip
    spring = {"kind": "torsion-spring", "stiffness": 2.0, "angle": 0.3} | sides
    data = {"name": "arm", "bodies": {"R": rod}, "joints": {"O": {"kind": "revolute", **sides, **RUBS}},
            "loads": {"K": spring}, "markers": {"e": {"body": "R", "point": "end"}},
            "solver": {"integrator": "dop853"}}  # fmt: skip
    one, other = (get_engine("gauss").simulate(Scene.parse(data | {"dimensions": d}), [0.0, 0.1, 0.2]) for d in (2, 3))
    assert one.ok, one.message
    assert other.ok, other.message
    assert other.marker("e")[:, :2] == pytest.approx(one.marker("e")[:, :2], abs=1e-9)


def test_friction_between_two_cables_is_refused() -> None:
    with pytest.raises(InputError, match=r"joints\.P: turns about an axis, and neither A nor B has a section there"):
        moved(chain(("ancf-cable", "ancf-cable"), joints=_hinged_about_z()))


def _hinged_about_z() -> dict[str, Any]:
    ground = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    return {"O": {"kind": "spherical", "first": ground, "second": {"body": "A"}},
            "P": {"kind": "revolute"} | BETWEEN | RUBS}  # fmt: skip
