"""Squared frequencies of small motions, each with a bound of its round-off.

A single eigenvalue decomposition gives all eigenvalues with the round-off of the largest one: a stiff rod hides a
pendulum. Here the slow subspace is projected out and solved again, down to the slowest (Rayleigh and Ritz). An error e
of a shape changes its value by e^2 of the stiff motions only. What remains is the round-off of the stiffness along the
shape, |x|' B |x| with the bound B of its entries (Higham, Accuracy and Stability, ch. 3), and the effect of rounded
positions on the stiffest motion of the part of the machine that the shape moves.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse.csgraph

from shoal.mechanics.numerics.tile import Array, Index
from shoal.mechanics.reach import span
from shoal.scene import Scene

ROUND = 16.0 * float(np.finfo(float).eps)
"""Round-off of an entry of a matrix, over the sum of the sizes of what it is made of."""
TENSION = 2.0 * ROUND
"""What rounded places may be worth in a squared frequency, over the largest of the part of the machine."""
LOW = 1e-6
"""Motions whose squared frequencies are below this part of the largest are solved for by themselves."""
LEAST = 1e-13
"""Squared frequencies below this [rad^2/s^2], of a period of 200 days, are zero."""
HIDES = 0.1
"""Round-off above this part of the slowest frequency that is told may hide one that matters."""


class BoundedMatrix(NamedTuple):
    """A matrix (unknowns, unknowns) and the bound of the round-off in its entries, both sparse."""

    matrix: Any
    bound: Any

    def worth(self, left: npt.NDArray[Any], right: npt.NDArray[Any]) -> Array:
        """Return a bound of the round-off of left_k' matrix right_k, for every column k, (columns,)."""
        return np.asarray(np.sum(np.abs(left) * (self.bound @ np.abs(right)), axis=0))


class Spectrum(NamedTuple):
    """Squared frequencies [rad^2/s^2], lowest first, all or the lowest of them, (n,).

    shapes: in the coordinates, with x' M x = 1, (unknowns, n); levels: below these [rad^2/s^2] each is zero to working
    accuracy, (n,)
    """

    values: Array
    shapes: Array
    levels: Array


def spectrum(stiffness: BoundedMatrix, basis: Array, mass: Any = None, parts: Index | None = None) -> Spectrum:
    """The spectrum of a symmetric stiffness in a basis Z with Z' M Z = I, (unknowns, n).

    mass, parts: M and of each unknown the number of the part of the machine that it belongs to, (unknowns,): places
    are rounded too, which a slow motion of a thin wire feels by the tension that this makes in its own part
    """
    values, modes = graded(stiffness.matrix, basis)
    shapes = basis @ modes
    if parts is None:
        return Spectrum(values, shapes, np.maximum(LEAST, stiffness.worth(shapes, shapes)))
    stiffest = np.max(np.abs(values) * by_part(shapes * (mass @ shapes), parts), axis=1, initial=0.0)
    return Spectrum(values, shapes, round_off(stiffness, shapes, mass, parts, stiffest))


def round_off(stiffness: BoundedMatrix, shapes: Array, mass: Any, parts: Index, stiffest: Array) -> Array:
    """Return what round-off may be worth in the squared frequencies of shapes with x' M x = 1, (shapes,).

    stiffest: squared frequency of the stiffest motion of each part of the machine, (parts,)
    """
    levels = np.maximum(LEAST, stiffness.worth(shapes, shapes))
    return np.maximum(levels, TENSION * (stiffest @ by_part(shapes * (mass @ shapes), parts)))


def by_part(values: Array, parts: Index) -> Array:
    """Return the sums over the parts of a machine of values by unknown, (unknowns, ...) to (parts, ...)."""
    sums = np.zeros((int(np.max(parts, initial=-1)) + 1, *values.shape[1:]))
    np.add.at(sums, parts, values)
    return sums


def parts_of(mass: Any, jacobian: Any) -> Index:
    """The number of the part that each unknown belongs to, (unknowns,); of a mass with the pattern of the stiffness."""
    # Copies, as the index arrays are the model's own, which SciPy may sort.
    pattern, rows = mass.copy(), jacobian.copy()
    pattern.data[:], rows.data[:] = 1.0, 1.0
    return np.asarray(scipy.sparse.csgraph.connected_components(pattern + rows.T @ rows, directed=False)[1])


def graded(stiffness: Any, basis: Array) -> tuple[Array, Array]:
    """Return the values of a symmetric stiffness in a basis, each to its own accuracy, and their shapes in it."""
    if not basis.shape[1]:
        return np.zeros(0), np.zeros((0, 0))
    values, modes = scipy.linalg.eigh(basis.T @ (stiffness @ basis))
    low = np.abs(values) <= LOW * np.max(np.abs(values))
    if np.any(low) and not np.all(low):
        values[low], turned = graded(stiffness, basis @ modes[:, low])
        modes[:, low] = modes[:, low] @ turned
    return values, modes


def pull(scene: Scene) -> float:
    """Squared frequency [rad^2/s^2] of a pendulum as large as the machine."""
    return float(np.linalg.norm(scene.gravity)) / span(scene)


def hides(levels: Array | float, values: Array, least: float) -> bool:
    """Return whether round-off may hide a motion that matters among those that nothing seems to hold.

    levels: of those, values: of all, least: of other estimates, such as `pull`; squared, all [rad^2/s^2]
    """
    told = np.abs(values)[np.abs(values) > np.max(levels, initial=0.0)]
    slowest = min([*told, *([least] if least > 0 else [])], default=np.inf)
    return bool(np.max(levels, initial=0.0) > HIDES**2 * slowest)
