"""Expressions are arithmetic and nothing else."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shoal.errors import InputError
from shoal.scene.expression import evaluate, evaluate_array, names


def test_value_and_names() -> None:
    text = "(I2 + m2*a2**2) / (I1 - -sqrt(4))"
    assert names(text) == {"I1", "I2", "m2", "a2"}
    assert evaluate(text, {"I1": 1.0, "I2": 2.0, "m2": 3.0, "a2": 2.0}) == pytest.approx(14.0 / 3.0)


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_agrees_with_python(a: float, b: float) -> None:
    assert evaluate("a*b - (a + b)/2", {"a": a, "b": b}) == a * b - (a + b) / 2


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("pi*e", lambda t: np.full_like(t, math.pi * math.e)),
        ("sin(t) + cos(t)*tan(t)", lambda t: np.sin(t) + np.cos(t) * np.tan(t)),
        ("sqrt(abs(t)) + exp(t) - tanh(t)", lambda t: np.sqrt(np.abs(t)) + np.exp(t) - np.tanh(t)),
        ("log(t)", lambda t: np.where(t > 0, np.log(np.where(t > 0, t, 1.0)), np.nan)),
        ("max(0, min(t, 1, 2*t))", lambda t: np.clip(np.minimum(t, 2 * t), 0, 1)),
        ("step(t)", lambda t: (t >= 0).astype(float)),
        ("ramp(t)", lambda t: np.where(t < 0, 0, np.where(t > 1, 1, t**3 * (6 * t**2 - 15 * t + 10)))),
        ("-t**2", lambda t: -(t**2)),
        ("(-8)**(1/3)", lambda t: np.full_like(t, np.nan)),
    ],
)
def test_arrays(text: str, expected: Any) -> None:
    t = np.linspace(-2.0, 2.0, 41)
    value = np.broadcast_to(evaluate_array(text, {"t": t}), t.shape)
    np.testing.assert_allclose(value, expected(t), rtol=1e-13, atol=1e-15)


def test_a_parameter_may_be_called_e() -> None:
    assert names("e*t") == {"t"}
    assert evaluate("e*t", {"e": 2.0, "t": 3.0}) == 6.0


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os')",
        "a.b",
        "a[0]",
        "lambda: 1",
        "1 if a else 2",
        "a; b",
        "open(a)",
        "'x'",
        "a := 1",
        "1 +",
        "a" * 600,
        "True",
        "1j",
        "a < b",
        "a % 2",
        "a // 2",
        "not a",
        "~a",
        "sin()",
        "sin(a, b)",
        "max(a)",
        "sin(*a)",
        "sin(x=a)",
        "sin(a)(b)",
        "(sin)(a, b)",
        "9" * 400,
        "1e999",
        "-" * 400 + "a",
        "(" * 250 + "a" + ")" * 250,
        "a**" * 150 + "a",
        "\x00",
        "\ud800",
        "",
    ],
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(InputError) as caught:
        names(text)
    assert "\n" not in str(caught.value)


def test_undefined_arithmetic_is_not_a_number() -> None:
    assert math.isnan(evaluate("1/a", {"a": 0.0}))
    assert math.isnan(evaluate("a**0.5", {"a": -1.0}))
    assert math.isnan(evaluate("exp(a)", {"a": 1e4}))
    assert math.isnan(evaluate("9**9**9**9", {}))
    with pytest.raises(InputError, match="'b' is not known"):
        evaluate("b", {"a": 0.0})


_PIECES = st.sampled_from([
    "t", "a", "1", "0", "9e307", ".5", "pi", "sin", "max", "step", "log", "lambda", "if", "for", "_", "__class__",
    "(", ")", "[", "]", "+", "-", "*", "**", "/", "%", ",", ".", "=", ":", ";", "'", '"', "\\", "@", "f'", "\n", " ",
])  # fmt: skip


@given(st.lists(_PIECES, max_size=60).map("".join) | st.text(max_size=600))
def test_any_text_is_a_number_or_refused(text: str) -> None:
    try:
        value = evaluate(text, {"t": 1.5})
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert math.isnan(value) or math.isfinite(value)


_FORMULAS = st.recursive(
    st.sampled_from(["t", "pi", "2", "0.5", "1e300", "0"]),
    lambda inner: (
        st.builds("({}{}{})".format, inner, st.sampled_from(["+", "-", "*", "/", "**"]), inner)
        | st.builds("{}({})".format, st.sampled_from(["sin", "exp", "log", "sqrt", "tanh", "step", "abs", "-"]), inner)
        | st.builds("max({}, {})".format, inner, inner)
    ),
    max_leaves=20,
)


@given(_FORMULAS)
def test_any_formula_has_values_of_the_right_shape(text: str) -> None:
    if len(text) <= 500:
        value = evaluate_array(text, {"t": np.linspace(-1.0, 1.0, 7)})
        assert value.shape in ((), (7,))
        assert np.all(np.isnan(value) | np.isfinite(value))
