"""How welded bodies are turned at the start: in space as in the plane, and never otherwise than the scene states."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene


def angled(dimensions: int, angles: dict[str, float | None], welds: tuple[Any, Any], foot: str) -> Scene:
    """Two bars that a small body in their corner joins; angles [rad] that are stated, those that the welds keep."""
    bar = {"kind": "rod", "length": 1.0, "height": 0.06, "width": 0.06, "density": 7850.0}
    corner = {"kind": "rigid-body", "mass": 0.1, "inertia": 1e-3, "named_points": {"p": [1.0, 0.0]}}
    ends = ({"body": "a", "point": "end"}, {"body": "corner"}, {"body": "b"})
    joints: dict[str, Any] = {
        f"W{k}": {"kind": "weld", "first": ends[k], "second": ends[k + 1]} | ({} if angle is None else {"angle": angle})
        for k, angle in enumerate(welds)
    }
    joints["foot"] = {"kind": foot, "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "a"}}
    return Scene.parse({
        "name": "angled", "dimensions": dimensions, "gravity": [0.0, 0.0],
        "bodies": {"a": bar, "b": bar, "corner": corner}, "joints": joints,
        "markers": {"tip": {"body": "b", "point": "end"}, "p": {"body": "corner", "point": "p"}},
        "initial": {name: {"angle": angle} for name, angle in angles.items() if angle is not None},
    })  # fmt: skip


def begin(scene: Scene) -> Any:
    """Where the markers start [m], or None for a scene that is refused."""
    try:
        found = simulate(scene, np.array([0.0]))
    except InputError:
        return None
    assert found.ok
    return found.points[0, :, :2, 0]


@pytest.mark.parametrize("foot", ["weld", "revolute"])
@pytest.mark.by_day(1)
def test_welded_bodies_start_in_space_as_in_the_plane(foot: str) -> None:
    refused = 0
    for a, b, corner in itertools.product((None, 0.3), (None, 1.0), (None, 0.5)):
        for welds in ((None, None), (0.2, None), (None, 0.2)):
            plane, space = (
                begin(angled(dimensions, {"a": a, "b": b, "corner": corner}, welds, foot)) for dimensions in (2, 3)
            )
            assert (plane is None) == (space is None)
            refused += plane is None
            assert plane is None or space == pytest.approx(plane, abs=1e-12)
    assert refused == 2


@pytest.mark.parametrize(
    ("foot", "start", "message"),
    [
        ("weld", {"b": {"spin": [0.0, 0.0, 1.0]}}, r"initial\.b\.spin"),
        *(
            (foot, start, message)
            for foot in ("weld", "spherical")
            for start, message in (
                ({"b": {"rotation": [0, 0.3, 0]}, "corner": {"rotation": [0, 0, 0]}}, r"initial\.\w+\.rotation"),
                ({"a": {"spin": [0, 0, 0]}, "b": {"spin": [0, 0, 1]}}, r"initial\.\w+\.spin"),
            )
        ),
    ],
)
def test_what_a_scene_states_against_its_welds_is_refused(foot: str, start: Any, message: str) -> None:
    scene = angled(3, {}, (None, 0.2), foot).model_dump(mode="json", exclude_unset=True)
    with pytest.raises(InputError, match=message):
        simulate(Scene.parse(scene | {"initial": start}), np.array([0.0]))


def test_a_bracket_held_more_than_once_stays_and_its_joints_bear_its_weight() -> None:
    """Welds, balls and hinges at random places of one body: forces and moments about the origin balance its weight."""
    rng = np.random.default_rng(20)
    for _ in range(6):
        centre, gravity = rng.normal(size=3), rng.normal(size=3)
        places = [[0.0, 0.0, 0.0], *rng.normal(size=(int(rng.integers(1, 4)), 3)).tolist()]
        kinds = ["weld", *rng.choice(["weld", "spherical", "revolute"], len(places) - 1)]
        scene = Scene.parse({
            "name": "bracket", "dimensions": 3, "gravity": gravity.tolist(),
            "bodies": {"b": {"kind": "rigid-body", "mass": 2.0, "inertia": 0.01, "centre_of_mass": centre.tolist()}},
            "joints": {
                f"J{k}": {"kind": kind, "first": {"body": "ground", "point": place},
                          "second": {"body": "b", "point": place}}
                for k, (kind, place) in enumerate(zip(kinds, places, strict=True))
            },
            "markers": {"m": {"body": "b", "point": centre.tolist()}},
            "initial": {"b": {"rotation": [0.0, 0.0, 0.0]}},
        })  # fmt: skip
        found = simulate(scene, np.array([0.1]))
        assert found.ok, found.message
        assert found.points[0, 0, :, 0] == pytest.approx(centre, abs=1e-12)
        assert set(found.model["redundant_joints"]) >= {f"J{k}" for k in range(1, len(places))}
        (state,) = reactions(scene, [0.1])
        borne = [(np.array(state.joints[f"J{k}"].force), np.array(state.joints[f"J{k}"].torque), np.array(place))
                 for k, place in enumerate(places)]  # fmt: skip
        assert sum(force for force, _, _ in borne) == pytest.approx(-2.0 * gravity, abs=1e-9)
        moment = sum(torque + np.cross(place, force) for force, torque, place in borne)
        assert moment == pytest.approx(-2.0 * np.cross(centre, gravity), abs=1e-9)
