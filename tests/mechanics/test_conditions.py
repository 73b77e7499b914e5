"""Conditions of joints: their terms against finite differences, and one that the library does not know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from shoal.mechanics.assembly.placement import place
from shoal.mechanics.assembly.space.placement import place_in_space
from shoal.mechanics.assembly.space.rigid_bodies import SpatialBodies
from shoal.mechanics.joints import CONDITIONS, JointCondition
from shoal.mechanics.start.closure import Closure, Poses
from shoal.mechanics.term_values import TermValues
from shoal.scene import Attachment, Resisted, Scene

BODY: dict[str, Any] = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1}
SOLID = BODY | {"inertia": [0.1, 0.2, 0.25]}
PLANAR: dict[str, dict[str, Any]] = {
    "revolute": {},
    "weld": {"angle": 0.3},
    "slider": {"direction": 0.4, "rotation": "locked"},
    "distance": {"length": 0.7},
    "parallel": {},
    "perpendicular": {},
    "driven-angle": {"angle": "0.2 + 0.3*sin(t)"},
    "gear": {"ratio": "-3/2"},
    "coupling": {},
}
TERMS = [{"at": {"body": "a", "point": [0.1, 0.2]}, "axis": "x"}, {"at": {"body": "b"}, "axis": "y", "factor": -0.5}]


def two_bodies(kind: str, **fields: Any) -> dict[str, Any]:
    sides = {"first": {"body": "a", "point": [0.3, -0.1]}, "second": {"body": "b", "point": [-0.2, 0.4]}}
    joint = {"terms": TERMS, "value": "0.1*t"} if kind == "coupling" else sides
    return {
        "name": "two",
        "bodies": {"a": BODY, "b": BODY},
        "joints": {"J": {"kind": kind, **joint, **fields}},
        "initial": {"a": {"position": [0.0, 0.0], "angle": 0.2}, "b": {"position": [1.0, 0.4], "angle": -0.5}},
        "markers": {"m": {"body": "b"}},
    }


@pytest.mark.parametrize("kind", PLANAR)
def test_the_jacobian_of_a_closure_is_its_derivative(kind: str) -> None:
    scene = Scene.parse(two_bodies(kind, **PLANAR[kind]), kind)
    random, h = np.random.default_rng(0), 1e-6
    begin = random.uniform(-0.7, 0.7, (4, 6))
    closure = Closure(scene, begin + 0.05)
    rows = closure.rows(begin)
    assert rows.gap.shape[1] >= 1
    for k, step in enumerate(h * np.eye(6)):
        slope = (closure.rows(begin + step).gap - closure.rows(begin - step).gap) / (2 * h)
        assert rows.slope[:, :, k] == pytest.approx(slope, abs=1e-8)
    v = random.normal(size=(4, 6))
    assert rows.along(v) == pytest.approx(np.einsum("lri,li->lr", rows.slope, v), abs=1e-12)
    for lane in range(4):
        alone = closure.of_lanes(np.array([lane])).rows(begin[lane : lane + 1])
        assert alone.gap[0] == pytest.approx(rows.gap[lane], abs=1e-15)


def test_terms_in_space_have_the_derivatives_of_their_values() -> None:
    sides = {"first": {"body": "a", "point": [0.3, -0.1, 0.2]}, "second": {"body": "b", "point": [-0.2, 0.4, 0.1]}}
    joints = {
        "revolute": {"kind": "revolute", "axis": [0.3, 1.0, 0.2], **sides},
        "universal": {"kind": "universal", "axis": [1, 0, 0], "second_axis": [0, 1, 0], **sides},
        "planar": {"kind": "planar", "axis": [0.1, 0.2, 1.0], **sides},
        "slider": {"kind": "slider", "axis": [1.0, 0.5, 0.2], **sides},
        "distance": {"kind": "distance", "length": 0.6, **sides},
        "gear": {"kind": "gear", "ratio": "-1/2", **sides},
    }
    hinges = {
        f"hinge-{name}": {"first": {"body": "ground", "point": [x, 0, 0]}, "second": {"body": name}}
        for name, x in (("a", 0.0), ("b", 1.0))
    }
    random, h = np.random.default_rng(1), 1e-6
    for name, joint in joints.items():
        scene = Scene.parse({
            "name": name, "dimensions": 3, "bodies": {"a": SOLID, "b": SOLID},
            "joints": {"J": joint, **(hinges if name == "gear" else {})},
            "initial": {} if name == "gear" else {"a": {"position": [0, 0, 0]}, "b": {"position": [1, 0.4, 0]}},
            "markers": {"m": {"body": "b"}},
        })  # fmt: skip
        found = place_in_space(scene)
        values = TermValues(found.terms.held, 3)
        q = np.array([np.ravel(one)[0] for one in found.positions]) + random.uniform(-0.1, 0.1, len(found.positions))
        slope = np.stack(
            [(values.at((q + s)[None])[0] - values.at((q - s)[None])[0])[0] for s in h * np.eye(len(q))], 1
        )
        assert values.jacobian(q[None])[0] == pytest.approx(slope / (2 * h), abs=1e-8)


SPATIAL_KINDS: dict[str, dict[str, Any]] = {
    "revolute": {"axis": [0.3, 1.0, 0.2]},
    "spherical": {},
    "universal": {"axis": [1, 0, 0], "second_axis": [0, 1, 0]},
    "cylindrical": {"axis": [1.0, 0.5, 0.2]},
    "planar": {"axis": [0.1, 0.2, 1.0], "rotation": "locked"},
    "weld": {},
    "slider": {"axis": [1.0, 0.5, 0.2], "rotation": "locked"},
    "distance": {"length": 0.6},
    "parallel": {},
    "perpendicular": {},
    "driven-angle": {"angle": "0.2 + 0.3*sin(t)", "axis": [0.3, 1.0, 0.2]},
    "gear": {"ratio": "-1/2"},
}


@pytest.mark.parametrize("kind", SPATIAL_KINDS)
def test_a_closure_in_space_has_the_derivatives_of_small_turns(kind: str) -> None:
    sides = {"first": {"body": "a", "point": [0.3, -0.1, 0.2]}, "second": {"body": "b", "point": [-0.2, 0.4, 0.1]}}
    scene = Scene.parse({
        "name": kind, "dimensions": 3, "bodies": {"a": SOLID, "b": SOLID},
        "joints": {"J": {"kind": kind, **sides, **SPATIAL_KINDS[kind]}}, "markers": {"m": {"body": "b"}},
        "initial": {"a": {"position": [0, 0, 0]}, "b": {"position": [1, 0.4, 0]}},
    })  # fmt: skip
    random, h = np.random.default_rng(2), 1e-6
    none = np.zeros((1, 3, 3))
    begin = Poses(none + 0.0, np.broadcast_to(np.eye(3), (1, 3, 3, 3)), none[..., 0])
    poses = begin.moved(random.uniform(-0.3, 0.3, (1, 2, 6)))
    closure = Closure(scene, poses, bodies=SpatialBodies(scene))
    slope = np.stack([
        (closure.rows(poses.moved(step)).gap - closure.rows(poses.moved(-step)).gap)[0] / (2 * h)
        for step in h * np.eye(12).reshape(12, 1, 2, 6)
    ], 1)  # fmt: skip
    assert slope.shape[0] >= 1
    assert closure.rows(poses).slope[0] == pytest.approx(slope, abs=1e-8)


class Midway(Resisted):
    """The second place stays equally far from the first one and from the ground's origin."""

    kind: Literal["midway"] = "midway"
    turned: ClassVar[tuple[str, ...]] = ()
    first: Attachment = Attachment(body="a", point=(0.3, -0.1))
    second: Attachment = Attachment(body="b", point=(0.4, 0.2))
    friction: float = 0.0


