"""Joints in space that lock a machine by the rounding of their numbers: exact ones would let it move.

Axes that are to be parallel and differ in the sixth digit leave a linkage no freedom. What holds it is a row of the
constraints that nearly depends on others. It does so near a singular position as well; but there the dependence ends a
short way on, while a rounded machine keeps it in all positions. A short lever keeps it as well: it is one where the
dependence is large for the digits of the numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.numerics.newton import newton
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.term_values import TermValues
from shoal.mechanics.terms import Term
from shoal.scene import Scene
from shoal.scene.joints import places

LEAST, MOST = 1e-10, 1e-3
"""Singular values of the rows that are between those of round-off and those of a machine."""
FINE = 2e-4
"""Numbers of more than three or four digits are not rounded by more; what is larger is a short lever of the machine."""
ROUNDED = 10.0
"""Singular values may be so many times the rounding of a number of few digits."""
LARGEST = 500
"""With so many unknowns or more, as of flexible rods, rows are not looked at: it would take too long."""
_WAY = 0.05
"""How far the machine is taken along the motion that is nearly free; a director has unit length."""
_SAME = 10.0
"""The residual of the joints there may be so many times what it is to first order."""
_SHARE = 1e-3
"""Part in a dependence, squared, from which a row counts as one of those that make it."""


def require_unlocked(scene: Scene, terms: Sequence[Term], q: Array) -> None:
    """Raises InputError where constraints forbid a motion at the coordinates q, (unknowns,), by rounding only."""
    if not terms or len(q) >= LARGEST:
        return
    length = np.array([_uncancelled(term, q) for term in terms])
    values = TermValues(terms, 3).of_lanes(np.zeros(1, dtype=np.int64))

    def gap(q: Array) -> Array:
        return np.asarray(values.at(q[None])[0][0] / length)

    def slope(q: Array) -> Array:
        return np.asarray(values.jacobian(q[None])[0] / length[:, None])

    if (found := lock(gap, slope, q)) is not None:
        first, *others = names = joints_of(scene, [terms[row].name for row in found.rows])
        if found.off > max(FINE, ROUNDED * _rounding(scene, names)):
            return
        beside = f"with {', '.join(others)} it" if others else "it"
        raise InputError(
            f"joints.{first}: {beside} forbids a motion by {found.off:.1g} rad, as rounded axes, rotations or places "
            "do; state them with more digits"
        )


def _uncancelled(term: Term, q: Array) -> float:
    """The length that the row of a constraint would have in the first lane if nothing in it were at right angles."""
    u, w = (vector.at(q) for vector in (term.u, term.w))
    squares = 0.0
    for vector, other in ((term.u, term.form @ w), (term.w, term.form.T @ u)):
        squares += float(np.sum(vector.by_lane[1][0] ** 2) * (other @ other))
    return float(np.sqrt(squares)) + 1e-300


def joints_of(scene: Scene, names: Collection[str]) -> tuple[str, ...]:
    """The joints that rows are of, by the names of joints, or of bodies, which their joints hold."""
    held = {*names}
    return tuple(
        name for name, joint in scene.joints.items() if name in held or held & {side.body for side in places(joint)}
    )


def _rounding(scene: Scene, names: Iterable[str]) -> float:
    """Half a unit of the last digit of that axis or place of these joints that has the fewest; one digit is exact."""
    sides = [side for name in names for side in places(scene.joints[name])]
    axes = [getattr(scene.joints[name], "axis", ()) for name in names]
    starts = [scene.initial[side.body] for side in sides if side.body in scene.initial]
    vectors = [*axes, *(side.point for side in sides), *(one.rotation for one in starts)]
    digits = [max(map(_decimals, one)) for one in vectors if one and not isinstance(one, str)]
    return 0.5 * 10.0 ** -min((count for count in digits if count > 1), default=17)


def _decimals(number: Any) -> int:
    """Digits of a number behind the point, as it is written in the shortest way."""
    return -int(Decimal(repr(float(np.ravel(number)[0]))).normalize().as_tuple().exponent)


class Lock(NamedTuple):
    """Rows that lock a machine, and their distance from a dependence."""

    rows: list[int]
    off: float


def lock(gap: Callable[[Array], Array], slope: Callable[[Array], Array], q: Array) -> Lock | None:
    """Return the rows that lock a machine at the coordinates q, (unknowns,), with the smallest distance.

    gap: (rows,), and slope: (rows, unknowns), of constraints in units in which a row that nothing cancels has about
    unit length
    """
    left, sizes, right = np.linalg.svd(slope(q), full_matrices=False)
    for k in np.flatnonzero((sizes > LEAST) & (sizes < MOST))[::-1]:
        there = _closed(gap, slope, q + _WAY * right[k])
        residual = float(np.max(np.abs(gap(there))))
        depends = np.any(np.linalg.svd(slope(there), compute_uv=False) < _SAME * sizes[k])
        moved = float(np.linalg.norm(there - q))
        if residual < _SAME * sizes[k] * _WAY and depends and moved > _WAY / 2:
            return Lock(np.flatnonzero(np.abs(left[:, k]) > np.sqrt(_SHARE)).tolist(), float(sizes[k]))
    return None


def _closed(gap: Callable[[Array], Array], slope: Callable[[Array], Array], q: Array) -> Array:
    """Return coordinates near q that meet all constraints but those that nearly depend on others (Gauss-Newton)."""

    def correct(q: Array) -> tuple[Array, float]:
        move = np.asarray(np.linalg.lstsq(slope(q), -gap(q), MOST)[0], dtype=float)
        return move, float(np.max(np.abs(move)))

    return newton(correct, q, close=LEAST).point
