"""R-hat and effective sizes against chains whose correlation is known, and against ArviZ."""

import numpy as np
import pytest
from scipy.signal import lfilter
from shoal.identification.uncertainty.chains import bulk_size, effective_size, r_hat, tail_size
from shoal.trajectory import Array


def chains(rho: float, shape: tuple[int, ...], seed: int) -> Array:
    """Stationary AR(1) chains along the second axis, with unit variance."""
    draws = np.random.default_rng(seed).standard_normal(shape)
    draws[:, 1:] *= np.sqrt(1 - rho**2)
    return np.asarray(lfilter([1.0], [1.0, -rho], draws, axis=1))


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8])
def test_an_autoregression_has_the_size_of_its_closed_form(rho: float) -> None:
    """The mean of n values of an AR(1) process is as good as that of n (1 - rho) / (1 + rho) independent ones."""
    draws = chains(rho, (4, 2000, 8), 1)
    assert effective_size(draws) == pytest.approx(draws.size * (1 - rho) / (1 + rho), rel=0.15)
    assert r_hat(draws) < 1.01


def test_walkers_that_move_together_are_worth_one() -> None:
    alone = chains(0.5, (4, 1000, 1), 2)
    together = np.repeat(alone, 8, axis=2)
    assert effective_size(together) == pytest.approx(effective_size(alone), rel=0.01)


def test_ensembles_in_different_places_have_not_mixed() -> None:
    draws = chains(0.5, (4, 400, 8), 3)
    draws[0] += 1.0
    assert r_hat(draws) > 1.05
    assert effective_size(draws) < 50


def test_ensembles_of_different_widths_have_not_mixed() -> None:
    """Means agree: what tells them apart is R-hat of the distances from the median."""
    draws = chains(0.0, (4, 400, 8), 4)
    draws[0] *= 3.0
    assert r_hat(draws) > 1.05


def test_figures_are_those_of_arviz() -> None:
    """ArviZ 0.23.4, az.ess(bulk, tail, mean) and az.rhat of the same numbers."""
    time = np.arange(200)
    draws = np.array([np.sin(time * (1.3 + k)) + np.cos(0.05 * time * (k + 1)) ** 3 + 0.1 * k for k in range(4)])
    found = [f(draws[:, :, None]) for f in (bulk_size, tail_size, effective_size, r_hat)]
    assert found == pytest.approx(ARVIZ, rel=1e-6)


ARVIZ = [139.0458948291455, 375.29796725332085, 143.27522566573086, 1.0104214942531242]
