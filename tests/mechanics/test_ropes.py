"""Ropes and struts: distances that are held from one side only, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

G = 9.81


def masses(places: list[list[float]], rates: list[list[float]], joints: dict[str, Any], **more: Any) -> Scene:
    """Point masses of 1 kg."""
    names = [f"m{k}" for k in range(len(places))]
    start = {n: {"position": x, "velocity": v} for n, x, v in zip(names, places, rates, strict=True)}
    bodies = {name: {"kind": "point-mass", "mass": 1.0} for name in names}
    markers = {name: {"body": name} for name in names}
    data = {"name": "masses", "bodies": bodies, "joints": joints, "markers": markers, "initial": start}
    return Scene.parse(data | more)


def test_a_mass_on_a_rope_flies_and_is_caught_again() -> None:
    """Thrown from below with v^2 = 3.5 g L: slack at 120 degrees, taut again below (elliptic integral, parabola)."""
    rope = {"kind": "distance", "keeps": "at-most", "first": {"body": "ground", "point": [0.0, 0.0]},
            "second": {"body": "m0"}}  # fmt: skip
    scene = masses([[0.0, -1.0]], [[np.sqrt(3.5 * G), 0.0]], {"rope": rope}, gravity=[0.0, -G],
                   solver={"duration": 1.3})  # fmt: skip
    found = simulate(scene, np.array([0.8730252269643094, 1.2640561704671970 + 1e-9, 1.3]))
    assert found.ok, found.message
    first, *others = found.model["events"]
    slack, taut = (event for event in (first, *others) if event["time"] > 0.0)
    assert slack["kind"] == "opens"
    assert slack["time"] == pytest.approx(0.4819942834614219, abs=1e-9)
    assert taut["kind"] == "impact"
    assert taut["time"] == pytest.approx(1.264056170467197, abs=1e-9)
    np.testing.assert_allclose(found.points[0, 0, :, 0], [np.sqrt(3) / 4, 0.5], atol=1e-9)
    np.testing.assert_allclose(found.points[1, 0, :, 0], [0.0, -1.0], atol=1e-7)
    assert found.velocities is not None
    np.testing.assert_allclose(found.velocities[1, 0, :, 0], [-1.107361729517505, 0.0], atol=1e-6)
    assert taut["impulse"] == pytest.approx(5.7540203336449895, abs=1e-8)
    assert np.hypot(*found.points[2, 0, :, 0]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("kept", "gap", "rates"),
    [
        (1.0, 0.0, [-1 / 3, 2 / 3, 2 / 3]),
        (1.0, 1e-6, [0.0, 0.0, 1.0]),
        (0.0, 0.0, [1 / 3, 1 / 3, 1 / 3]),
    ],
)
def test_balls_in_a_row_share_an_impact_as_moreaus_law_says(kept: float, gap: float, rates: list[float]) -> None:
    """Touching at once, by one complementarity problem; a hair apart one after the other."""
    places = [[0.0, 0.0], [0.1 + gap, 0.0], [0.2 + 2 * gap, 0.0]]
    struts = {
        f"s{k}": {"kind": "distance", "keeps": "at-least", "length": 0.1, "restitution": kept,
                  "first": {"body": f"m{k}"}, "second": {"body": f"m{k + 1}"}}
        for k in range(2)
    }  # fmt: skip
    scene = masses(places, [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]], struts, gravity=[0.0, 0.0], solver={"duration": 0.01})
    found = simulate(scene, np.array([0.01]))
    assert found.ok, found.message
    assert found.velocities is not None
    np.testing.assert_allclose(found.velocities[0, :, 0, 0], rates, atol=1e-10)


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "a bar": ({"restitution": 0.5}, "restitution: a bar has none"),
    "a function": ({"keeps": "at-most", "length": "1 + t"}, "length: of what keeps at-most it is a number"),
    "a word": ({"keeps": "mostly"}, "'exactly', 'at-most' or 'at-least', found 'mostly'"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_distance_that_is_none_is_refused_by_name(case: str) -> None:
    field, message = BAD[case]
    rope = {"kind": "distance", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "m0"}, **field}
    with pytest.raises(InputError, match=rf"joints\.rope.*{message}"):
        masses([[0.0, -1.0]], [[0.0, 0.0]], {"rope": rope})


def test_a_start_beyond_a_rope_is_refused_by_name() -> None:
    rope = {"kind": "distance", "keeps": "at-most", "length": 1.0, "first": {"body": "ground", "point": [0.0, 0.0]},
            "second": {"body": "m0"}}  # fmt: skip
    with pytest.raises(
        InputError, match=r"joints\.rope\.keeps: the machine starts beyond this limit, at 2 where it is 1"
    ):
        simulate(masses([[0.0, -2.0]], [[0.0, 0.0]], {"rope": rope}), np.array([1.0]))
