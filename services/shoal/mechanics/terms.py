"""Constraint terms (bilinear forms of vectors, sums of angles), and their assembly into the arrays of `constraints`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import NEGLIGIBLE, Affine, fixed
from shoal.mechanics.constraints import LINEAR, OPEN, WAYS, Constraints
from shoal.mechanics.derived import RowAllocator
from shoal.mechanics.numerics.tile import Array, Number, index, stacked
from shoal.scene.function import Composed

CONSTANT = -1


@dataclass(frozen=True)
class Term:
    """One constraint before it has rows: u' form w + sum of factor * angle + a constant and a function of time.

    form: (d, d). lengths: the power of a length that it is measured in. angles: factors and unit vectors whose angles
    [rad] are counted, in space in coordinates whose third axis is that which they turn about. period: of a term with
    angles, multiples of which make no difference. of_start: whether the constant is such that it vanishes at the start.
    further: pairs of vectors whose scalar products add.
    roots: factors, vectors of separate bodies and c of the spans (`ropes`) that add
    """

    name: str
    u: Affine
    w: Affine
    form: Array
    constant: Number
    drive: Composed | None
    lengths: int
    angles: tuple[tuple[Number, Affine], ...] = ()
    period: Number = 1.0
    of_start: bool = False
    further: tuple[tuple[Affine, Affine], ...] = ()
    roots: tuple[tuple[Number, Affine, Number], ...] = ()

    @property
    def pairs(self) -> list[tuple[Affine, Affine, Array]]:
        """Return the pairs of vectors with their forms whose products add; none of a sum of angles."""
        every = [(self.u, self.w, self.form), *((u, w, np.eye(len(u.constant))) for u, w in self.further)]
        return [one for one in every if all(vector.terms or np.any(vector.constant) for vector in one[:2])]

    def products(self, rows: Callable[[Affine], tuple[int, ...]]) -> list[tuple[int, int, Number, Affine, Affine]]:
        """(left row, right row, factor, left vector, right vector); left row -1 for a linear term."""
        return [product for pair in self.pairs for product in _products(*pair, rows)]

    def is_constant(self, size: float) -> bool:
        """Return whether every product of unknowns counts by round-off only. size: a length of the machine [m]."""
        if self.angles:
            return False
        small = NEGLIGIBLE * min(size**self.lengths, size ** (self.lengths - 1))
        found: dict[frozenset[int], Number] = {}
        for *sides, form in self.pairs:
            one, other = ({CONSTANT: vector.constant, **vector.terms} for vector in sides)
            for (i, u), (j, w) in product(one.items(), other.items()):
                found[frozenset((i, j))] = found.get(frozenset((i, j)), 0.0) + np.sum(u * (form @ w), axis=0)
        found.pop(frozenset((CONSTANT,)), None)
        return all(np.all(np.abs(factor) <= small) for factor in found.values())

    def slopes(self, rows: Callable[[Affine], tuple[int, ...]]) -> Iterator[tuple[int, int, Number]]:
        """(unknown, row, coefficient) of the angles: derivatives by an unknown are coefficients times rows, as their
        vectors are of unit length.
        """
        for factor, vector in self.angles:
            if vector.terms:
                x, y, *_ = rows(vector)
                for unknown, (along, across, *_) in vector.terms.items():
                    yield unknown, y, -factor * along
                    yield unknown, x, factor * across

    def begin(self, value: Callable[[Affine], Array]) -> Term:
        """The same with the constant of a start; value: of a vector there, (d, lanes)."""
        found = sum((factor * plane.angle(value(vector)[:2]) for factor, vector in self.angles), np.zeros(1))
        for u, w, form in self.pairs:
            found = found + np.einsum("il,ij,jl->l", value(u), form, value(w))
        return replace(self, constant=-found)


def _products(
    u: Affine, w: Affine, form: Array, rows: Callable[[Affine], tuple[int, ...]]
) -> list[tuple[int, int, Number, Affine, Affine]]:
    if not w.terms:
        u, w, form = w, u, form.T
    y = rows(w)
    if not u.terms:
        parts = [sum(f * part for f, part in zip(column, u.constant, strict=True)) for column in form.T]
        return [(-1, y[k], part, u, w) for k, part in enumerate(parts) if np.any(part)]
    x = rows(u)
    return [(x[i], y[j], form[i, j], u, w) for i, j in zip(*np.nonzero(form), strict=True)]


class Terms:
    """Collects constraints before their vectors have rows."""

    def __init__(self) -> None:
        self.held: list[Term] = []
        self.pressed: dict[str, tuple[int, int]] = {}
        """Joints whose force is asked for: the first of their constraints and how many they are."""
        self.tensions: dict[str, list[int]] = {}
        """Of ropes that keep their length exactly, the constraints that keep it."""

    def dot(
        self, name: str, u: Affine, w: Affine, lengths: int, constant: Number = 0.0, drive: Composed | None = None
    ) -> None:
        """u . w + constant + drive(t) = 0, measured in m to the power of `lengths`."""
        self.held.append(Term(name, u, w, np.eye(len(u.constant)), constant, drive, lengths))

    def form(self, name: str, u: Affine, w: Affine, form: Array, lengths: int) -> None:
        """u' form w = 0, measured in m to the power of `lengths`; form: (d, d)."""
        self.held.append(Term(name, u, w, form, 0.0, None, lengths))

    def cross(self, name: str, u: Affine, w: Affine, lengths: int, drive: Composed | None = None) -> None:
        """u x w + drive(t) = 0 of two vectors of the plane, measured in m to the power of `lengths`."""
        self.held.append(Term(name, u, w, plane.CROSS, 0.0, drive, lengths))

    def sum(
        self,
        name: str,
        pairs: Sequence[tuple[Affine, Affine]],
        *,
        angles: Iterable[tuple[Number, Affine]] = (),
        period: Number = 1.0,
        roots: Iterable[tuple[Number, Affine, Number]] = (),
        lengths: int = 0,
        drive: Composed | None = None,
        of_start: bool = True,
        constant: Number = 0.0,
    ) -> None:
        """Sum of scalar products u . w, factor * angle of unit vector and factor * span, + drive(t) = 0.

        Multiples of the period of sums with angles make no difference. lengths: the power of a length that it is
        measured in; of_start: whether it stays what it is at the start
        """
        (u, w), *further = pairs
        form = np.eye(len(u.constant))
        self.held.append(
            Term(
                name,
                u,
                w,
                form,
                constant,
                drive,
                lengths,
                tuple(angles),
                period,
                of_start,
                tuple(further),
                tuple(roots),
            )
        )

    def begin(self, value: Callable[[Affine], Array]) -> None:
        """Give all terms that vanish at the start their constants. value: of a vector there, (d, lanes)."""
        self.held = [one.begin(value) if one.of_start else one for one in self.held]

    def settle(self, size: float) -> None:
        """Take the unknowns out of what does not depend on them; however small its slopes, they would count as a row.

        size: a length of the machine [m].
        """
        for k, held in enumerate(self.held):
            if held.is_constant(size):
                further = tuple((fixed(u.constant), fixed(w.constant)) for u, w in held.further)
                self.held[k] = replace(held, u=fixed(held.u.constant), w=fixed(held.w.constant), further=further)

    def press(self, name: str, condition: Any, before: int) -> None:
        """Note a joint whose force is asked for. before: number of constraints before its own."""
        if getattr(condition, "held", False):
            self.pressed[name] = before, len(self.held) - before

    def add(self, name: str, pairs: Iterable[tuple[Affine, Affine]], lengths: int) -> None:
        """The sum of scalar products vanishes, measured in m to the power of `lengths`."""
        (u, w), *further = pairs
        self.held.append(Term(name, u, w, np.eye(len(u.constant)), 0.0, None, lengths, further=tuple(further)))

    def vanish(self, name: str, vector: Affine, drives: tuple[Composed, ...] | None = None) -> None:
        """vector + drives(t) = 0, a linear constraint for each component [m]."""
        for k, axis in enumerate(np.eye(len(vector.constant))):
            self.dot(name, fixed(axis[:, None]), vector, 1, drive=drives[k] if drives else None)


