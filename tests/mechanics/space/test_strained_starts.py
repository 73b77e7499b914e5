"""Starts from statics where joints hold elastic rods elsewhere than unstrained: strings, buckled strips, bent ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shoal
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipk
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene
from shoal.scene.sections import Rectangle

WAY = (0.4, -0.7, 1.1)
E, H, W, NU = 2e11, 2e-3, 2e-2, 0.3


def between(apart: float, element: str, kind: str, **section: Any) -> Scene:
    """A rod of one metre between two joints on the ground that are so far apart, in a direction of its own."""
    start, way = np.array([0.2, -0.1, 0.3]), Rotation.from_rotvec(WAY).apply([1.0, 0.0, 0.0])
    ends = {"a": (start, "start"), "b": (start + apart * way, "end")}
    joints = {
        name: {"kind": kind, "first": {"body": "ground", "point": place.tolist()},
               "second": {"body": "rod", "point": end}}
        for name, (place, end) in ends.items()
    }  # fmt: skip
    rod = {"kind": "rod", "length": 1.0, "density": 7800.0, "youngs_modulus": E, "element": element,
           "elements": 8 if element == "ancf-quintic" else 16} | section  # fmt: skip
    return Scene.parse({
        "name": "between", "dimensions": 3, "gravity": [0.0, 0.0, 0.0], "bodies": {"rod": rod}, "joints": joints,
        "markers": {"start": {"body": "rod"}, "middle": {"body": "rod", "point": [0.5, 0.0, 0.0]}},
        "initial": {"from": "statics", "rod": {"rotation": list(WAY)}},
        "solver": {"duration": 2e-3, "samples": 4, "integrator": "generalized-alpha", "step": 1e-5},
    })  # fmt: skip


def height(scene: Scene) -> float:
    """How far the middle is off the line between the ends."""
    found = statics(scene)
    assert found.balanced, found.message
    across = Rotation.from_rotvec(WAY).inv().apply(found.marker("middle") - found.marker("start"))
    return float(np.hypot(*across[1:]))


def elastica(chord: float) -> float:
    """Height of a pressed rod over its length, clamped or pinned: k/K with the chord 2 E/K - 1."""
    k = brentq(lambda k: 2 * ellipe(k * k) / ellipk(k * k) - 1 - chord, 1e-3, 0.99)
    return float(k / ellipk(k * k))


@pytest.mark.parametrize("element", ["ancf-cable", "ancf-quintic", "director-rod"])
@pytest.mark.parametrize("kind", ["spherical", "weld"])
def test_a_wire_that_joints_stretch_has_the_tension_of_its_strain(element: str, kind: str) -> None:
    scene = between(1.002, element, kind, section="round", height=1e-3)
    force = np.array(statics(scene).reactions.joints["b"].force)
    tension = E * np.pi * 1e-6 / 4 * 0.002
    assert Rotation.from_rotvec(WAY).inv().apply(force) == pytest.approx([tension, 0.0, 0.0], abs=1e-8 * tension)


@pytest.mark.parametrize("element", ["ancf-cable", "ancf-quintic", "director-rod"])
@pytest.mark.parametrize("kind", ["spherical", "weld"])
@pytest.mark.parametrize("chord", [0.98, 0.85])
@pytest.mark.by_day(2)
def test_a_wire_that_joints_press_is_an_elastica(element: str, kind: str, chord: float) -> None:
    scene = between(chord, element, kind, section="round", height=1e-3)
    assert height(scene) == pytest.approx(elastica(chord), rel=4e-3)


@pytest.mark.slow
def test_a_buckled_strip_stays_where_it_starts() -> None:
    """It bends about its softer axis, to the side of its positive y."""
    scene = between(0.9, "director-rod", "weld", height=H, width=W)
    assert height(scene) == pytest.approx(elastica(0.9), rel=1e-3)
    run = get_engine("gauss").simulate(scene)
    assert run.ok, run.message
    assert run.marker("middle") == pytest.approx(np.tile(run.marker("middle")[0], (len(run.times), 1)), abs=1e-9)
    assert run.marker("middle")[0] == pytest.approx(statics(scene).marker("middle"), abs=1e-12)


def test_a_round_wire_that_may_bulge_anywhere_is_refused_as_a_start() -> None:
    with pytest.raises(InputError, match=r"initial\.from: statics finds no stable place of rest: nothing holds rod"):
        shoal.simulate(between(0.98, "ancf-quintic", "weld", section="round", height=1e-3), verify=False)


@pytest.mark.parametrize(
    ("load", "instead"),
    [({"kind": "spring", "stiffness": 1.0}, "length"),
     ({"kind": "torsion-spring", "stiffness": 1.0, "axis": [0.0, 0.0, 1.0]}, "angle")],
)  # fmt: skip
def test_a_spring_that_takes_its_rest_from_a_start_that_does_not_fit_is_refused(load: Any, instead: str) -> None:
    sides = {"first": {"body": "ground", "point": [0.0, 0.0, 0.0]}, "second": {"body": "rod", "point": "end"}}
    scene = between(1.002, "director-rod", "weld", section="round", height=1e-3)
    data = scene.model_dump(mode="json", exclude_unset=True) | {"initial": {"rod": {"rotation": list(WAY)}}}
    data |= {"loads": {"K": load | sides}, "initial_from": "statics"}
    with pytest.raises(
        InputError, match=rf"loads\.K: takes a number from the start.*fit their joints; state its `{instead}`"
    ):
        statics(Scene.parse(data))


def welded(turn: Any, place: Any, elements: int) -> Scene:
    """A strip from the ground to a block that the ground holds, turned and displaced."""
    strip = {"kind": "rod", "length": 1.0, "height": H, "width": W, "density": 7800.0, "youngs_modulus": E,
             "poisson_ratio": NU, "element": "director-rod", "elements": elements}  # fmt: skip
    ground = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    return Scene.parse({
        "name": "welded", "dimensions": 3, "gravity": [0.0, 0.0, 0.0],
        "bodies": {"strip": strip, "block": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01}},
        "joints": {
            "foot": {"kind": "weld", "first": ground, "second": {"body": "strip"}},
            "held": {"kind": "weld", "first": {"body": "ground", "point": place}, "second": {"body": "block"}},
            "top": {"kind": "weld", "first": {"body": "block"}, "second": {"body": "strip", "point": "end"},
                    "angle": 0.0},
        },
        "markers": {"middle": {"body": "strip", "point": [0.5, 0.0, 0.0]}},
        "initial": {"from": "statics", "strip": {"rotation": [0.0, 0.0, 0.0]}, "block": {"rotation": turn}},
    })  # fmt: skip


def by_shooting(turn: Any, place: Any, foot: Any) -> Any:
    """The middle of Kirchhoff's rod with the force and the moment at its foot, near those given, that meet the end."""
    shear = E / (2 * (1 + NU))
    stiffness = np.array([shear * float(Rectangle(H, W).torsion), E * H * W**3 / 12, E * W * H**3 / 12])

    def at(s: float, load: Any) -> Any:
        force = load[:3]

        def rate(_: float, y: Any) -> Any:
            d = y[3:12].reshape(3, 3)
            x, up, z = d.T @ y[12:] / stiffness
            along = (1 + force @ d[:, 0] / (E * H * W)) * d[:, 0]
            spin = np.array([[0, -z, up], [z, 0, -x], [-up, x, 0]])
            return np.concatenate([along, (d @ spin).ravel(), np.cross(force, along)])

        start = np.concatenate([np.zeros(3), np.eye(3).ravel(), load[3:]])
        return solve_ivp(rate, (0.0, s), start, "DOP853", rtol=1e-10, atol=1e-11).y[:, -1]

    def miss(load: Any) -> Any:
        y = at(1.0, load)
        off = Rotation.from_matrix(Rotation.from_rotvec(turn).as_matrix().T @ y[3:12].reshape(3, 3))
        return np.concatenate([y[:3] - place, off.as_rotvec()])

    found = root(miss, foot, tol=1e-9)
    assert found.success, found.message
    assert found.x == pytest.approx(foot, rel=0.2, abs=0.1 * np.max(np.abs(foot)))
    return at(0.5, found.x)[:3]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turn", "place"),
    [
        ([0.8, -0.6, 0.9], [0.6, 0.4, 0.3]),
        pytest.param([2.0, 0.0, 0.0], [0.97, 0.05, 0.02], marks=pytest.mark.slow),
    ],
)
def test_a_strip_welded_out_of_its_plane_is_kirchhoffs_rod(turn: Any, place: Any) -> None:
    found = [statics(welded(turn, place, elements)) for elements in (8, 16)]
    assert all(one.ok for one in found), [one.message for one in found]
    foot = found[1].reactions.joints["foot"]
    exact = by_shooting(turn, place, -np.array([*foot.force, *foot.torque]))
    coarse, fine = (float(np.linalg.norm(one.marker("middle") - exact)) for one in found)
    assert fine < 2e-3
    assert fine < coarse / 2.5
