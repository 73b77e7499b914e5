"""The cheapest model of machines in space, against Exudyn's cables and against vibrations in closed form."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.scene import Scene, load_scene
from shoal.selection import select
from shoal.selection.levels import RIGID
from shoal_validation.problems import get_problem

PENDULUM = load_scene("flexible-spherical-double-pendulum")
EXUDYN = {"A": [0.677293, -0.321390, -0.661664], "B": [1.920270, 0.149686, -2.134790]}
"""Ends of both rods at 0.5 s, by 32 and 64 cables of Exudyn and 8 and 16 quintic elements, +-1e-6 m."""


@pytest.mark.slow
@pytest.mark.parametrize("element", ["ancf-cable", "director-rod", "rigid"])
def test_a_spherical_pendulum_of_rods_keeps_its_word_against_exudyn(element: str) -> None:
    """Whatever element the scene names; a rigid one says that the rods may twist, which these do not."""
    tolerance = 1e-3 if element == "ancf-cable" else 1e-2
    scene = PENDULUM.with_values({f"bodies.{rod}.element": element for rod in ("OA", "AB")})
    found = select(scene, tolerance)
    assert found.met
    assert max(np.linalg.norm(found.trajectory.marker(name)[-1] - at) for name, at in EXUDYN.items()) <= tolerance


H, W, E, RHO = 0.03, 0.02, 2e9, 2700.0
GRAVITY = 0.2


def clamped(**more: Any) -> Scene:
    """A rod of 1 m that sticks out of a wall and is let go under a light gravity across both axes of its section."""
    rod = {"kind": "rod", "length": 1.0, "height": H, "width": W, "density": RHO, "youngs_modulus": E,
           "element": "director-rod"}  # fmt: skip
    return Scene.parse({
        "name": "clamped", "dimensions": 3, "gravity": [0, -GRAVITY, -GRAVITY], "bodies": {"B": rod | more},
        "joints": {"W": {"kind": "weld", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "B"}}},
        "markers": {"e": {"body": "B", "point": "end"}}, "solver": {"duration": 0.2},
    })  # fmt: skip


def let_go(thickness: float, times: Any) -> Any:
    """Deflection of the end of a cantilever let go under its weight, by ten modes of Euler and Bernoulli's beam."""
    roots = [1.8751040687, 4.6940911330, 7.8547574382, 10.9955407349, 14.1371683910]
    roots += [(2 * n - 1) * np.pi / 2 for n in range(6, 11)]
    x = np.linspace(0.0, 1.0, 20_001)
    found = np.zeros_like(times)
    for k in roots:
        ratio = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
        shape = np.cosh(k * x) - np.cos(k * x) - ratio * (np.sinh(k * x) - np.sin(k * x))
        share = np.trapezoid(shape, x) / np.trapezoid(shape**2, x) * shape[-1]
        frequency = k**2 * np.sqrt(E / RHO * thickness**2 / 12)
        found += GRAVITY * share * (1 - np.cos(frequency * times)) / frequency**2
    return found


@pytest.mark.slow
def test_a_flat_rod_vibrates_across_both_axes_within_the_tolerance() -> None:
    tolerance, times = 5e-5, np.linspace(0.02, 0.2, 10)
    found = select(clamped(), tolerance, times)
    assert found.met
    assert found.chosen.levels["B"] != RIGID
    sag = np.stack([let_go(H, times), let_go(W, times)], axis=1)
    assert np.max(sag[:, 1]) > 20 * tolerance
    assert np.max(np.linalg.norm(found.trajectory.marker("e")[:, 1:] + sag, axis=1)) < tolerance


def test_a_rod_whose_bending_is_within_the_tolerance_comes_out_rigid() -> None:
    found = select(clamped(youngs_modulus=2e14), 1e-3)
    assert found.met
    assert set(found.chosen.levels.values()) == {RIGID}


HELIX = {"side_curvature": [12.0], "twist": [4.0], "youngs_modulus": 2e8, "elements": 2}
BENT = {"curvature": [1.0], "side_curvature": [0.5], "twist": [1.0], "youngs_modulus": 2e8}


@pytest.mark.parametrize(
    ("shape", "tolerance", "mesh"),
    [(BENT, 2e-4, 16), pytest.param(HELIX, 2e-4, 64, marks=pytest.mark.slow)],
    ids=["bent", "helix"],
)
def test_a_curved_and_twisted_rod_keeps_its_word_against_exudyns_beams(
    shape: dict[str, Any], tolerance: float, mesh: int
) -> None:
    pytest.importorskip("exudyn")
    scene, times = clamped(**shape), np.linspace(0.02, 0.2, 10)
    found = select(scene, tolerance, times)
    assert found.met
    assert 0 < found.shear < tolerance
    settings = {"bodies.B.elements": mesh, "solver.step": 5e-4, "solver.newton_tolerance": 1e-6}
    exudyn = get_engine("exudyn-ge").simulate(scene.with_values(settings), times).marker("e")
    assert np.max(np.linalg.norm(exudyn - exudyn[0], axis=1)) > 9 * tolerance
    assert np.max(np.linalg.norm(found.trajectory.marker("e") - exudyn, axis=1)) < tolerance


