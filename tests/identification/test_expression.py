"""Expressions are arithmetic and nothing else."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shoal.errors import InputError
from shoal.identification.expression import evaluate, names


def test_value_and_names() -> None:
    text = "(I2 + m2*a2**2) / (I1 - -sqrt(4))"
    assert names(text) == {"I1", "I2", "m2", "a2"}
    assert evaluate(text, {"I1": 1.0, "I2": 2.0, "m2": 3.0, "a2": 2.0}) == pytest.approx(14.0 / 3.0)


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_agrees_with_python(a: float, b: float) -> None:
    assert evaluate("a*b - (a + b)/2", {"a": a, "b": b}) == a * b - (a + b) / 2


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
    ],
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        names(text)


def test_undefined_arithmetic_is_not_a_number() -> None:
    assert math.isnan(evaluate("1/a", {"a": 0.0}))
    with pytest.raises(InputError, match="'b' is not known"):
        evaluate("b", {"a": 0.0})
