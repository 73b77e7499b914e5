"""The model: numbered coordinates and the arrays that the compiled kernels work on.

The rows of a state are the unknowns q, then rows derived from them (points and directions of
bodies that do not own the coordinates; first those that forces act on, then those that constraints
hold, then those of markers).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from shoal.compile import structures
from shoal.compile.pointers import pointer, raw
from shoal.errors import InputError
from shoal.mechanics import saddle
from shoal.mechanics.affine import Affine
from shoal.mechanics.applied import Applied
from shoal.mechanics.constraints import Constraints
from shoal.mechanics.derived import Derived
from shoal.mechanics.elements.families import lay
from shoal.mechanics.forces import LAW, STIFFNESS, Forces
from shoal.mechanics.frames import Frame, ModalFrame
from shoal.mechanics.functions import Functions, Piecewise
from shoal.mechanics.gaps import Gaps
from shoal.mechanics.independent import independent_rows
from shoal.mechanics.numerics import alike, sparse
from shoal.mechanics.numerics.alike import Alike
from shoal.mechanics.numerics.row_pairs import paired
from shoal.mechanics.numerics.tile import SINGLE, Array, Flags, Index, Tile, pack, packed, stacked, varies
from shoal.mechanics.rubbing import Rubbing
from shoal.mechanics.saddle import Saddle
from shoal.mechanics.signals import Signals
from shoal.scene import Scene
from shoal.scene.joints import places
from shoal.scene.sampled import Clock


class FunctionTable(NamedTuple):
    """Addresses of the compiled `kernels` for one tile; 0 for a kernel that the model never calls.

    families: their number. force, energy, mean: by family of elements; mean: of those that know the exact mean force
    of a step. sought: what seeks accelerations in place of `least`.
    """

    motion: int
    energies: int
    constrain: int
    least: int
    settle: int
    look: int
    contact: int
    hold: int
    decide: int
    signals: int
    families: int
    force: Index
    energy: Index
    mean: Index
    sought: int = 0


class Arrays(NamedTuple):
    """All a kernel needs of one tile of lanes. dimensions: of vectors.

    method, baumgarte: how accelerations are found. mass_factor, mass_root: of the regularised mass matrix; lent: the
    mass added to flat bodies, empty where none is; refinements: iterations that compensate it, see `least.lent`.
    families: the elements as kernels read them, `families.lay`. alike: the mass matrix where all lanes have the same
    one. elements: one structure a family; followed: the signals, and `signals` as their kernel reads them; kernels do
    not see elements and followed, see `seen`.
    """

    storage: Array
    table: FunctionTable
    unknowns: int
    force_rows: int
    held_rows: int
    rows: int
    method: int
    baumgarte: float
    projects: bool
    driven: bool
    damped: bool
    gives: bool
    derived: Derived
    pattern: sparse.Pattern
    mass: Array
    mass_factor: Array
    mass_root: Array
    lent: Array
    refinements: int
    alike: Alike
    weight: Array
    functions: Functions
    constraints: Constraints
    saddle: Saddle
    rubbing: Rubbing
    dimensions: int
    forces: Forces
    applied: Applied
    gaps: Gaps
    families: Array
    signals: Array
    elements: tuple[Any, ...]
    followed: Any


def seen(arrays: Arrays) -> Arrays:
    """Return what kernels see, which has one type for all models: families of elements are called by addresses."""
    return arrays._replace(elements=(), followed=())


@njit(cache=True)
def _factor_mass(tile: Tile, pattern: sparse.Pattern, values: Array) -> None:
    sparse.factor(tile, raw(pattern), pointer(values))


@dataclass(frozen=True)
class Model:
    """A scene turned into numbers, for one or many lanes; never modified.

    q0, v0: initial coordinates and rates, (unknowns, lanes). Arrays of lane-dependent numbers are
    (rows, lanes) or (rows, 1). start_angles: relative angles at the start that angle forces count
    their turns from [rad], (forces, lanes) or (forces, 1); gap_angles, signal_angles: the same of gaps and of signals;
    gap_fields, signal_fields: what states them; signal_names: of the constants of signals; probed: numbers of the
    strengths that formulas beside those of loads are. clocks: instants of samples, and a field that follows each;
    sampled: names of what is sampled, by number. kinks: of every function, where it or a derivative jumps.
    owners: for each family of elements the body of every element. failed: lanes whose start contradicts the joints,
    (lanes,) or (1,). frames: kinematics of the bodies. mass_entries, lent_entries, stretching_entries: the lower
    triangles of the mass matrix, of the mass added to thin bodies, and of the rods' stiffness against stretching, see
    `Element`; the last is empty where it is not needed. flat: whether accelerations need the added mass. stated: the
    scene as it was given, in whose order the coordinates are numbered; scene: with the start that agrees with its
    joints. slowed: axial modes whose inertia is raised, see `inertia_cap`. marker_angles: directions of the markers at
    a start that the scene does not state, counted over full turns [rad], (markers, lanes) or (markers, 1).
    """

    scene: Scene
    stated: Scene
    dimensions: int
    failed: Flags
    frames: dict[str, Frame]
    lanes: int
    q0: Array
    v0: Array
    force_rows: int
    held_rows: int
    derived: Derived
    mass_entries: dict[tuple[int, int], Array]
    lent_entries: dict[tuple[int, int], Array]
    flat: bool
    stretching_entries: dict[tuple[int, int], Array]
    weight: Array
    elements: tuple[Any, ...]
    owners: tuple[tuple[str, ...], ...]
    forces: Forces
    start_angles: Array
    applied: Applied
    gaps: Gaps
    gap_fields: tuple[str, ...]
    gap_angles: Array
    functions: Functions
    kinks: tuple[Array, ...]
    constraints: Constraints
    constraint_names: tuple[str, ...]
    marker_rows: Index
    method: int
    baumgarte: float
    rubbing: Rubbing
    signals: Signals | tuple[()]
    signal_angles: Array
    signal_fields: tuple[str, ...]
    signal_names: tuple[str, ...]
    recorded: tuple[str, ...]
    clocks: tuple[tuple[Clock, str], ...]
    sampled: tuple[str, ...]
    probed: tuple[int, ...]
    slowed: int = 0
    marker_angles: Array | None = None
    tensions: dict[str, list[int]] = field(default_factory=dict, compare=False)
    """Of ropes that keep their length exactly, the constraints that keep it."""
    rope_places: dict[str, tuple[Affine, ...]] = field(default_factory=dict, compare=False)
    """Of ropes, the places that they go over, ends included."""
    spans: tuple[tuple[str, int], ...] = ()
    """Lengths that may not vanish, by their joint and unknown."""
    shared_tiles: dict[int, Arrays] = field(default_factory=dict, compare=False, repr=False)
    """Arrays by tile width, where no number but the initial state depends on the lane."""

    @property
    def varies(self) -> bool:
        """Return whether lanes differ in more than their initial state."""
        parts = self.derived, self.elements, self.forces, self.applied, self.gaps, self.constraints, self.rubbing
        return varies((self.mass_values, self.weight, *parts, self.signals))

    @property
    def unknowns(self) -> int:
        """Number of coordinates."""
        return len(self.q0)

    @property
    def rows(self) -> int:
        """Unknowns plus derived rows."""
        return self.unknowns + len(self.derived.start) - 1

    def differs_in_start_only(self, other: Model) -> bool:
        """Return whether another model is the same but for its start and its lanes."""
        names = (one.name for one in fields(self) if one.compare and one.name not in _OF_START)
        return all(_equal(getattr(self, name), getattr(other, name)) for name in names)

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
    def modal(self) -> bool:
        """Return whether any body bends by modes."""
        return any(isinstance(frame, ModalFrame) for frame in self.frames.values())

    @property
    def elastic(self) -> bool:
        """Return whether anything stores elastic energy."""
        return (
            self.flexible > 0 or bool(np.any(self.forces.law[STIFFNESS::LAW])) or bool(np.any(self.forces.table >= 0))
        )

    @cached_property
    def metric_entries(self) -> dict[tuple[int, int], Array]:
        """Return the lower triangle of the regularised mass matrix."""
        lent = self.lent_entries
        return self.mass_entries | {key: self.mass_entries.get(key, 0.0) + more for key, more in lent.items()}

    @property
    def _factored(self) -> dict[tuple[int, int], Array]:
        """Return the matrix that is factored for accelerations."""
        return self.metric_entries if self.flat else self.mass_entries

    @cached_property
    def mass_pattern(self) -> tuple[sparse.Pattern, dict[tuple[int, int], int]]:
        """Pattern of the factor of the mass matrix."""
        return sparse.analyse(self.unknowns, self._factored)

    @cached_property
    def mass_values(self) -> Array:
        """The mass matrix in its pattern, (slots, lanes) or (slots, 1)."""
        return scatter(*self.mass_pattern, self.mass_entries)

    @cached_property
    def _saddle(self) -> Saddle:
        """The sparse saddle point problem."""
        none, c = np.zeros(0, dtype=np.int64), self.constraints
        rows: Index | None = np.arange(c.size)
        if 0 < c.size <= saddle.FEW:
            rows = independent_rows(c, self.derived, self.q0[:, 0])
        if c.size == 0 or rows is None:
            return Saddle(0, 0, False, _EMPTY, 0, none, none, np.zeros((0, 1)), 0, none, none, none)
        pattern, slots, place, entries = saddle.analyse(self.unknowns, self._factored, c, rows)
        multiplier = np.zeros(len(place), dtype=np.int64)
        multiplier[place[self.unknowns :]] = 1
        base, many = scatter(pattern, slots, self._factored), c.size > saddle.SMALL and len(rows) == c.size
        entry = np.concatenate([np.arange(c.entry[k], c.entry[k + 1]) for k in rows])
        numbers = len(rows), rows, place, base, len(entry), entry, entries
        return Saddle(len(place), pattern.slots, many, pattern, *numbers, multiplier)

    @cached_property
    def _alike(self) -> Alike:
        """Return the solver of all lanes, where they have the same mass matrix."""
        if self.mass_values.shape[1] > 1:
            return Alike(0, _EMPTY, np.zeros(0), paired(_EMPTY, np.zeros(0)), np.zeros(0))
        components, entries = alike.analyse(self.unknowns, self.dimensions, self.mass_entries)
        size = self.unknowns // components
        pattern, slots = sparse.analyse(size, entries)
        matrix = scatter(pattern, slots, entries)[:, 0]
        factor = matrix.copy()
        _factor_mass(SINGLE, pattern, factor)
        dense = sparse.dense(pattern, matrix) if size <= alike.FEW else np.zeros((0, 0))
        return Alike(components, pattern, matrix, paired(pattern, factor), alike.spread_inverse(dense, components))

    def _singular(self, weightless: set[int]) -> InputError:
        """Return the error for unknowns without mass."""
        bodies = [name for name, frame in self.frames.items() if any(weightless & {*v.terms} for v in frame.vectors)]
        dry = [name for name, joint in self.scene.joints.items()
               if np.any(getattr(joint, "mu", 0.0)) and any(side.body in bodies for side in places(joint))]  # fmt: skip
        advice = f", or leave out joints.{dry[0]}.mu, for which its places have coordinates of their own" if dry else ""
        return InputError(
            f"{self.scene.name}: the mass matrix is singular; some coordinate of {', '.join(bodies)} moves no mass: "
            f"state a larger bodies.{(bodies or ['<name>'])[0]}.inertia{advice}"
        )

    def tile(self, tile: Tile, lanes: slice) -> Arrays:
        """The arrays of one tile of lanes. Raises InputError if a mass matrix is singular."""
        if self.varies:
            return self._tile(tile, lanes)
        if len(tile) not in self.shared_tiles:
            self.shared_tiles[len(tile)] = self._tile(tile, lanes)
        return self.shared_tiles[len(tile)]

    def _tile(self, tile: Tile, lanes: slice) -> Arrays:
        pattern, slots = self.mass_pattern
        mass = pack(self.mass_values, lanes, tile)
        lent = pack(scatter(pattern, slots, self.lent_entries), lanes, tile) if self.flat else np.zeros(0)
        metric = mass + lent if self.flat else mass
        factor = metric.copy()
        _factor_mass(tile, pattern, factor)
        inverse, whole = (part[: self.unknowns * len(tile)] for part in (factor, metric))
        known = (inverse > 0) & np.isfinite(inverse)
        weightless = ~known | (np.where(known, inverse, 0.0) * whole >= _SINGULAR)
        if np.any(weightless):
            raise self._singular({*(np.flatnonzero(weightless) // len(tile)).tolist()})
        parts = self.functions, self.constraints, self._saddle, self.rubbing, self.dimensions
        elements, nobody = packed(self.elements, lanes, tile), np.zeros(len(self.elements), dtype=np.int64)
        own: tuple[Any, ...] = packed((*parts, self.forces, self.applied, self.gaps), lanes, tile)
        followed = packed(self.signals, lanes, tile)
        return Arrays(
            structures.storage(),
            FunctionTable(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, len(nobody), nobody, nobody, nobody),
            self.unknowns,
            self.force_rows,
            self.held_rows,
            self.rows,
            self.method,
            self.baumgarte,
            self.scene.solver.project,
            bool(np.any(self.constraints.drive >= 0)),
            any(family.damped for family in self.elements),
            bool(np.any(self.gaps.soft)),
            packed(self.derived, lanes, tile),
            pattern,
            mass,
            factor,
            np.sqrt(inverse),
            lent,
            REFINEMENTS if self.flat else 0,
            self._alike,
            pack(self.weight, lanes, tile),
            *(*own, lay(elements), laid(followed), elements, followed),
        )


def laid(structure: Any) -> Array:
    """Write a structure as kernels read it; nothing for none. Its arrays must outlive the use."""
    if not structure:
        return np.zeros(0)
    place = structures.storage()
    structures.write(place, structure)
    return place


def _equal(one: Any, other: Any) -> bool:
    """Return whether two structures hold equal numbers, whether stated by lane or for all lanes."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        by_lane = one.ndim == other.ndim == 2 and 1 in (one.shape[1], other.shape[1])
        return one.shape[: 1 if by_lane else None] == other.shape[: 1 if by_lane else None] and bool(
            np.all(one == other)
        )
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(_equal, one, other))
    if isinstance(one, dict) and isinstance(other, dict):  # entries of a matrix
        return one.keys() == other.keys() and _equal(*(stacked([each[key] for key in one]) for each in (one, other)))
    return bool(one == other)


_OF_START = (
    "scene",
    "stated",
    "failed",
    "frames",
    "lanes",
    "q0",
    "v0",
    "start_angles",
    "gap_angles",
    "signal_angles",
    "marker_angles",
)
"""Fields of a model that its start decides, with the frames, whose numbers its arrays hold."""
REFINEMENTS = 4
"""Each leaves the part `masses.THIN` of what there was to take back, so that round-off is left."""
_SINGULAR = 1e14
"""Mass that a coordinate moves over what others do not move already: beyond it is round-off."""
_EMPTY, _ = sparse.analyse(0, [])


def scatter(pattern: sparse.Pattern, slot: dict[tuple[int, int], int], entries: dict[tuple[int, int], Array]) -> Array:
    """Values of a symmetric matrix in a pattern, (slots, lanes)."""
    lanes = max((np.size(value) for value in entries.values()), default=1)
    values = np.zeros((pattern.slots, lanes))
    for key, value in entries.items():
        values[slot[key]] = value
    return values
