"""The rectangular section of a rod in space: its height lies along the local y axis, its width along z."""

from __future__ import annotations

import numpy as np

from shoal.mechanics.numerics.tile import Number

_TERMS = np.arange(1, 400, 2)


def torsion_constant(height: Number, width: Number) -> Number:
    """Saint-Venant's constant J [m^4] of torsion: torque over shear modulus and twist; a number or one per lane.

    Timoshenko and Goodier, Theory of Elasticity, art. 109: with the sides a >= b
    J = a b^3/3 (1 - 192 b/(pi^5 a) sum over odd n of tanh(n pi a/(2 b))/n^5).
    """
    long, short = np.maximum(height, width), np.minimum(height, width)
    terms = np.tanh(np.multiply.outer(_TERMS * np.pi / 2, long / short)).T / _TERMS**5.0
    return long * short**3 / 3 * (1 - 192 / np.pi**5 * short / long * terms.sum(axis=-1))
