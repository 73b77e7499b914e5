"""Bounds by polynomials of more terms than runs, and what they are made of, against closed forms."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from shoal.response import regularised, respond
from shoal.response.expansion import fit
from shoal.response.extremes import IntArray, extremes
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval
from shoal.response.polynomials import total_degree
from shoal.response.runs import Answers
from shoal.trajectory import Array

TURNS = np.array([0.9, 0.5, 0.4, 0.3, 0.2, 0.1])
"""By how much each parameter turns the phase to either side [rad]."""


def box(parameters: int) -> Inputs:
    return Inputs(tuple(UncertainParameter(f"x{k}", Interval(-1.0, 1.0), {f"x{k}": 1.0}) for k in range(parameters)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_waves_of_six_parameters_are_bounded_by_few_runs(seed: int) -> None:
    """exp(x0 / 4) cos(phase + shift): the phase goes all the way, of which a sum of degree four misses a hundredth."""
    shifts = np.linspace(0.0, 3.0, 7)

    def model(values: Mapping[str, Array]) -> Answers:
        x = np.stack([values[f"x{k}"] for k in range(6)], axis=1)
        found = np.exp(0.25 * x[:, :1]) * np.cos((x @ TURNS)[:, None] + shifts)
        return Answers(found, np.ones(len(found), dtype=bool))

    answer = respond(model, box(6), 7, instants=np.arange(7.0), groups=np.zeros(7, dtype=int), seed=seed)
    # The first parameter and what the others do together are all there is.
    first, others = np.linspace(-1, 1, 2001)[:, None], np.linspace(-1, 1, 801) * TURNS[1:].sum()
    found, rest = answer.bounds, np.array([0.9 * first + others + shift for shift in shifts])
    true = np.exp(0.25 * first) * np.cos(rest)
    lower, upper = true.min(axis=(1, 2)), true.max(axis=(1, 2))
    width = float((upper - lower).max())
    assert found is not None
    assert math.isinf(found.horizon)
    assert answer.runs.own <= 300
    assert np.all(found.lower - lower <= 1e-4 * width)
    assert np.all(upper - found.upper <= 1e-4 * width)
    assert np.all(found.lower_outer <= lower + 1e-9)
    assert np.all(found.upper_outer >= upper - 1e-9)


def test_the_likelihood_of_several_columns_has_the_slope_that_is_told() -> None:
    inputs, random = box(3), np.random.default_rng(0)
    xi = random.uniform(-1, 1, (40, 3))
    answers = np.stack([np.cos(xi @ [1.0, 0.5, 0.2]), np.exp(xi[:, 1])], axis=1)
    bases, y = regularised._bases(inputs, xi), answers - answers.mean(axis=0)

    def told(x: Array) -> tuple[float, Array]:
        return regularised._unlikely(regularised.Decay(x[:-1].reshape(3, 2), float(x[-1])), bases, y)

    at = np.append(random.uniform(-3, -1, 6), -10.0)
    assert told(at)[1] == pytest.approx(approx_fprime(at, lambda x: told(x)[0], 1e-6), rel=1e-4, abs=1e-3)


def test_runs_that_tell_a_term_nothing_are_said_to() -> None:
    inputs, terms = box(2), total_degree(2, 2)
    xi = np.random.default_rng(1).uniform(-1, 1, (12, 2))
    values = xi[:, :1] ** 2
    assert fit(inputs, xi, values, terms).whole
    xi[:, 1] = 0.5
    assert not fit(inputs, xi, values, terms).whole


def test_a_peak_between_all_that_is_scanned_is_found_from_a_place_near_it() -> None:
    """As one that a run has found before; what is scanned leads to the other peak, which must not be lost either."""

    class Peaks:
        """A broad one in the middle, in one column half as high as the narrow one, in the other higher."""

        def __call__(self, xi: Array) -> Array:
            narrow = np.exp(-((xi - 0.4123) ** 2).sum(axis=1) / 2e-4)
            broad = np.exp(-(xi**2).sum(axis=1))
            return np.stack([0.5 * broad + narrow, 3.0 * broad + narrow], axis=1)

        def each(self, xi: Array, columns: IntArray) -> Array:
            return self(xi)[np.arange(len(xi)), columns]

    near = np.full((1, 4), 0.417)
    assert extremes(Peaks(), 4, 2, rough=True).upper == pytest.approx([0.5, 3.0], abs=1e-6)
    assert extremes(Peaks(), 4, 2, rough=True, known=near).upper == pytest.approx([1.253, 3.0], abs=2e-3)
