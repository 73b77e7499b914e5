"""The model: numbered coordinates and the arrays that the compiled kernels work on.

The rows of a state are the unknowns q, then rows derived from them (points and directions of
bodies that do not own the coordinates; first those that forces act on, then those that constraints
hold, then those of markers).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.errors import InputError
from shoal.mechanics import applied, forces, functions
from shoal.mechanics.applied import Applied
from shoal.mechanics.assembly.frames import Frame
from shoal.mechanics.elements import ancf_cable, ancf_full, beam
from shoal.mechanics.elements.ancf_cable import AncfCables
from shoal.mechanics.elements.ancf_full import AncfFull
from shoal.mechanics.elements.beam import Beams
from shoal.mechanics.forces import Forces
from shoal.mechanics.functions import Functions, Piecewise
from shoal.mechanics.least import constraints, saddle
from shoal.mechanics.least.constraints import Constraints
from shoal.mechanics.least.saddle import Saddle
from shoal.mechanics.numerics import gate, sparse
from shoal.mechanics.numerics.tile import Array, Index, Tile, pack
from shoal.mechanics.numerics.vector import pointer
from shoal.mechanics.start.closure import Flags
from shoal.scene import Scene


class Derived(NamedTuple):
    """Row r (after the unknowns): constant[r] + sum of coefficient[t] z[source[t]] over start[r] <= t < start[r+1]."""

    start: Index
    source: Index
    coefficient: Array
    constant: Array


class Elements(NamedTuple):
    """The flexible elements by family: one line here, in `raw` and in dynamics.py for each kernel."""

    cables_full: AncfCables
    cables_reduced: AncfCables
    cubics: Beams
    quintics: Beams
    solids: AncfFull
    two_point_solids: AncfFull


class Gates(NamedTuple):
    """Addresses of the kernels of dynamics.py and tangent.py for one width."""

    motion: int
    settle: int
    energies: int
    assemble: int


class Arrays(NamedTuple):
    """All a kernel needs of one tile of lanes. method, baumgarte: how accelerations are found.

    alike: whether all lanes have one mass matrix, whose factor is then alike_factor, (slots,).
    """

    home: Array
    gates: Gates

    unknowns: int
    force_rows: int
    held_rows: int
    rows: int
    method: int
    baumgarte: float
    projects: bool
    driven: bool
    derived: Derived
    pattern: sparse.Pattern
    mass: Array
    mass_factor: Array
    mass_root: Array
    alike: bool
    alike_factor: Array
    weight: Array
    elements: Elements
    forces: Forces
    applied: Applied
    functions: Functions
    constraints: Constraints
    saddle: Saddle


@njit(cache=True, error_model="numpy")
def raw(m: Arrays) -> Arrays:
    """The same numbers with pointers in place of arrays, for use inside the time loop."""
    d, e = m.derived, m.elements
    return Arrays(
        pointer(m.home),
        m.gates,
        m.unknowns,
        m.force_rows,
        m.held_rows,
        m.rows,
        m.method,
        m.baumgarte,
        m.projects,
        m.driven,
        Derived(pointer(d.start), pointer(d.source), pointer(d.coefficient), pointer(d.constant)),
        sparse.raw(m.pattern),
        pointer(m.mass),
        pointer(m.mass_factor),
        pointer(m.mass_root),
        m.alike,
        pointer(m.alike_factor),
        pointer(m.weight),
        Elements(
            ancf_cable.raw(e.cables_full),
            ancf_cable.raw(e.cables_reduced),
            beam.raw(e.cubics),
            beam.raw(e.quintics),
            ancf_full.raw(e.solids),
            ancf_full.raw(e.two_point_solids),
        ),
        forces.raw(m.forces),
        applied.raw(m.applied),
        functions.raw(m.functions),
        constraints.raw(m.constraints),
        saddle.raw(m.saddle),
    )


@njit(cache=True)
def _factor_mass(tile: Tile, pattern: sparse.Pattern, values: Array) -> None:
    sparse.factor(tile, sparse.raw(pattern), pointer(values))


@dataclass(frozen=True)
class Model:
    """A scene turned into numbers, for one or many lanes; never modified.

    q0, v0: initial coordinates and rates, (unknowns, lanes). Arrays of lane-dependent numbers are
    (rows, lanes) or (rows, 1). start_angles: relative angles at the start that angle forces count
    their turns from [rad], (forces, lanes) or (forces, 1). kinks: of every function, where it or a derivative jumps.
    owners: for each family of elements the body of every element. failed: lanes whose start contradicts the joints,
    (lanes,) or (1,). frames: how bodies hang on the coordinates.
    """

    scene: Scene
    failed: Flags
    frames: dict[str, Frame]
    lanes: int
    q0: Array
    v0: Array
    force_rows: int
    held_rows: int
    derived: Derived
    mass_entries: dict[tuple[int, int], Array]
    weight: Array
    elements: Elements
    owners: tuple[tuple[str, ...], ...]
    forces: Forces
    start_angles: Array
    applied: Applied
    functions: Functions
    kinks: tuple[Array, ...]
    constraints: Constraints
    constraint_names: tuple[str, ...]
    marker_rows: Index
    method: int
    baumgarte: float
    shared_tiles: dict[int, Arrays] = field(default_factory=dict, compare=False, repr=False)
    """Arrays by tile width, where no number but the initial state depends on the lane."""

    @property
    def varies(self) -> bool:
        """Whether lanes differ in more than their initial state."""
        d = self.derived
        numbers = [self.mass_values, self.weight, self.forces.law, self.applied.coefficient, self.applied.factor]
        numbers += [family.coefficients for family in self.elements]
        numbers += [self.constraints.factor, self.constraints.constant, self.constraints.coefficient]
        numbers += [d.coefficient, d.constant]
        return any(values.shape[1] > 1 for values in numbers)

    @property
    def unknowns(self) -> int:
        """Number of coordinates."""
        return len(self.q0)

    @property
    def rows(self) -> int:
        """Unknowns plus derived rows."""
        return self.unknowns + len(self.derived.start) - 1

    def function(self, number: int) -> Piecewise:
        """One of the functions."""
        first, last = self.functions.start[number : number + 2]
        breaks = self.functions.breaks[first + number : last + number + 1]
        coefficients = self.functions.coefficients.reshape(self.functions.start[-1], -1)
        return Piecewise(breaks, coefficients[first:last], self.kinks[number])

    @property
    def flexible(self) -> int:
        """Number of flexible elements."""
        return sum(family.size for family in self.elements)

    @property
    def elastic(self) -> bool:
        """Whether anything stores elastic energy."""
        return self.flexible > 0 or bool(np.any(self.forces.law[0::7])) or bool(np.any(self.forces.table >= 0))

    @cached_property
    def mass_pattern(self) -> tuple[sparse.Pattern, dict[tuple[int, int], int]]:
        """Pattern of the factor of the mass matrix."""
        return sparse.analyse(self.unknowns, self.mass_entries)

    @cached_property
    def mass_values(self) -> Array:
        """The mass matrix in its pattern, (slots, lanes) or (slots, 1)."""
        return scatter(*self.mass_pattern, self.mass_entries)

    @cached_property
    def _saddle_pattern(self) -> tuple[sparse.Pattern, dict[tuple[int, int], int], Index, Index]:
        return saddle.analyse(self.unknowns, self.mass_entries, self.constraints)

    def _saddle(self, packed: Callable[[Array], Array]) -> Saddle:
        """The sparse saddle point problem, where there are enough constraints to need it."""
        count = self.constraints.size
        none = np.zeros(0, dtype=np.int64)
        if count <= saddle.SMALL:
            return Saddle(0, 0, _EMPTY, none, np.zeros(0), none, none)
        pattern, slots, place, entries = self._saddle_pattern
        multiplier = np.zeros(len(place), dtype=np.int64)
        multiplier[place[self.unknowns :]] = 1
        return Saddle(
            len(place),
            pattern.slots,
            pattern,
            place,
            packed(scatter(pattern, slots, self.mass_entries)),
            entries,
            multiplier,
        )

    def tile(self, tile: Tile, lanes: slice) -> Arrays:
        """The arrays of one tile of lanes. Raises InputError if a mass matrix is singular."""
        if self.varies:
            return self._tile(tile, lanes)
        if len(tile) not in self.shared_tiles:
            self.shared_tiles[len(tile)] = self._tile(tile, lanes)
        return self.shared_tiles[len(tile)]

    def _tile(self, tile: Tile, lanes: slice) -> Arrays:
        def packed(values: Array) -> Array:
            return pack(values, lanes, tile)

        pattern, _ = self.mass_pattern
        mass = packed(self.mass_values)
        factor = mass.copy()
        _factor_mass(tile, pattern, factor)
        inverse = factor[: self.unknowns * len(tile)]
        if not np.all((inverse > 0) & np.isfinite(inverse)):
            raise InputError(f"{self.scene.name}: the mass matrix is singular; some coordinate moves no mass")
        d, c = self.derived, self.constraints
        e = self.elements
        return Arrays(
            gate.home(),
            Gates(0, 0, 0, 0),
            self.unknowns,
            self.force_rows,
            self.held_rows,
            self.rows,
            self.method,
            self.baumgarte,
            self.scene.solver.project,
            bool(np.any(self.constraints.drive >= 0)),
            Derived(d.start, d.source, packed(d.coefficient), packed(d.constant)),
            pattern,
            mass,
            factor,
            np.sqrt(inverse),
            self.mass_values.shape[1] == 1,
            np.ascontiguousarray(factor[:: len(tile)]),
            packed(self.weight),
            Elements(
                e.cables_full._replace(coefficients=packed(e.cables_full.coefficients)),
                e.cables_reduced._replace(coefficients=packed(e.cables_reduced.coefficients)),
                e.cubics._replace(coefficients=packed(e.cubics.coefficients), reference=packed(e.cubics.reference)),
                e.quintics._replace(
                    coefficients=packed(e.quintics.coefficients), reference=packed(e.quintics.reference)
                ),
                e.solids._replace(coefficients=packed(e.solids.coefficients)),
                e.two_point_solids._replace(coefficients=packed(e.two_point_solids.coefficients)),
            ),
            self.forces._replace(law=packed(self.forces.law)),
            self.applied._replace(coefficient=packed(self.applied.coefficient), factor=packed(self.applied.factor)),
            self.functions,
            c._replace(factor=packed(c.factor), constant=packed(c.constant), coefficient=packed(c.coefficient)),
            self._saddle(packed),
        )


_EMPTY, _ = sparse.analyse(0, [])


def scatter(pattern: sparse.Pattern, slot: dict[tuple[int, int], int], entries: dict[tuple[int, int], Array]) -> Array:
    """Values of a symmetric matrix in a pattern, (slots, lanes)."""
    lanes = max((np.size(value) for value in entries.values()), default=1)
    values = np.zeros((pattern.slots, lanes))
    for key, value in entries.items():
        values[slot[key]] = value
    return values
