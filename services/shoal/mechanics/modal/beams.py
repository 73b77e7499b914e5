"""Shapes in which a uniform beam vibrates across its axis, by how its ends are held in its frame.

Bernoulli-Euler, with x from 0 to 1: phi = A sin bx + B cos bx + C exp(-bx) + D exp(-b(1-x)), in which nothing
overflows. The conditions at both ends are four equations for A to D; where their determinant vanishes is the wave
number b.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from shoal.mechanics.numerics.tile import Array

Ends = tuple[str, str]
_HELD = {"pinned": (0, 2), "clamped": (0, 1), "free": (2, 3)}
"""The derivatives that vanish at an end."""
_SHIFT = {
    ("pinned", "pinned"): 0.0,
    ("clamped", "free"): -0.5,
    ("free", "clamped"): -0.5,
    ("pinned", "free"): 0.25,
    ("free", "pinned"): 0.25,
    ("free", "free"): 0.5,
}
"""Wave numbers are near (k + shift) pi."""
_NEAR = 0.4
"""Within so much of it; the roots lie pi apart."""


def shapes(ends: Ends, count: int, x: Any, derivative: int) -> Array:
    """The first shapes at x, or a derivative by x, (shapes, *x.shape).

    Of size 1 at a free end, or as sines.
    """
    x = np.asarray(x, dtype=float)
    found = []
    for number in range(1, count + 1):
        wave, factors = _shape(ends, number)
        found.append(np.tensordot(factors, _solutions(wave, x, derivative), axes=1) * wave**derivative)
    return np.array(found).reshape(count, *x.shape)


def wave_numbers(ends: Ends, count: int) -> Array:
    """b of the first shapes: their frequencies are b^2/L^2 sqrt(EI/(rho A))."""
    return np.array([_shape(ends, number)[0] for number in range(1, count + 1)])


def _solutions(wave: float, x: Array, derivative: int) -> Array:
    """The derivatives of the four solutions over b^derivative, (4, *x.shape)."""
    trigonometric = (np.sin, np.cos, lambda z: -np.sin(z), lambda z: -np.cos(z))
    sine, cosine = trigonometric[derivative % 4], trigonometric[(derivative + 1) % 4]
    falling = np.exp(-wave * x) * (-1.0) ** derivative
    return np.stack([sine(wave * x), cosine(wave * x), falling, np.exp(-wave * (1.0 - x))])


def _conditions(ends: Ends, wave: float) -> Array:
    return np.stack(
        [_solutions(wave, np.array(place), k) for place, end in zip((0.0, 1.0), ends, strict=True) for k in _HELD[end]]
    )


@cache
def _shape(ends: Ends, number: int) -> tuple[float, Array]:
    """Wave number and factors of the four solutions."""
    from scipy.optimize import brentq

    near = (number + _SHIFT[ends]) * np.pi

    def determinant(wave: float) -> float:
        return float(np.linalg.det(_conditions(ends, wave)))

    wave = brentq(determinant, near - _NEAR, near + _NEAR, xtol=1e-14, rtol=4 * np.finfo(float).eps)
    factors = np.linalg.svd(_conditions(ends, wave)).Vh[-1]
    place = np.array(1.0 if ends[1] == "free" else 0.0)
    return wave, factors / (factors @ _solutions(wave, place, 0) if "free" in ends else factors[0])