def drives(terms: Terms) -> dict[int, Term]:
    """Return for every function of time, by its identity, the first of the terms that follow it."""
    found: dict[int, Term] = {}
    for one in terms.held:
        if one.drive is not None:
            found.setdefault(id(one.drive.function), one)
    return found


def assemble(terms: Terms, rows: RowAllocator, driven: int, size: float) -> Constraints:
    """The lists of the collected constraints. Their drives are numbered from `driven` on, in the order of `drives`.

    size: a length of the machine [m].
    """
    start, entry = [0], [0]
    lefts: list[int] = []
    rights: list[int] = []
    factors: list[Number] = []
    column: list[int] = []
    parts: list[tuple[int, int, Number]] = []
    numbers = {drive: driven + k for k, drive in enumerate(drives(terms))}
    drive, way = list[int](), list[int]()
    turned, rising, shares, periods = [0], list[int](), list[Number](), list[Number]()
    for held in terms.held:
        found: dict[int, int] = {}
        for unknown, source, coefficient in held.slopes(rows.of):
            if np.any(coefficient):
                if unknown not in found:
                    found[unknown] = len(column)
                    column.append(unknown)
                parts.append((found[unknown], source, coefficient))
        for share, vector in held.angles:
            rising.append(rows.of(vector)[0])
            shares.append(share)
        for left, right, factor, u, w in held.products(rows.of):
            lefts.append(left)
            rights.append(right)
            factors.append(factor)
            for row, vector, other in ((left, u, right), (right, w, left)):
                if row < 0:
                    continue
                component = rows.of(vector).index(row)
                for unknown, value in vector.terms.items():
                    coefficient = factor * value[component]
                    if not np.any(coefficient):
                        continue
                    if unknown not in found:
                        found[unknown] = len(column)
                        column.append(unknown)
                    parts.append((found[unknown], other, coefficient))
        start.append(len(lefts))
        entry.append(len(column))
        turned.append(len(rising))
        periods.append(held.period)
        drive.append(-1 if held.drive is None else numbers[id(held.drive.function)])
        way.append(LINEAR if held.drive is None else WAYS[held.drive.operations])

    return Constraints(
        len(terms.held),
        index(start),
        index(lefts),
        index(rights),
        stacked(factors),
        stacked([held.constant for held in terms.held]),
        index([held.lengths for held in terms.held]),
        stacked([OPEN * size**held.lengths for held in terms.held]),
        index(drive),
        index(way),
        index(entry),
        index(column),
        len(parts),
        index([target for target, _, _ in parts]),
        index([source for _, source, _ in parts]),
        stacked([coefficient for _, _, coefficient in parts]),
        index(turned),
        index(rising),
        stacked(shares),
        stacked(periods),
    )
