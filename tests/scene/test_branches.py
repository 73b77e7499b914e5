"""Jumps and kinks of expressions are found exactly, between them bounds hold, and what has no bound is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shoal.errors import InputError
from shoal.scene.branches import branches
from shoal.scene.enclosure import enclose
from shoal.scene.expression import evaluate_array
from shoal.scene.formula import tree, value


@pytest.mark.parametrize(
    ("text", "end", "expected"),
    [
        ("step(t - 5)", 10.0, [5.0]),
        ("step(t - 7.3) - step(t - 7.35)", 60.0, [7.3, 7.35]),
        ("step(5 - t)*t", 10.0, [5.0]),
        ("step(t)", 10.0, []),
        ("step(t - 10)", 10.0, []),
        ("step(t*(t - 1)*(t - 2))", 5.0, [1.0, 2.0]),
        ("abs(t - 3)**0.5", 5.0, [3.0]),
        ("sqrt(max(t - 1, 0))", 2.0, [1.0]),
        ("ramp((t - 1)/0.5)", 2.0, [1.0, 1.5]),
        ("min(t, 2, 4 - t)", 5.0, [2.0]),
        ("max(t - 1, 0)*step(t - 4)", 5.0, [1.0, 4.0]),
        ("step(sin(50*t))", 1.0, np.pi * np.arange(1, 16) / 50),
        ("step(step(sin(t)) - 0.5)", 10.0, np.pi * np.arange(1, 4)),
        ("step(sin(t)/t)", 10.0, np.pi * np.arange(1, 4)),
        ("step(exp(-t) - 0.5)", 5.0, [np.log(2)]),
        ("step(sin(t)**2)", 10.0, []),
        ("abs(1 - cos(t))", 10.0, []),
        ("step(t - 1e-9)", 10.0, [1e-9]),
        ("max(sin(t), sin(t))", 10.0, []),
        ("tanh(1e6*(t - 3))", 10.0, []),
    ],
)
def test_switches(text: str, end: float, expected: list[float]) -> None:
    found = branches(tree(text), 0.0, end).edges
    assert found[0] == 0.0
    assert found[-1] == end
    np.testing.assert_allclose(found[1:-1], expected, rtol=4e-16, atol=0)


@pytest.mark.parametrize("end", [6.0, 10.0, 20.0, 1.0, 0.7])
def test_a_step_at_half_the_time_is_at_half_the_time(end: float) -> None:
    assert branches(tree(f"step(t - {end}/2)"), 0.0, end).edges[1] == end / 2


@pytest.mark.parametrize(
    "text",
    [
        "ramp(sin(5.062*t))",
        "abs(sin(t) - 1)",
        "min(1, sin(3*t))",
        "max(sin(2*t), 1)",
        "max(cos(7*t), -1)",
        "ramp(1 + cos(4*t))",
        "abs((t - 0.5)**2)",
        "ramp(1 - (2*t - 1)**2)",
    ],
)
@pytest.mark.parametrize("end", [1.0, 1.5, 10.0])
def test_a_switch_that_is_touched_half_way_turns_nothing(text: str, end: float) -> None:
    """The peak of a half period is in its middle."""
    pieces = branches(tree(text), 0.0, end)
    times = np.linspace(0.0, end, 997)[1:-1]
    found = [float(value(pieces.around(t, left=True), t)) for t in times]
    np.testing.assert_allclose(found, evaluate_array(text, {"t": times}), atol=1e-12)


def test_a_root_of_what_is_nowhere_positive_is_refused() -> None:
    with pytest.raises(InputError, match=r"takes sqrt of .* negative"):
        branches(tree("sqrt(sin(t) - 1)"), 0.0, np.pi)


@pytest.mark.parametrize(
    ("text", "end", "why"),
    [
        ("1/(t - 1)", 2.0, r"'1/\(t - 1\)' has a pole: t - 1 is 0 at t = 1;"),
        ("t**-2", 2.0, "pole.* at t = 0"),
        ("tan(t)", 2.0, r"pole: cos\(t\) is 0 at t = 1.5707"),
        ("log(t)", 2.0, "pole: t is 0"),
        ("log(t - 1)", 2.0, "takes log of t - 1, which is negative at t = 0"),
        ("sqrt(1 - t)", 2.0, "takes sqrt of 1 - t, which is negative at t = 1"),
        ("1/sin(t)**2", 4.0, "pole"),
        ("sin(t)/(t - pi)", 4.0, "pole"),
        ("max(1/t, 2)", 4.0, "pole"),
        ("step(sin(1e7*t))", 10.0, "switches too often"),
        ("step(cos(t)*cos(t) - 1)", 10.0, "touches 0"),
        ("1/(t - t)", 1.0, "has no finite value"),
    ],
)
def test_what_cannot_be_bounded_is_refused(text: str, end: float, why: str) -> None:
    with pytest.raises(InputError, match=f"^function: .*{why}") as refusal:
        branches(tree(text), 0.0, end)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "text", ["1/(t + 1)", "sin(t)/t", "(1 - cos(t))/t", "sqrt(t)", "t**1.5", "sqrt(2 - t)", "tan(t/2)"]
)
def test_what_is_bounded_is_not_refused(text: str) -> None:
    assert len(branches(tree(text), 0.0, 2.0).nodes) == 1


_SMOOTH = st.recursive(
    st.sampled_from(["t", "0.3", "2", "pi"]),
    lambda inner: (
        st.builds("({} {} {})".format, inner, st.sampled_from("+-*"), inner)
        | st.builds("{}({})".format, st.sampled_from(["sin", "cos", "tanh", "-"]), inner)
        | st.builds("exp(-({})**2)".format, inner)
        | st.builds("{}/(2 + sin({}))".format, inner, inner)
        | st.builds("({})**{}".format, inner, st.sampled_from(["2", "3"]))
    ),
    max_leaves=6,
)
_SWITCHED = st.recursive(
    _SMOOTH,
    lambda inner: (
        st.builds("{}({})".format, st.sampled_from(["abs", "sign", "step", "ramp"]), inner)
        | st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), inner, inner)
        | st.builds("({} {} {})".format, inner, st.sampled_from("+-*"), inner)
    ),
    max_leaves=4,
)


@settings(max_examples=25)
@given(_SWITCHED, st.integers(0, 2**32 - 1))
def test_pieces_are_the_function(text: str, seed: int) -> None:
    try:
        pieces = branches(tree(text), 0.0, 3.0) if len(text) <= 500 else None
    except InputError as refusal:
        assert "switches too often" in str(refusal) or "touches 0" in str(refusal) or "no finite" in str(refusal)  # noqa: PT017
        return
    if pieces is not None:
        t = np.random.default_rng(seed).uniform(0.0, 3.0, 50)
        expected = np.broadcast_to(evaluate_array(text, {"t": t}), t.shape)
        found = [float(value(pieces.around(at, False), at)) for at in t]
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * (1 + np.abs(expected).max()))


@settings(max_examples=25)
@given(_SMOOTH, st.floats(0.0, 2.0), st.floats(1e-6, 1.0))
def test_bounds_hold(text: str, lower: float, width: float) -> None:
    node = tree(text) if len(text) <= 500 else 0.0
    low, high = enclose(node, np.array([lower]), np.array([lower + width]), 3)
    t = lower + width * np.linspace(0.0, 1.0, 31)
    values = np.broadcast_to(value(node, t.astype(np.longdouble)), t.shape)
    if np.isfinite(low[0, 0]) and np.isfinite(high[0, 0]):
        assert np.all(values >= low[0, 0])
        assert np.all(values <= high[0, 0])
    if np.isfinite(low[1, 0]) and np.isfinite(high[1, 0]):
        slopes = np.diff(values) / np.diff(t.astype(np.longdouble)) * width / 2
        room = 1e-12 * (1 + np.abs(values).max())
        assert np.all(slopes >= low[1, 0] - room)
        assert np.all(slopes <= high[1, 0] + room)
