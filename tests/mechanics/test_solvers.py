"""Damped Newton and Levenberg-Marquardt methods: roots and minima are those of scipy, and failures say why."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.optimize import least_squares
from shoal.mechanics.numerics.levenberg_marquardt import levenberg_marquardt
from shoal.mechanics.numerics.newton import DIVERGES, SINGULAR, newton
from shoal.mechanics.numerics.tile import Array, Index


def of_circle(radius: float, x: Array) -> tuple[Array, float]:
    """Newton's correction for the crossing of a circle with the line y = 2 x."""
    residual = np.array([x @ x - radius**2, x[1] - 2 * x[0]])
    step = -np.linalg.solve(np.array([2 * x, [-2.0, 1.0]]), residual)
    return step, float(np.max(np.abs(step)))


def test_a_root_is_found_to_round_off_in_few_steps() -> None:
    found = newton(partial(of_circle, 5.0), np.array([3.0, 1.0]), close=1e-10)
    assert found.converged
    assert found.iterations <= 7
    assert np.allclose(found.point, np.sqrt(5.0) * np.array([1.0, 2.0]), rtol=1e-15, atol=0.0)


def test_corrections_that_do_not_shrink_are_round_off_if_they_are_small() -> None:
    noise = iter(np.tile([3e-9, -2e-9], 20))

    def correct(x: Array) -> tuple[Array, float]:
        step = 1.0 - x + next(noise)
        return step, float(np.max(np.abs(step)))

    assert newton(correct, np.zeros(1), close=1e-12, round_off=1e-7).converged
    assert not newton(correct, np.zeros(1), close=1e-12, most=8).converged


def test_a_singular_jacobian_and_divergence_are_named() -> None:
    assert newton(partial(of_circle, 5.0), np.array([1.0, -0.5]), close=1e-10).message == SINGULAR
    without = newton(lambda x: (2 * x + 1, float(abs(x[0]))), np.ones(1), close=1e-10, divergent=1e3)
    assert without.message == DIVERGES
    assert not without.converged


def test_longer_corrections_are_cut() -> None:
    """Newton's method for arctan(x) = 0 diverges from 2, and converges with steps of at most 1."""

    def correct(x: Array) -> tuple[Array, float]:
        step = -np.arctan(x) * (1 + x**2)
        return step, float(abs(step[0]))

    assert not newton(correct, np.array([2.0]), close=1e-12, divergent=1e6).converged
    assert abs(newton(correct, np.array([2.0]), close=1e-12, longest=1.0).point[0]) < 1e-12


def rosenbrock(x: Array, shift: float = 0.0) -> Array:
    """Residuals (..., 3) of Rosenbrock's function, with one that no point makes zero."""
    return np.stack([10.0 * (x[..., 1] - x[..., 0] ** 2), 1.0 - x[..., 0], np.full(x.shape[:-1], shift)], axis=-1)


def slopes(x: Array) -> Array:
    """Jacobians (..., 3, 2)."""
    none = np.zeros(x.shape[:-1])
    rows = [[-20.0 * x[..., 0], none + 10.0], [none - 1.0, none], [none, none]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def damped(residuals: Array, jacobians: Array, damping: Array, _: Index) -> Array:
    """Marquardt's steps."""
    normal = np.einsum("sri,srj->sij", jacobians, jacobians)
    scale = np.einsum("sii->si", normal)[:, :, None] * np.eye(normal.shape[1])
    gradient = np.einsum("sri,sr->si", jacobians, residuals)
    return -np.linalg.solve(normal + damping[:, None, None] * scale, gradient[..., None])[..., 0]


@pytest.mark.parametrize("shift", [0.0, 3.0])
def test_minima_are_those_of_scipy_whatever_the_residual(shift: float) -> None:
    starts = np.array([[-1.2, 1.0], [2.0, -3.0], [0.0, 0.0]])
    found = levenberg_marquardt(
        lambda x, _: (rosenbrock(x, shift), slopes(x)), damped, starts, gain=1e-12, close=1e-14, most=200
    )
    for start, point, norm in zip(starts, found.points, found.norms, strict=True):
        reference = least_squares(rosenbrock, start, slopes, method="lm", xtol=1e-15)
        assert np.allclose(point, reference.x, atol=1e-5)
        assert norm == pytest.approx(np.hypot(np.sqrt(2 * reference.cost), shift), abs=1e-9)


def test_searches_do_not_depend_on_each_other_and_keep_to_where_they_may_be() -> None:
    starts = np.array([[-1.2, 0.5], [0.3, -0.3]])

    def fit(starts: Array) -> Array:
        return levenberg_marquardt(
            lambda x, _: (rosenbrock(x), slopes(x)), damped, starts, gain=1e-6, close=1e-14, most=200,
            move=lambda x, step: np.clip(x + step, -2.0, 0.5),
        ).points  # fmt: skip

    together = fit(starts)
    assert np.all(together <= 0.5)
    assert np.allclose(together, np.concatenate([fit(one[None]) for one in starts]), atol=1e-12)
    assert np.allclose(together, [0.5, 0.25], atol=1e-2)


def test_a_search_that_cannot_begin_does_not_go_on() -> None:
    found = levenberg_marquardt(
        lambda x, _: (x * np.nan, np.ones((*x.shape, 1))), damped, np.ones((2, 1)), gain=1e-3, most=9
    )
    assert not np.any(np.isfinite(found.norms))