@pytest.mark.parametrize("tolerance", [1e-2, 2e-4])
def test_shear_that_no_rod_in_space_has_counts(tolerance: float) -> None:
    """Let go under its weight, a thick cantilever sags by shear too: Timoshenko (1921), kappa by Cowper (1966)."""
    found = select(clamped(height=0.15, width=0.15, youngs_modulus=2e7), tolerance)
    shear = 2 * np.hypot(GRAVITY, GRAVITY) * RHO / 2 / (10 * 1.3 / (12 + 11 * 0.3) * 2e7 / 2.6)
    assert found.chosen.error <= tolerance
    assert shear / 5 < found.shear < 5 * shear
    assert found.met == found.trajectory.ok == (tolerance == 1e-2)
    assert found.met == ((found.errors.total or 0.0) <= tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_the_swinging_strip_comes_within_the_tolerance_of_exudyns_limit(tolerance: float) -> None:
    problem = get_problem("swinging-strip")
    assert problem.reference is not None
    found = select(load_scene("swinging-strip"), tolerance, problem.times)
    exudyn = np.array(problem.reference.points)
    assert found.met
    assert np.max(np.linalg.norm(found.trajectory.marker("E") - exudyn, axis=1)) < tolerance


def test_a_curved_rod_that_is_too_stiff_or_too_wound_is_told_in_one_line() -> None:
    with pytest.raises(ComputationError, match=r"takes .* element steps.*; state numbers of elements instead"):
        select(clamped(curvature=[100.0], youngs_modulus=2e11), 1e-6)
    with pytest.raises(InputError, match=r"B does by 1e\+03; state its number of elements"):
        select(clamped(curvature=[1000.0]), 1e-3)


def test_a_flat_rod_with_a_head_is_not_called_rigid() -> None:
    """Only a director rod suits it."""
    scene = clamped().model_dump(mode="json", exclude_unset=True)
    scene["bodies"]["H"] = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1}
    scene["joints"]["H"] = {"kind": "weld", "first": {"body": "B", "point": "end"}, "second": {"body": "H"}}
    found = select(Scene.parse(scene | {"gravity": [0, 0, -9.81]}), 1e-2)
    assert found.met
    assert found.chosen.levels["B"].element == "director-rod"


def test_a_flexible_rod_that_no_other_model_suits_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_module("shoal.selection.select"), "fewest", lambda *_: "for a reason")
    with pytest.raises(InputError, match=r"bodies.B.element: no other model can take the place .*: for a reason"):
        select(clamped(), 1e-2)


def headed(place: float) -> Scene:
    """A light round shaft of 0.9 m between two bearings that hold its direction, with a heavy head."""
    ground, end = {"body": "ground"}, {"body": "B", "point": "end"}
    bearings = {
        "left": {"kind": "revolute", "first": ground | {"point": [0, 0, 0]}, "second": {"body": "B"}},
        "right": {"kind": "cylindrical", "first": ground | {"point": [0.9, 0, 0]}, "second": end},
    }
    hub = {"kind": "weld", "first": {"body": "B", "point": [place, 0.0]}, "second": {"body": "H"}}
    rod = {"kind": "rod", "length": 0.9, "height": 0.012, "section": "round", "density": 30.0, "youngs_modulus": 7e10}
    return Scene.parse({
        "name": "headed", "dimensions": 3, "gravity": [0, 0, -9.81],
        "bodies": {"B": rod | {"element": "director-rod"}, "H": {"kind": "rigid-body", "mass": 1.5, "inertia": 1e-5}},
        "joints": {name: joint | {"axis": "x"} for name, joint in bearings.items()} | {"hub": hub},
        "markers": {"H": {"body": "H"}}, "solver": {"duration": 0.05, "samples": 20},
    })  # fmt: skip


@pytest.mark.parametrize(("place", "multiple"), [(0.3, 3), (0.45, 2)])
@pytest.mark.slow
def test_a_rod_that_is_held_between_its_ends_has_a_node_there(place: float, multiple: int) -> None:
    """A mass on a spring of 3 E I L^3 / (a b)^3, which falls by g / w^2 (1 - cos(w t))."""
    tolerance = 2e-5
    found = select(headed(place), tolerance)
    stiffness = 3 * 7e10 * np.pi * 0.012**4 / 64 * 0.9**3 / (place * (0.9 - place)) ** 3
    square = stiffness / 1.5
    fall = 9.81 / square * (1 - np.cos(np.sqrt(square) * found.trajectory.times))
    assert found.met
    assert found.chosen.levels["B"].elements % multiple == 0
    assert np.max(fall) > 50 * tolerance
    assert np.max(np.abs(found.trajectory.marker("H")[:, 2] + fall)) < tolerance


def test_a_rod_that_is_held_where_no_mesh_has_a_node_is_refused() -> None:
    with pytest.raises(InputError, match=r"holds the section .* at 0.37 m.*or state elements instead of a tolerance"):
        select(headed(0.37), 1e-3)