@dataclass(frozen=True)
class EquallyFar(JointCondition):
    first: Attachment
    second: Attachment

    def constrain(self, name: str, bodies: Any) -> None:
        first, there = (bodies.point(bodies.scene, side) for side in (self.first, self.second))
        bodies.terms.dot(name, first, first - there * 2.0, 2)


def test_a_start_keeps_a_condition_that_states_nothing_but_its_terms(monkeypatch: pytest.MonkeyPatch) -> None:
    """|p - a|^2 = |p|^2, which is a . (a - 2 p) = 0."""
    monkeypatch.setitem(CONDITIONS, Midway, lambda joint: [EquallyFar(joint.first, joint.second)])
    scene = Scene.parse(two_bodies("revolute"), "two")
    free = {name: one.model_copy(update={"rate": 0.7}) for name, one in scene.initial.items() if name == "a"}
    stated = scene.model_copy(update={"joints": {"J": Midway()}, "initial": {**scene.initial, **free}})
    stated.initial["b"] = stated.initial["b"].model_copy(update={"guess": ("position", "angle")})
    found = place(stated)
    assert not np.any(found.failed)
    assert [one.name for one in found.terms.held].count("J") == 1
    placed = [found.point(found.scene, side) for side in (Midway().first, Midway().second)]
    (a, va), (p, vp) = (found.start_of(one) for one in placed)
    assert np.sum((p - a) ** 2) == pytest.approx(np.sum(p**2), abs=1e-11)
    assert np.sum((p - a) * (vp - va)) == pytest.approx(np.sum(p * vp), abs=1e-9)
    assert np.max(np.abs(va)) > 0.01
