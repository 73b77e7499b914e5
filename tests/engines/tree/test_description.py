"""What a description accepts, and in which words it refuses."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from shoal.engines.tree.articulated import accelerate
from shoal.engines.tree.description import SpatialChain
from shoal.engines.tree.tree import build, room
from shoal.errors import InputError

GOOD: dict[str, Any] = {
    "name": "good",
    "bodies": {
        "A": {"mass": 1.0, "inertia": [1, 2, 2.5]},
        "B": {"mass": 1.0, "inertia": [[1, 0.1, 0], [0.1, 1, 0], [0, 0, 1.5]]},
    },
    "joints": {
        "O": {"kind": "spherical", "body": "A"},
        "P": {"kind": "revolute", "body": "B", "parent": "A", "axis": [0, 1, 1]},
    },
    "points": {"tip": {"body": "B", "position": [1, 0, 0]}},
    "loads": {"L": {"body": "A", "force": [1, 0, 0]}},
    "initial": {"O": {"coordinate": [0.1, 0, 0]}, "P": {"rate": 2}},
}


def _with(path: str, value: Any) -> dict[str, Any]:
    data = copy.deepcopy(GOOD)
    *parents, leaf = path.split(".")
    place = data
    for part in parents:
        place = place[part]
    place[leaf] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "match"),
    [
        ("joints.P.parent", "C", r"joints\.P\.parent: no body 'C'; there are A, B"),
        ("joints.P.body", "C", r"joints\.P\.body: no body 'C'"),
        ("joints.P.body", "A", r"joints\.P\.body: A hangs on O already"),
        ("joints.O.parent", "B", r"bodies\.A: no chain of joints connects it to the ground"),
        ("joints.P.parent", "B", r"bodies\.B: no chain of joints"),
        ("joints.P.axis", [0, 0, 0], r"joints\.P: axis is zero"),
        ("joints.P.axis", None, r"joints\.P: axis is missing"),
        ("joints.O.axis", [0, 0, 1], r"joints\.O: axis: a spherical joint has none"),
        ("joints.P.load", [1, 2, 3], r"joints\.P: load: a revolute joint takes 1, found 3"),
        ("joints.P.damping", -1, r"joints\.P\.damping"),
        ("joints.P.kind", "screw", r"joints\.P\.kind"),
        ("joints.P.on_body", {"rotation": [90, 0, 0]}, r"joints\.P\.on_body\.rotation\.0: an angle is in radians"),
        ("bodies.A.mass", 0, r"bodies\.A\.mass.*greater than 0"),
        ("bodies.A.mass", float("nan"), r"bodies\.A\.mass"),
        ("bodies.A.inertia", [1, 1, 2.5], r"bodies\.A\.inertia: no body has the principal moments 1, 1, 2.5"),
        ("bodies.A.inertia", [0, 1, 1], r"bodies\.A\.inertia: an inertia is positive definite"),
        ("bodies.A.inertia", [[1, 2, 0], [2, 1, 0], [0, 0, 1]], r"bodies\.A\.inertia: an inertia is positive definite"),
        ("bodies.A.inertia", [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], r"bodies\.A\.inertia: an inertia is a symmetric"),
        ("bodies.A.inertia", [[1, 0], [0, 1]], r"bodies\.A\.inertia"),
        ("bodies.A.colour", "red", r"bodies\.A\.colour"),
        ("bodies.ground", {"mass": 1, "inertia": [1, 1, 1]}, r"bodies\.ground: the name"),
        ("points.tip.body", "ground", r"points\.tip\.body: no body 'ground'"),
        ("loads.L.body", "C", r"loads\.L\.body: no body 'C'"),
        ("initial.Q", {}, r"initial\.Q: no such joint"),
        ("initial.O.coordinate", 1.0, r"initial\.O\.coordinate: a spherical joint takes 3, found 1"),
        ("initial.P.rate", "fast", r"initial\.P\.rate"),
        ("bodies", {}, r"bodies"),
    ],
)
def test_bad_input_is_refused_in_one_line(path: str, value: Any, match: str) -> None:
    with pytest.raises(InputError, match=match) as refusal:
        SpatialChain.parse(_with(path, value))
    assert "\n" not in str(refusal.value)


def test_good_input_and_its_json_agree() -> None:
    chain = SpatialChain.parse(GOOD)
    assert SpatialChain.model_validate_json(chain.model_dump_json()) == chain


def _refusal(data: Any) -> str:
    try:
        SpatialChain.parse(data)
    except InputError as error:
        return str(error)
    return ""


values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@given(
    st.sampled_from(
        (
            *("bodies", "bodies.A", "bodies.A.inertia", "bodies.A.mass", "points", "loads", "gravity"),
            *("joints", "joints.P", "joints.P.axis", "joints.P.load", "joints.P.on_body", "joints.O.kind"),
            *("initial", "initial.P.rate"),
        )
    ),
    values,
)
def test_anything_else_is_refused_or_understood(path: str, value: Any) -> None:
    data = _with(path, value)
    refusal = _refusal(data)
    assert "\n" not in refusal
    assert refusal or np.all(np.isfinite(build(SpatialChain.parse(data)).tree.turn))


moments = st.floats(1e-6, 1e6)


@given(moments, moments, st.floats(0.0, 1.0), st.tuples(*[st.floats(-3, 3)] * 3))
def test_every_inertia_of_a_body_is_accepted(a: float, b: float, share: float, turn: Any) -> None:
    """Moments of a set of mass points satisfy the triangle inequality in any axes."""
    small, large = sorted((a, b))
    third = (large - small) * 1.0 + share * 2 * small
    if not third > 1e-9 * large:
        return
    axes = Rotation.from_rotvec(turn).as_matrix()
    matrix = axes @ np.diag([a, b, third]) @ axes.T
    data = _with("bodies.A.inertia", ((matrix + matrix.T) / 2).tolist())
    if min(a, b, third) > 1e-12 * max(a, b, third):
        SpatialChain.parse(data)


@given(st.floats(1e-150, 1e150), st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: max(map(abs, a)) > 1e-3))
def test_the_length_of_an_axis_means_nothing(length: float, direction: Any) -> None:
    def qddot(axis: list[float]) -> Any:
        model = build(SpatialChain.parse(_with("joints.P.axis", axis)))
        out = np.zeros(len(model.v0))
        accelerate(model.tree, room(model.tree), model.q0, model.v0, out)
        return out

    np.testing.assert_allclose(qddot([length * a for a in direction]), qddot(list(direction)), atol=1e-9)
