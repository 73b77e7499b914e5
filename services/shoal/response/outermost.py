"""What an expansion does further out than runs tell.

Hermite's polynomials of high degree have most of their variance further out than any run, where nothing else holds
them. The outermost runs, which the others foretell, show some of it; the deviation of places as far out as runs go
shows the rest: that in closed form counts all there is beyond.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.response.expansion import Expansion
from shoal.response.inputs import BoolArray, Inputs
from shoal.response.polynomials import Terms
from shoal.trajectory import Array

OUTER = 0.06
"""Share of the runs that are taken for the outermost."""
DRAWN = 1024
"""Places at which the deviation is looked at."""
MISSED = 0.05
"""Share of a deviation that so few places may miss."""


def outermost(inputs: Inputs, germs: Array) -> BoolArray:
    """Which runs are, (runs,); none where all germs are bounded, or where all are as far out."""
    far = np.abs(germs[:, inputs.unbounded]).max(axis=1, initial=0.0)
    outer = np.asarray(far >= np.sort(far)[-max(1, int(OUTER * len(far)))])
    return outer & inputs.unbounded.any() & ~outer.all()


def outwards(germs: Array, values: Array, found: Expansion) -> Expansion:
    """With the error of the outermost runs where its terms are fitted to all others."""
    outer = outermost(found.inputs, germs)
    if not outer.any():
        return found
    basis = found.inputs.basis(germs, found.terms)
    told = np.linalg.lstsq(basis[~outer], values[~outer], rcond=None)[0]
    missed = basis[outer] @ told - values[outer]
    beyond = np.sqrt((missed**2).sum(axis=0) / len(germs))
    return replace(found, left_out=np.maximum(found.left_out, beyond))


def hidden(coefficients: Array, inputs: Inputs, terms: Terms) -> Array:
    """Part of the deviation in closed form that places as far out as runs go do not show, (columns,); 0 where it is no
    more than these places may miss.

    coefficients: of the terms, the constant first, (columns, terms)
    """
    seen = (inputs.basis(inputs.sobol(DRAWN, 0), terms) @ coefficients.T).std(axis=0)
    apart = np.abs(np.sqrt((coefficients[:, 1:] ** 2).sum(axis=1)) - seen)
    return np.where(apart > MISSED * seen, apart, 0.0)
