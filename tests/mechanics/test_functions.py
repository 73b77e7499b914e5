"""Piecewise polynomials meet formulas with three derivatives, and tables exactly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from scipy.interpolate import CubicSpline
from shoal.compile.pointers import raw
from shoal.errors import InputError
from shoal.mechanics import fitting, functions
from shoal.scene.function import Function

Array = Any
HORIZON = 10.0
TIMES = np.linspace(0.0, HORIZON, 777)


@njit(cache=True)
def _along(packed, number, times, derivative, out):
    f = raw(packed)
    for k in range(times.size):
        out[k] = functions.evaluate(f, number, times[k], derivative)


def along(fitted: list[functions.Piecewise], number: int, times: Array, derivative: int = 0) -> Array:
    out = np.empty(np.shape(times))
    _along(functions.pack(fitted), number, np.asarray(times, dtype=float), derivative, out)
    return out


SMOOTH: dict[str, list[Callable[[Array], Array]]] = {
    "0.1*sin(3*t)": [
        lambda t: 0.1 * np.sin(3 * t),
        lambda t: 0.3 * np.cos(3 * t),
        lambda t: -0.9 * np.sin(3 * t),
        lambda t: -2.7 * np.cos(3 * t),
    ],
    "exp(-t)": [lambda t: np.exp(-t), lambda t: -np.exp(-t), lambda t: np.exp(-t), lambda t: -np.exp(-t)],
    "t**3/7 - 2*t + 5": [
        lambda t: t**3 / 7 - 2 * t + 5,
        lambda t: 3 * t**2 / 7 - 2,
        lambda t: 6 * t / 7,
        lambda t: np.full_like(t, 6 / 7),
    ],
    "tanh(2*(t - 4))": [
        lambda t: np.tanh(2 * (t - 4)),
        lambda t: 2 / np.cosh(2 * (t - 4)) ** 2,
        lambda t: -8 * np.tanh(2 * (t - 4)) / np.cosh(2 * (t - 4)) ** 2,
        lambda t: 16 * (2 * np.sinh(2 * (t - 4)) ** 2 - 1) / np.cosh(2 * (t - 4)) ** 4,
    ],
}

EXTENDED = np.finfo(np.longdouble).eps < 1e-18


@pytest.mark.parametrize("text", SMOOTH)
def test_smooth_functions_with_three_derivatives(text: str) -> None:
    fitted = fitting.fit(Function(expression=text), HORIZON)
    for derivative, exact in enumerate(SMOOTH[text]):
        expected = exact(TIMES)
        # Machines without extended precision lose digits with every derivative.
        tolerance = (1e-12, 1e-12, 1e-12, 1e-10)[derivative] if EXTENDED else (1e-12, 1e-10, 1e-8, 1e-6)[derivative]
        # What is proven of tanh in short pieces only has the round-off of their coefficients in its derivatives.
        tolerance *= (1.0, 10.0, 1e3, 1e3)[derivative] if "tanh" in text else 1.0
        error = np.abs(along([fitted], 0, TIMES, derivative) - expected).max()
        assert error < tolerance * np.abs(expected).max(), derivative


@pytest.mark.parametrize("smooth", [True, False])
def test_tables_are_exact(smooth: bool) -> None:
    rows = np.array([[0.0, 1.0], [0.3, -1.0], [2.5, 4.0], [2.6, 4.5], [7.0, 0.0]])
    table = Function(table=rows.tolist(), smooth=smooth)
    fitted = fitting.fit(table, HORIZON, table.knots)
    assert fitted.breaks.tolist() == [0.0, 0.3, 2.5, 2.6, 7.0, HORIZON]
    inside = np.minimum(TIMES, 7.0)
    expected = CubicSpline(rows[:, 0], rows[:, 1])(inside) if smooth else np.interp(inside, rows[:, 0], rows[:, 1])
    np.testing.assert_allclose(along([fitted], 0, TIMES), expected, rtol=0, atol=1e-12)
    if smooth:
        curvature = np.where(TIMES < 7.0, CubicSpline(rows[:, 0], rows[:, 1])(TIMES, 2), 0.0)
        np.testing.assert_allclose(along([fitted], 0, TIMES, 2), curvature, rtol=0, atol=1e-9)


def test_jumps_and_kinks_are_sharp() -> None:
    step, kink = (fitting.fit(Function(expression=text), HORIZON) for text in ("step(t - pi)", "abs(t - pi)"))
    near = np.pi + 1e-8 * HORIZON * np.array([-1.0, 1.0])
    assert along([step], 0, near).tolist() == [0.0, 1.0]
    np.testing.assert_allclose(along([kink], 0, TIMES), np.abs(TIMES - np.pi), rtol=0, atol=1e-12)
    assert max(len(step.coefficients), len(kink.coefficients)) < 100


def test_a_jump_at_a_knot_stays_a_jump() -> None:
    fitted = fitting.fit(Function(expression="3*step(t - 2)"), HORIZON, (2.0,))
    assert len(fitted.coefficients) == 2
    assert along([fitted], 0, [np.nextafter(2.0, 0.0), 2.0]).tolist() == [0.0, 3.0]


def test_a_short_pulse_is_seen() -> None:
    fitted = fitting.fit(Function(expression="step(t - 5.001) - step(t - 5.006)"), HORIZON)
    assert along([fitted], 0, [5.0, 5.003, 5.007]).tolist() == [0.0, 1.0, 0.0]


def test_a_removable_gap_is_closed() -> None:
    fitted = fitting.fit(Function(expression="sin(t)/t"), HORIZON)
    assert along([fitted], 0, [0.0])[0] == pytest.approx(1.0, abs=1e-14)


@pytest.mark.compiles  # a tenth of a second: nothing else asks for the distance of an array's function from Python
def test_beyond_the_range_the_ends_hold() -> None:
    fitted = fitting.fit(lambda t: np.cos(t), 2.0, begin=-1.0)
    assert along([fitted], 0, [-5.0, 9.0]) == pytest.approx(np.cos([-1.0, 2.0]), abs=1e-15)
    assert not along([fitted], 0, [-5.0, 9.0], 1).any()
    # Rounding past the end is not beyond it.
    assert along([fitted], 0, [2.0 + 1e-12], 1)[0] == pytest.approx(-np.sin(2.0), abs=1e-11)
    packed = functions.pack([fitted])
    assert [functions.excess(packed, 0, t) for t in (-3.0, 0.5, 2.5)] == [-2.0, 0.0, 0.5]


def test_many_functions_do_not_mix() -> None:
    fitted = [fitting.fit(Function(expression=text), HORIZON) for text in ("t", "step(t - 1)", "7", "cos(t)")]
    for number, exact in enumerate((TIMES, TIMES >= 1.0, np.full_like(TIMES, 7.0), np.cos(TIMES))):
        np.testing.assert_allclose(along(fitted, number, TIMES), exact, rtol=0, atol=1e-13)
    assert not along(fitted, -1, TIMES).any()
    assert not along([], -1, TIMES).any()


def test_antiderivative() -> None:
    fitted = fitting.fit(lambda t: np.sin(t) + abs(t), 3.0, (0.0,), begin=-2.0)
    times = np.linspace(-2.0, 3.0, 101)
    expected = 1 - np.cos(times) + times * np.abs(times) / 2
    np.testing.assert_allclose(along([fitting.antiderivative(fitted)], 0, times), expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("power", [1 / 3, 0.5, 0.2, 0.1, 0.05, 2 / 3, 0.9])
@pytest.mark.by_day(2)
def test_roots_of_a_kink_are_fitted(power: float) -> None:
    rng = np.random.default_rng(int(1000 * power))
    place, begin, factor = rng.uniform(0.1, 0.9), rng.uniform(-1.0, 1.0), rng.uniform(0.5, 3.0)
    text = f"{begin!r} + abs({factor!r}*(t - {place!r}))**{power!r}"
    fitted = fitting.fit(Function(expression=text), 1.0)
    times = np.linspace(0.0, 1.0, 1001)
    expected = begin + np.abs(factor * (times - place)) ** power
    np.testing.assert_allclose(along([fitted], 0, times), expected, rtol=0, atol=1e-11)
    whole = begin + factor**power * ((1.0 - place) ** (power + 1) + place ** (power + 1)) / (power + 1)
    integral = along([fitting.antiderivative(fitted)], 0, np.array([1.0]))
    np.testing.assert_allclose(integral, [whole], rtol=0, atol=1e-11)


@pytest.mark.parametrize("power", [-1 / 3, -0.05])
def test_roots_without_a_bound_are_refused(power: float) -> None:
    with pytest.raises(InputError, match=r"^function: .*pole"):
        fitting.fit(Function(expression=f"abs(t - 0.3)**({power!r})"), 1.0)


@pytest.mark.parametrize("text", ["log(t - 1)", "1/(t - t)", "sin(1e9*t)", "exp(100*t)*exp(100*t)"])
def test_what_cannot_be_fitted_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"^function: "):
        fitting.fit(Function(expression=text), HORIZON)


@pytest.mark.parametrize("end", [0.0, -1.0, np.inf, np.nan])
def test_an_empty_range_is_refused(end: float) -> None:
    with pytest.raises(InputError, match="range"):
        fitting.fit(np.sin, end)


@pytest.mark.slow
@given(st.lists(st.floats(-10, 10), min_size=4, max_size=4), st.floats(1e-3, 1e4))
def test_cubics_are_one_piece(powers: list[float], horizon: float) -> None:
    scaled = [c / horizon**k for k, c in enumerate(powers)]
    fitted = fitting.fit(lambda t: sum(c * t**k for k, c in enumerate(scaled)) + 0 * t, horizon)
    times = np.linspace(0.0, horizon, 9)
    expected = np.polynomial.polynomial.polyval(times, scaled)
    assert len(fitted.coefficients) == 1
    np.testing.assert_allclose(along([fitted], 0, times), expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("function", "derivative"),
    [
        (lambda t: 1 - np.cos(9 * t), lambda t: 9 * np.sin(9 * t)),
        (lambda t: np.exp(t) - 1 - t, lambda t: np.exp(t) - 1),
    ],
)
def test_terms_that_cancel_are_no_reason_to_refuse(function: Any, derivative: Any) -> None:
    fitted = fitting.fit(function, 0.01)
    for t in (0.0013, 0.005, 0.0099):
        assert functions.value(fitted, t) == pytest.approx(float(function(np.longdouble(t))), rel=1e-9)
        assert functions.value(fitted, t, 1) == pytest.approx(float(derivative(np.longdouble(t))), rel=1e-6)
