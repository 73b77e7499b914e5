"""Mass regularisation of flat bodies, with iterative refinement.

A flat body moves no mass along the axis across its plane: the mass matrix is singular there, and only the constraints
of its directors define the motion of that axis. In the metric of such a matrix constraints on it are nearly dependent.
So the regularised matrix M + N is factored, with added mass N. The acceleration a = a_0 + a_1 + ... by the true mass
matrix follows from it: each term is the response to the added mass of the one before, N a_k, within the constraints.
While directors stay at right angles, the added mass has less energy than the part `masses.THIN` of the body's own
energy, and the terms fall as fast.
"""

from __future__ import annotations

from numba import njit

from shoal.compile.simd import EIGHT
from shoal.mechanics.least import alternatives, projection, together
from shoal.mechanics.least.work import GaussWork, LaneWork
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile


@njit(cache=True, error_model="numpy")
def take_back_from_lane(
    tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, lane: int, rank: int, orthogonal: bool
) -> None:
    """Refine y of one lane, which `projection.move` has moved along an orthonormal basis, else `alternatives`."""
    width, n = len(tile), m.unknowns
    for i in range(n):
        s.row[i] = s.y[i]
    for _ in range(m.refinements):
        for i in range(n):
            w.moved[i * width + lane] = s.row[i]
        _load(tile, m, w)
        for i in range(n):
            s.row[i] = w.lent[i * width + lane]
        if orthogonal:
            projection.take_out(rank, s.rows, s.wanted, s.row)
        else:
            projection.clear(s.weights)
            alternatives.correct(m.method, s.rows, s.weights, s.triangle, s.norms, s.wanted, s.row)
        for i in range(n):
            s.y[i] += s.row[i]


@njit(cache=True, error_model="numpy")
def take_back_from_group(tile: Tile, m: Arrays, w: GaussWork, lane: int, rank: int, y: Array) -> None:
    """The same of eight lanes of y, which `together.move` has moved."""
    width, n = len(tile), m.unknowns
    for i in range(n):
        for k in range(i * width + lane, i * width + lane + len(EIGHT)):
            w.moved[k] = y[k]
    for _ in range(m.refinements):
        _load(tile, m, w)
        together.take_out(w.group, rank, n, width, lane, w.lent)
        for i in range(n):
            for k in range(i * width + lane, i * width + lane + len(EIGHT)):
                w.moved[k] = w.lent[k]
                y[k] += w.lent[k]


@njit(cache=True, error_model="numpy")
def _load(tile: Tile, m: Arrays, w: GaussWork) -> None:
    """Set w.lent, D^-1/2 L^-1 N a, the load of the added mass, from w.moved, D^1/2 L' a."""
    sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, w.moved, 0)
    sparse.multiply(tile, m.pattern, m.lent, w.moved, w.lent)
    sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, w.lent, 0)
