"""Residuals that swing about as fast as they are sampled: neighbours do not tell that they are systematic."""

import numpy as np
import pytest
from shoal.identification.diagnostics.residual_tests import _excess, ljung_box

COUNT = 400
INSTANTS = np.arange(COUNT)


@pytest.mark.parametrize("cycles", [0.02, 0.13, 0.25, 0.34, 0.41, 0.5])
def test_a_line_is_systematic_however_fast_it_is(cycles: float) -> None:
    """Of a sine nearly all power is; its noise as the differences show it, or the residual, is no reason against."""
    line = np.sqrt(2.0) * np.cos(2 * np.pi * cycles * INSTANTS + 0.3)
    size = float(np.sqrt(np.mean(line**2)))
    assert ljung_box(line) < 1e-3
    assert _excess([line], size, 0.0, fast=True) == pytest.approx(size, rel=0.1)
    assert _excess([line], size, 1.001 * size, fast=True) == 0.0


def test_so_are_many_lines() -> None:
    rng = np.random.default_rng(1)
    lines = sum(np.cos(2 * np.pi * f * INSTANTS + p) for f, p in rng.uniform([0.02, 0], [0.4, 6.3], (8, 2)))
    assert _excess([lines], float(np.std(lines)), 0.0, fast=True) == pytest.approx(np.std(lines), rel=0.1)


def test_white_noise_and_that_of_rates_by_differences_are_not() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        white = rng.standard_normal(COUNT + 2)
        for noise in (white, np.diff(white), white[2:] - white[:-2]):
            assert _excess([noise], float(np.std(noise)), 0.0, fast=True) < 0.35 * np.std(noise)


def test_a_slow_residual_counts_as_by_its_neighbours() -> None:
    rng, slow = np.random.default_rng(3), np.zeros(COUNT)
    for k in range(1, COUNT):
        slow[k] = 0.9 * slow[k - 1] + rng.standard_normal()
    neighbours = np.sqrt(slow[1:] @ slow[:-1] / COUNT)
    for fast in (True, False):
        assert _excess([slow], float(np.std(slow)), 0.0, fast) == pytest.approx(neighbours, rel=1e-12)
