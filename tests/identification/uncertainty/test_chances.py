"""Chances by chi-square, F and Student's t, against scipy."""

from __future__ import annotations

import math

import pytest
from scipy import special
from shoal.identification.uncertainty.chances import above_chi_square, above_f, chi_square_above, student_above

FREEDOMS = [0.3, 1.0, 2.0, 7.0, 31.9, 32.1, 97.3, 999.0, 1001.0, 1e4, 1e5]


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_chi_square_is_above_a_number_with_the_chance_that_scipy_tells(freedom: float) -> None:
    for x in [freedom * share for share in (1e-30, 1e-3, 0.1, 0.9, 0.99, 1.0, 1.01, 1.1, 1.3, 4.0, 20.0)]:
        assert above_chi_square(freedom, x) == pytest.approx(special.chdtrc(freedom, x), rel=1e-12, abs=1e-250)


def test_chi_square_is_never_beyond_infinity_and_always_above_nothing() -> None:
    assert above_chi_square(5.0, math.inf) == 0.0
    assert above_chi_square(5.0, 1e300) == 0.0
    assert above_chi_square(5.0, 0.0) == 1.0
    assert above_chi_square(5.0, 5e-324) == above_chi_square(97.0, 5e-324) == 1.0
    assert math.isnan(above_chi_square(5.0, math.nan))


@pytest.mark.parametrize("freedom", [1, 2, 5, 40, 200])
def test_chi_square_is_above_what_scipy_tells_with_a_chance(freedom: int) -> None:
    for chance in (0.3, 0.05, 0.01):
        assert chi_square_above(freedom, chance) == pytest.approx(special.chdtri(freedom, chance), rel=1e-13)


@pytest.mark.parametrize("freedom", [*FREEDOMS, 1e9])
def test_students_t_is_above_what_scipy_tells_with_a_chance(freedom: float) -> None:
    for chance in (0.1, 0.025, 0.005):
        assert student_above(freedom, chance) == pytest.approx(special.stdtrit(freedom, 1.0 - chance), rel=1e-12)


@pytest.mark.parametrize("count", [1, 2, 7, 40])
@pytest.mark.parametrize("freedom", [3.0, 30.5, 1e4])
def test_f_is_that_of_scipy(count: int, freedom: float) -> None:
    for ratio in (1e-300, 1e-20, 0.01, 0.5, 1.0, 2.0, 8.0, 1e300):
        assert above_f(count, freedom, ratio) == pytest.approx(special.fdtrc(count, freedom, ratio), rel=1e-8)
