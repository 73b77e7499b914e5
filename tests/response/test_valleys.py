"""The search among many narrow valleys, against one whose deepest place is known."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.response.extremes import IntArray, climb_down, search_valleys
from shoal.trajectory import Array

APART = 2 * np.pi / 50
"""Two valleys, along the second axis."""


def valleys(at: Array, _: IntArray) -> Array:
    """-1 at (0.75, -APART) is the least. Every valley has its own deepest place, and at that none beside is deeper."""
    x, y = at[:, 0] - 0.75, at[:, 1] + APART
    return np.asarray(1e-4 * (x + 1.75 / APART * y) ** 2 + 1e-3 * y**2 - np.cos(50 * at[:, 1]))


@pytest.mark.parametrize("start", [(-1.0, 0.0), (-1.0, 1e-9), (0.0, -0.5 * APART)])
def test_a_valley_that_is_less_deep_here_is_followed_to_where_it_is_deepest(start: tuple[float, float]) -> None:
    at = np.array([start])
    best = valleys(at, np.arange(1))
    climb_down(valleys, at, best)
    search_valleys(valleys, best, at)
    assert best[0] == pytest.approx(-1.0, abs=1e-9)
    assert at[0] == pytest.approx([0.75, -APART], abs=1e-3)
    assert valleys(at, np.arange(1)) == best


def test_searches_do_not_disturb_one_another() -> None:
    """Many at once find what each finds alone."""
    starts = np.random.default_rng(3).uniform(-1, 1, (12, 2))
    together, values = starts.copy(), valleys(starts, np.arange(12))
    before = values.copy()
    search_valleys(valleys, values, together)
    assert np.all(values <= before)
    for k, start in enumerate(starts):
        alone, value = start[None].copy(), valleys(start[None], np.arange(1))
        search_valleys(valleys, value, alone)
        assert values[k] == pytest.approx(value[0], abs=1e-9)
