"""Sums of products of polynomials: every way to ask for them tells what numpy's own series do."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import hermite_e, legendre
from scipy.special import factorial
from shoal.response.expansion import Expansion
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval, Normal
from shoal.response.polynomials import total_degree

MIXED = {"a": Interval(1.0, 2.0), "b": Normal(0.0, 1.0), "c": Interval(-1.0, 1.0)}


def _alone(kind: object, xi: np.ndarray, degree: int) -> np.ndarray:
    """Orthonormal, by numpy."""
    one = np.eye(degree + 1)[degree]
    if isinstance(kind, Interval):
        return np.sqrt(2 * degree + 1) * legendre.legval(xi, one)
    return hermite_e.hermeval(xi, one) / np.sqrt(factorial(degree))


@pytest.mark.parametrize("names", ["a", "b", "ac", "abc", "bab"])
def test_products_are_those_of_numpys_series(names: str) -> None:
    kinds = [MIXED[name] for name in names]
    inputs = Inputs(tuple(UncertainParameter(f"p{k}", kind, {f"p{k}": 1.0}) for k, kind in enumerate(kinds)))
    terms = total_degree(len(kinds), 3)
    random = np.random.default_rng(1)
    xi, coefficients = random.uniform(-1, 1, (50, len(kinds))), random.normal(size=(len(terms), 4))
    due = np.array(
        [np.prod([_alone(kind, xi[:, k], term[k]) for k, kind in enumerate(kinds)], axis=0) for term in terms]
    )
    found = Expansion(inputs, terms, coefficients, np.zeros(4))
    columns = random.integers(0, 4, 50)
    assert inputs.basis(xi, terms) == pytest.approx(due.T, abs=1e-12)
    assert found(xi) == pytest.approx(due.T @ coefficients, abs=1e-12)
    assert found.each(xi, columns) == pytest.approx((due.T @ coefficients)[np.arange(50), columns], abs=1e-12)


def test_a_constant_has_no_polynomials() -> None:
    inputs = Inputs((UncertainParameter("p", MIXED["a"], {"p": 1.0}),))
    found = Expansion(inputs, total_degree(1, 0), np.array([[2.0, 3.0]]), np.zeros(2))
    xi = np.linspace(-1, 1, 5)[:, None]
    assert found(xi).tolist() == [[2.0, 3.0]] * 5
    assert found.each(xi, np.array([0, 1, 0, 1, 0])).tolist() == [2.0, 3.0, 2.0, 3.0, 2.0]
