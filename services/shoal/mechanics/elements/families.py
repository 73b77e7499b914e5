"""The kernels of flexible elements, chosen by the type of their arrays at compile time.

A family is a subclass of `Family`; `implement` in its own file says which kernels are its. Compiled code
goes through the families of a model in their order and calls the functions below.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from shoal.compile import structures
from shoal.compile.choice import choose
from shoal.compile.simd import EIGHT
from shoal.mechanics.numerics.tile import Array, Index, Number, Tile, index, stacked

PLAN = 5
"""Numbers of an element in the plan: its first row of the table, how many rows, its first row of the reference, the
variant of the kernel (which only the family itself knows), and how many from here on are of that variant, at most 8."""

PLANE, SPACE = (0,) * 2, (0,) * 3
"""Tuples as long as vectors are, which makes the dimension a constant at compile time."""


class Family(NamedTuple):
    """Elements of one family, any number of them, also none; each family is a subclass.

    The arrays repeat the last element, so that a batch that begins with it reads nothing that is not there.

    side: rows of one element. damped: whether any loses energy in itself, otherwise rates are not looked at. table:
    quadrature rules back to back. plan: PLAN numbers an element. rows: `side` an element. coefficients: (numbers *
    size, lanes); reference: the stress-free shape where the kernel needs it, (any, lanes). spare: unused
    lanes at the end of the tile, whole vectors of them, which need no force.
    """

    size: int
    side: int
    damped: bool
    table: Array
    plan: Index
    rows: Index
    coefficients: Array
    reference: Array
    spare: int = 0


class Kernel(NamedTuple):
    """Sizes for one element: rows, coefficients, and the first of these that is a stiffness.

    space: a tuple as long as its vectors are, of kernels that are written for both the plane and space. tangent: the
    family for which the tangent is compiled, where several share one. exact: whether `add_mean_force` knows the force.
    """

    side: int
    coefficients: int
    first_stiffness: int
    space: tuple[int, ...] = PLANE
    tangent: type | None = None
    exact: bool = False


class Entry(NamedTuple):
    """One element, as its family stores it. rule: rows of the table, (points, columns)."""

    rule: Array
    variant: int
    damped: bool
    numbers: list[Number]
    reference: list[Number]


KERNELS: dict[type, Kernel] = {}


class Collected:
    """The elements of one family as they are found."""

    def __init__(self) -> None:
        self.owners: list[str] = []
        self._rules: dict[bytes, tuple[int, Array]] = {}
        self._points = 0
        self._plan: list[int] = []
        self._rows: list[int] = []
        self._numbers: list[Number] = []
        self._reference: list[Number] = []
        self._damped = False

    def add(self, owner: str, rows: list[int], part: Entry) -> None:
        """One element of a body."""
        key = part.rule.tobytes()
        if key not in self._rules:
            self._rules[key] = self._points, part.rule
            self._points += len(part.rule)
        self._plan += [self._rules[key][0], len(part.rule), len(self._reference), part.variant, 1]
        last = len(self._plan) - PLAN
        for first in range(last - PLAN, max(last - PLAN * len(EIGHT), -1), -PLAN):
            if self._plan[first + PLAN - 2] != part.variant:
                break
            self._plan[first + PLAN - 1] += 1
        self.owners.append(owner)
        self._rows += rows
        self._numbers += part.numbers
        self._reference += part.reference
        self._damped = self._damped or part.damped

    def family(self, kind: Any) -> Any:
        """All of them as arrays, and the last one again where a batch would read beyond it."""
        for _ in range(len(EIGHT) - 1 if self.owners else 0):
            self._plan += self._plan[-PLAN:]
            self._rows += self._rows[-KERNELS[kind].side :]
            self._numbers += self._numbers[-KERNELS[kind].coefficients :]
        table = np.concatenate([np.zeros(0), *(rule.ravel() for _, rule in self._rules.values())])
        side = KERNELS[kind].side
        plan, rows = index(self._plan), index(self._rows)
        numbers, reference = stacked(self._numbers), stacked(self._reference)
        return kind(len(self.owners), side, self._damped, table, plan, rows, numbers, reference)


def add_force(
    tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool
) -> None:
    """Add the elastic force -dU/dz and the damping force [N, N m, ...] to f (rows, lanes). Pointers.

    power: row 0 += power dissipated by damping [W]; w: room, see `dynamics.Work`. zdot and power are not looked at
    unless the family is damped; moving: whether damping counts, or the elastic part alone.
    """
    raise NotImplementedError(type(family).__name__)


def add_mean_force(tile: Tile, family: Family, before: Array, after: Array, f: Array, w: Array) -> None:
    """Add the force whose work over a step is exactly the loss of energy, of families that know it. Pointers."""
    raise NotImplementedError(type(family).__name__)


def add_energy(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """Add the strain energy [J] to a row of energy; w: room as above. Pointers."""
    raise NotImplementedError(type(family).__name__)


def tangent(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int, viscous: bool) -> None:
    """Stiffness d2U/dz2 of every element; rows of out from `first` on: (size side^2, lanes), row-major blocks.

    viscous: the damping matrix -df/dzdot [N s/m, ...] in place of it, of a damped family.
    Pointers.
    """
    raise NotImplementedError(type(family).__name__)


def space_of(family: Family) -> tuple[int, ...]:
    """Return a tuple as long as vectors are."""
    raise NotImplementedError(type(family).__name__)


def implement(kind: type, kernel: Kernel, *, force: Any, potential: Any, stiffness: Any, mean: Any = None) -> None:
    """Let compiled calls with elements of this type run these kernels, whose parameters are named as above.

    mean: of one that is exact.
    """
    KERNELS[kind] = kernel._replace(exact=mean is not None)
    _choose_space(kind, kernel.space)
    choose(add_force, kind, force, forceinline=True)
    choose(add_energy, kind, potential)
    choose(tangent, kind, stiffness)
    if mean:
        choose(add_mean_force, kind, mean)


def implement_tangent(kind: type, space: tuple[int, ...], stiffness: Any) -> None:
    """Let compiled calls of `tangent` with a type that several families share, `Kernel.tangent`, run this kernel."""
    _choose_space(kind, space)
    choose(tangent, kind, stiffness)


def _choose_space(kind: type, space: tuple[int, ...]) -> None:
    choose(space_of, kind, (lambda family: PLANE) if space == PLANE else (lambda family: SPACE))


LAID = 16
"""Room of one family in `lay`, in numbers of 8 bytes."""


def lay(elements: tuple[Any, ...]) -> Array:
    """Write families back to back, as kernels read them; their arrays must outlive the use."""
    places = np.zeros((len(elements), LAID))
    for place, family in zip(places, elements, strict=True):
        structures.write(place, family)
    return places.ravel()
