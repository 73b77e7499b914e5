"""The distribution of one parameter at places of a quadrature, and that of a linear combination of several."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.response.inputs import Inputs
from shoal.response.polynomials import Recurrence, of_measure
from shoal.trajectory import Array

NODES, REACH = 2**13, 9.0
"""Of quadratures over one parameter, and how far they go over a normal variable."""
SPAN, NOWHERE = 16.0, 1e-15
"""Deviations that the grid of a linear combination goes to either side; a density that is rounding."""


def nodes(inputs: Inputs, k: int, reach: float) -> tuple[Array, Array]:
    """Germs of one parameter and their weights, (nodes,) each; denser towards its ends where it is not normal."""
    if inputs.unbounded[k]:
        germs = np.linspace(-reach, reach, NODES)
        weights = np.exp(-0.5 * germs**2)
    else:
        angle = np.pi * ((np.arange(NODES) + 0.5) / NODES - 0.5)
        germs = inputs.germs(np.tile(0.5 + 0.5 * np.sin(angle)[:, None], len(inputs)))[:, k]
        weights = np.cos(angle)
    return germs, weights / weights.sum()


@dataclass(frozen=True)
class Combined:
    """The distribution of a linear combination: places on a grid and their probabilities, (places,) each."""

    places: Array
    weights: Array
    text: str = ""
    random = True

    @cached_property
    def basis(self) -> Recurrence:
        """Orthonormal over these places."""
        return of_measure(self.places, self.weights)

    @property
    def tolerance(self) -> float:
        """The standard deviation."""
        return float(np.sqrt(self.weights @ self.places**2))

    def germ(self, x: Array) -> Array:
        """The place."""
        return np.interp(x, np.cumsum(self.weights), self.places)

    def value(self, s: Array) -> Array:
        """The place."""
        return s


def combined(inputs: Inputs, way: Array) -> Combined:
    """Of the standardised germs, by the convolution of their distributions on a grid."""
    grid, step = np.linspace(-SPAN, SPAN, NODES, endpoint=False, retstep=True)
    spectrum = np.ones(NODES // 2 + 1, dtype=complex)
    for k, part in enumerate(way):
        germs, weights = nodes(inputs, k, REACH)
        # Each node is shared between its neighbours on the grid, which keeps the mean.
        at = np.clip(part * inputs.polynomials(k, germs, 1)[:, 1] / step, 1 - NODES / 2, NODES / 2 - 2)
        left = np.floor(at).astype(int)
        shared = np.zeros(NODES)
        np.add.at(shared, left % NODES, weights * (left + 1 - at))
        np.add.at(shared, (left + 1) % NODES, weights * (at - left))
        spectrum *= np.fft.rfft(shared)
    density = np.fft.fftshift(np.fft.irfft(spectrum, NODES))
    there = density > NOWHERE
    weights = density[there] / density[there].sum()
    # Sharing adds a little to the deviation, which is 1.
    return Combined(grid[there] / np.sqrt(weights @ grid[there] ** 2), weights)
