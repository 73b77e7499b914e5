"""Tail probabilities against tables and closed forms, at their ends too."""

from __future__ import annotations

import math

import pytest
from shoal.identification.uncertainty.chances import above_chi_square, above_f, chi_square_above, student_above


def test_values_of_the_tables() -> None:
    """Abramowitz and Stegun 1964, tables 26.8 to 26.10."""
    assert chi_square_above(5.0, 0.05) == pytest.approx(11.0705, abs=5e-5)
    assert student_above(10.0, 0.025) == pytest.approx(2.228, abs=5e-4)
    assert above_f(3.0, 20.0, 3.10) == pytest.approx(0.05, abs=1e-4)


@pytest.mark.parametrize("x", [1e-30, 0.1, 2.0, 30.0, 600.0])
def test_chi_square_of_two_degrees_of_freedom_is_exponential(x: float) -> None:
    assert above_chi_square(2.0, x) == pytest.approx(math.exp(-x / 2), rel=1e-12)
    assert chi_square_above(2.0, 0.01) == pytest.approx(-2 * math.log(0.01), rel=1e-12)


def test_the_limits_of_many_degrees_of_freedom() -> None:
    assert student_above(1e9, 0.025) == pytest.approx(math.sqrt(chi_square_above(1.0, 0.05)), rel=1e-8)
    for ratio in (0.5, 1.0, 2.0):
        assert above_f(7.0, 1e9, ratio) == pytest.approx(above_f(7.0, math.inf, ratio), rel=1e-6)


def test_the_ends() -> None:
    assert above_chi_square(5.0, math.inf) == above_chi_square(5.0, 1e300) == 0.0
    assert above_chi_square(5.0, 0.0) == above_chi_square(5.0, -1.0) == above_chi_square(97.0, 5e-324) == 1.0
    assert math.isnan(above_chi_square(5.0, math.nan))
    assert above_f(2.0, 3.0, 0.0) == above_f(2.0, 3.0, math.nan) == 1.0
    assert above_f(1.0, 3.0, 1e-300) == pytest.approx(1.0)
    assert above_f(1.0, 30.5, 1e300) == pytest.approx(0.0, abs=1e-12)
