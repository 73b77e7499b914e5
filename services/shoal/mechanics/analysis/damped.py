"""Roots s of (s^2 M + s D + K) x = 0: small motions that are damped, or whose forces follow them.

States of the user are unknowns without a mass: their rows of D and K are s y - g_v s x - g_x x - g_y y = 0.

With the energy as norm (e = |K|^1/2 y beside the rates) the linear problem is as large as the highest frequency and
not its square (Tisseur and Meerbergen, The quadratic eigenvalue problem, 2001), and each root is then corrected by the
quadratic equation that its own shape obeys (Lancaster's Rayleigh quotient). Motions that nothing holds or damps are
taken out before: their double root zero is known to the root of round-off only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse

from shoal.mechanics.analysis.balance import Balance, View
from shoal.mechanics.analysis.small_motions import ROUND, TENSION, BoundedMatrix, Spectrum
from shoal.mechanics.numerics.tile import Array

Complex = npt.NDArray[np.complex128]
AT_MOST = 400
"""So many undamped modes are coupled at most, the lowest ones."""
REAL = 1e-9
"""Imaginary parts below this part of a root are none."""
NEAR = 0.1
"""A correction above this part of a root is no correction."""


class Roots(NamedTuple):
    """One of each conjugate pair [1/s], (roots,); shapes with x^H M x = 1, (unknowns, roots).

    Roots and real parts that round-off could make are zero. levels: what it may be worth in each root [1/s], (roots,).
    """

    values: Complex
    shapes: Complex
    levels: Array

    @property
    def grows(self) -> npt.NDArray[np.bool_]:
        """Return which modes are unstable."""
        return self.values.real > REAL * np.abs(self.values)

    def ordered(self) -> Roots:
        """Those that grow first, then by size."""
        order = np.lexsort([np.abs(self.values), ~self.grows])
        return Roots(self.values[order], self.shapes[:, order], self.levels[order])


def small(balance: Balance, q: Array, view: View, count: int = AT_MOST) -> Roots:
    """The roots of small motions about a state q at rest, seen as `view`; count: of those that matter."""
    evaluator = balance.evaluator
    stiffness, friction, follows = balance.at_rest(q, view), evaluator.damping(q, t=balance.t), evaluator.follows
    symmetric = stiffness._replace(matrix=(stiffness.matrix + stiffness.matrix.T) / 2) if follows else stiffness
    if not follows and not np.any(friction.data):
        return undamped(balance.spectrum_of(symmetric, view, count))
    found, m = balance.spectrum_of(symmetric, view, AT_MOST), len(evaluator.states)
    if m:
        found = Spectrum(found.values, np.hstack([found.shapes[:, :AT_MOST], view.basis[:, -m:]]), found.levels)
        own = scipy.sparse.csc_array((np.ones(m), (evaluator.states, evaluator.states)), shape=friction.shape)
        friction = friction + evaluator.weight * own
    return roots(stiffness, BoundedMatrix(friction, ROUND * abs(friction.copy())), found, follows=follows, states=m)


def undamped(found: Spectrum) -> Roots:
    """The roots +i omega, or +growth, of motions that nothing damps and whose forces have a potential."""
    squares = np.where(np.abs(found.values) <= found.levels, 0.0, found.values)
    sizes = np.sqrt(np.abs(squares))
    values = np.where(squares < 0, sizes + 0j, 1j * sizes)
    levels = np.divide(found.levels, sizes, out=np.sqrt(found.levels), where=sizes > 0)
    return Roots(values, found.shapes.astype(complex), levels).ordered()


def roots(
    stiffness: BoundedMatrix, damping: BoundedMatrix, found: Spectrum, *, follows: bool, states: int = 0
) -> Roots:
    """The roots in the modes of the symmetric part of the stiffness. follows: whether it has another part.

    states: so many of the last shapes are of states of the user
    """
    shapes, squares, levels = found.shapes[:, : AT_MOST + states].copy(), found.values[:AT_MOST], found.levels[:AT_MOST]
    if follows:
        free = np.zeros(shapes.shape[1], dtype=bool)
        matrix = shapes.T @ (stiffness.matrix @ shapes)
    else:
        free = np.abs(squares) <= levels
        matrix = np.diag(np.where(free, 0.0, squares))
    rates, turned = scipy.linalg.eigh(shapes[:, free].T @ (damping.matrix @ shapes[:, free])) if any(free) else ([], 0)
    if any(free):
        shapes[:, free] = shapes[:, free] @ turned
    zeros = shapes[:, free]
    idle = np.asarray(rates) <= damping.worth(zeros, zeros)
    keep = ~free
    keep[free] = ~idle
    shapes, matrix, held = shapes[:, keep], matrix[np.ix_(keep, keep)], ~free[keep]
    values, modes, own = _coupled(stiffness, damping, shapes, matrix, held, follows, states)
    levels = levels[free[: len(levels)]]
    slack = np.where(idle, np.sqrt(levels), levels / np.maximum(np.abs(rates), 1e-300))
    return Roots(
        np.append(values, np.zeros(len(slack))),
        np.hstack([shapes @ modes, zeros]),
        np.append(own, np.minimum(slack, np.sqrt(levels))),
    ).ordered()


def _coupled(
    stiffness: BoundedMatrix,
    damping: BoundedMatrix,
    shapes: Array,
    matrix: Array,
    held: npt.NDArray[np.bool_],
    follows: bool,
    states: int,
) -> tuple[Complex, Complex, Array]:
    """Roots, their shapes in the given ones, and levels. matrix: the stiffness in the shapes, 0 but for `held`."""
    n = len(matrix)
    if not n:
        return np.zeros(0, dtype=complex), np.zeros((0, 0), dtype=complex), np.zeros(0)
    rubbing, heavy = shapes.T @ (damping.matrix @ shapes), np.arange(n) < n - states
    held = held & heavy
    size = np.abs(np.diag(matrix))[held]
    scale = np.sqrt(np.maximum(size, 1e-12 * np.max(size, initial=0.0) if follows else 0.0))
    scale[scale == 0.0] = 1.0
    # Unknowns: energies, the rates of masses, states; of the last two the equations.
    rate, state = np.diag(scale) @ np.eye(n)[held], ~heavy
    rate[:, state] = 0.0
    column = np.where(state, matrix, rubbing)
    linear = np.block([[np.zeros((len(scale), len(scale))), rate], [-matrix[:, held] / scale, -column]])
    if follows:
        values, left, right = scipy.linalg.eig(linear, left=True)
        both = np.zeros((n, len(values)), dtype=complex)
        both[held], both[state] = right[: len(scale)] / scale[:, None], right[len(scale) :][state]
        y, w = _unit(both), _unit(np.conj(left[len(scale) :]))
    else:
        values, right = scipy.linalg.eig(linear)
        y = w = _unit(right[len(scale) :])
    a, b, c = (np.sum(w * (part @ y), axis=0) for part in (np.diag(heavy.astype(float)), rubbing, matrix))
    noise = ROUND * float(np.linalg.norm(linear, 2))
    begun = values
    for _ in range(3):
        slope = 2 * a * values + b
        step = np.divide((a * values + b) * values + c, slope, out=np.zeros_like(values), where=slope != 0)
        values = np.where(np.abs(step) < NEAR * np.abs(begun), values - step, values)
        lost = (np.abs(step) >= NEAR * np.abs(begun)) & (np.abs(begun) < 1e3 * noise)
    x, z = shapes @ y, shapes @ w
    slope = np.maximum(np.abs(2 * a * values + b), 1e-300)
    rub = np.abs(values) * damping.worth(z, x)
    placed = np.linalg.norm(w[heavy], axis=0) * np.linalg.norm(y[heavy], axis=0) if states else 1.0
    pull = np.maximum(stiffness.worth(z, x), TENSION * np.max(size, initial=0.0) * placed if follows else 0.0)
    double = np.sqrt((pull + rub) / np.maximum(np.abs(a), 1e-8))
    levels = np.where(lost, np.abs(begun), np.minimum((pull + rub) / slope, double))
    growth = levels if follows else np.where(lost, levels, np.minimum(rub / slope, double))
    values = np.where(np.abs(values) <= levels, 0.0, values)
    values = np.where(np.abs(values.imag) <= REAL * np.abs(values), values.real + 0j, values)
    values = np.where((np.abs(values.real) <= growth) & (values.imag != 0), 1j * values.imag, values)
    kept = values.imag >= 0
    return values[kept], y[:, kept], levels[kept]


def _unit(columns: Complex) -> Complex:
    return np.asarray(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))
