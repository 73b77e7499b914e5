"""Robust losses are those of scipy, and so are the weights that a step goes by."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from shoal.identification.loss import flatten, steepness

RESIDUALS = [-30.0, -2.0, -1e-3, 1e-4, 0.5, 1.2, 1.5, 7.0, 400.0]
TUNING = {"huber": ("huber", 1.345), "soft-l1": ("soft_l1", 1.345), "cauchy": ("cauchy", 2.385)}
NOISE = 0.7


@pytest.mark.parametrize("loss", TUNING)
@pytest.mark.parametrize("residual", RESIDUALS)
def test_losses_and_weights_are_those_of_scipy(loss: str, residual: float) -> None:
    """One residual r x at x = 1: scipy's cost is half the loss, its gradient the weight times r^2."""
    name, tuning = TUNING[loss]
    seen = least_squares(
        lambda x: residual * x, [1.0], jac=lambda x: [[residual]], loss=name, f_scale=tuning * NOISE, max_nfev=1
    )
    flat, noise = flatten(np.array([residual]), loss, np.array([NOISE])), np.array([NOISE])
    assert flat[0] ** 2 / 2 == pytest.approx(seen.cost, rel=1e-9)
    assert np.sign(flat[0]) == np.sign(residual)
    h = 1e-6 * abs(residual)
    ahead, behind = (flatten(np.array([residual + s]), loss, noise)[0] for s in (h, -h))
    slope = (ahead - behind) / (2 * h) * steepness(flat, loss, noise)[0]
    assert slope**2 == pytest.approx(seen.grad[0] / residual**2, rel=1e-5)
