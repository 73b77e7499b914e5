"""Scene -> Model: numbered coordinates and the arrays that the compiled kernels work on.

The rows of a state are the unknowns q, then rows derived from them (points and directions of
bodies that do not own the coordinates; first those that forces act on, then those of markers).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.errors import InputError
from shoal.mechanics import constraints, friction, sparse
from shoal.mechanics.affine import Affine, Number, fixed
from shoal.mechanics.constraints import Constraints, Terms
from shoal.mechanics.elements import ancf_cable
from shoal.mechanics.elements.ancf_cable import AncfCables
from shoal.mechanics.friction import Frictions
from shoal.mechanics.placement import Placement, RigidFrame, as_complex, place
from shoal.mechanics.tile import Array, Index, Tile, pack
from shoal.mechanics.vector import pointer
from shoal.scene import GROUND, Rod, Scene


class Derived(NamedTuple):
    """Row r (after the unknowns): constant[r] + sum of coefficient[t] z[source[t]] over start[r] <= t < start[r+1]."""

    start: Index
    source: Index
    coefficient: Array
    constant: Array


class Arrays(NamedTuple):
    """All a kernel needs of one tile of lanes."""

    unknowns: int
    force_rows: int
    rows: int
    derived: Derived
    pattern: sparse.Pattern
    mass: Array
    mass_factor: Array
    weight: Array
    cables_full: AncfCables
    cables_reduced: AncfCables
    frictions: Frictions
    constraints: Constraints


@njit(cache=True, error_model="numpy")
def raw(m: Arrays) -> Arrays:
    """The same numbers with pointers in place of arrays, for use inside the time loop."""
    d = m.derived
    return Arrays(
        m.unknowns,
        m.force_rows,
        m.rows,
        Derived(pointer(d.start), pointer(d.source), pointer(d.coefficient), pointer(d.constant)),
        sparse.raw(m.pattern),
        pointer(m.mass),
        pointer(m.mass_factor),
        pointer(m.weight),
        ancf_cable.raw(m.cables_full),
        ancf_cable.raw(m.cables_reduced),
        friction.raw(m.frictions),
        constraints.raw(m.constraints),
    )


@njit(cache=True)
def _factor_mass(tile: Tile, pattern: sparse.Pattern, values: Array) -> None:
    sparse.factor(tile, sparse.raw(pattern), pointer(values))


@dataclass(frozen=True)
class Model:
    """A scene turned into numbers, for one or many lanes; never modified.

    q0, v0: initial coordinates and rates, (unknowns, lanes). Arrays of lane-dependent numbers are
    (rows, lanes) or (rows, 1).
    """

    scene: Scene
    lanes: int
    q0: Array
    v0: Array
    force_rows: int
    derived: Derived
    mass_entries: dict[tuple[int, int], Array]
    weight: Array
    cables_full: AncfCables
    cables_reduced: AncfCables
    frictions: Frictions
    constraints: Constraints
    constraint_names: tuple[str, ...]
    marker_rows: Index
    shared_tiles: dict[int, Arrays] = field(default_factory=dict, compare=False, repr=False)
    """Arrays by tile width, where no number but the initial state depends on the lane."""

    @property
    def varies(self) -> bool:
        """Whether lanes differ in more than their initial state."""
        d = self.derived
        numbers = (self.mass_values, self.weight, self.cables_full.coefficients, self.cables_reduced.coefficients)
        others = (self.frictions.coefficient, self.constraints.value, d.coefficient, d.constant)
        return any(values.shape[1] > 1 for values in (*numbers, *others))

    @property
    def unknowns(self) -> int:
        """Number of coordinates."""
        return len(self.q0)

    @property
    def rows(self) -> int:
        """Unknowns plus derived rows."""
        return self.unknowns + len(self.derived.start) - 1

    @property
    def elements(self) -> int:
        """Number of flexible elements."""
        return self.cables_full.size + self.cables_reduced.size

    @cached_property
    def mass_pattern(self) -> tuple[sparse.Pattern, dict[tuple[int, int], int]]:
        """Pattern of the factor of the mass matrix."""
        return sparse.analyse(self.unknowns, self.mass_entries)

    @cached_property
    def mass_values(self) -> Array:
        """The mass matrix in its pattern, (slots, lanes) or (slots, 1)."""
        return scatter(*self.mass_pattern, self.mass_entries)

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
        return Arrays(
            self.unknowns,
            self.force_rows,
            self.rows,
            Derived(d.start, d.source, packed(d.coefficient), packed(d.constant)),
            pattern,
            mass,
            factor,
            packed(self.weight),
            self.cables_full._replace(coefficients=packed(self.cables_full.coefficients)),
            self.cables_reduced._replace(coefficients=packed(self.cables_reduced.coefficients)),
            self.frictions._replace(coefficient=packed(self.frictions.coefficient)),
            c._replace(value=packed(c.value)),
        )


def scatter(pattern: sparse.Pattern, slot: dict[tuple[int, int], int], entries: dict[tuple[int, int], Array]) -> Array:
    """Values of a symmetric matrix in a pattern, (slots, lanes)."""
    lanes = max((np.size(value) for value in entries.values()), default=1)
    values = np.zeros((pattern.slots, lanes))
    for key, value in entries.items():
        values[slot[key]] = value
    return values


def with_start(model: Model, scene: Scene, lanes: int) -> Model:
    """The same model with the initial state of a scene that differs in nothing else."""
    placement = place(scene)
    q0, v0 = _real_pairs(placement.positions), _real_pairs(placement.velocities)
    return replace(model, scene=scene, lanes=lanes, q0=q0, v0=v0)


def build(scene: Scene, lanes: int = 1) -> Model:
    """Assemble the model of a scene whose numbers may be arrays over lanes. Raises InputError."""
    placement = place(scene)
    rows = _Rows(len(placement.positions))
    mass: dict[tuple[int, int], Number] = {}
    weight = [0.0 + 0.0j] * len(placement.positions)
    cables: dict[str, tuple[list[list[int]], list[Number]]] = {"full": ([], []), "reduced": ([], [])}
    gravity = as_complex(scene.gravity)
    for name, body in scene.bodies.items():
        frame = placement.frames[name]
        if isinstance(frame, RigidFrame):
            c = as_complex(body.centre_of_mass)
            inertia = body.inertia + body.mass * np.abs(c) ** 2
            vectors = [frame.origin, frame.axis]
            _add_mass(mass, vectors, [[body.mass, body.mass * c], [body.mass * np.conj(c), inertia]])
            _add_load(weight, vectors, [body.mass * gravity, body.mass * np.conj(c) * gravity])
        else:
            assert isinstance(body, Rod)
            length = np.asarray(frame.element_length)
            matrix = ancf_cable.mass_matrix(body.mass_per_length, length)
            load = [part * gravity for part in ancf_cable.weight(body.mass_per_length, length)]
            numbers = ancf_cable.coefficients(length, body.axial_stiffness, body.bending_stiffness)
            family = cables[body.quadrature]
            for number in range(body.elements):
                vectors = frame.element(number)
                _add_mass(mass, vectors, matrix)
                _add_load(weight, vectors, load)
                family[0].append([row for vector in vectors for row in rows.of(vector)])
                family[1].extend(numbers)
    friction_rows, friction_values = [], []
    for joint in scene.joints.values():
        if np.any(joint.friction):
            directions = [
                fixed(1.0)
                if side.body == GROUND
                else placement.frames[side.body].direction(as_complex(scene.location(side)))
                for side in (joint.first, joint.second)
            ]
            friction_rows.append([row for direction in directions for row in rows.of(direction)])
            friction_values.append(joint.friction)
    force_rows = rows.count
    marker_rows = []
    for marker in scene.markers.values():
        frame, p = placement.frames[marker.body], as_complex(scene.location(marker))
        marker_rows.append([*rows.of(frame.point(p)), *rows.of(frame.direction(p))])
    terms = _constraint_terms(placement)
    return Model(
        scene=scene,
        lanes=lanes,
        q0=_real_pairs(placement.positions),
        v0=_real_pairs(placement.velocities),
        force_rows=force_rows,
        derived=rows.derived(),
        mass_entries=_real_entries(mass),
        weight=_real_pairs(weight),
        cables_full=_cable_family(cables["full"]),
        cables_reduced=_cable_family(cables["reduced"]),
        frictions=Frictions(len(friction_rows), _index(friction_rows).ravel(), _stack(friction_values)),
        constraints=Constraints(
            len(terms.names), _index(terms.start), _index(terms.first), _index(terms.second), _stack(terms.values)
        ),
        constraint_names=tuple(terms.names),
        marker_rows=_index(marker_rows),
    )


def _constraint_terms(placement: Placement) -> Terms:
    terms = Terms()
    for name, vector in placement.unit_vectors:
        terms.unit_length(name, vector)
    for name, gap in placement.closures:
        terms.vanish(name, gap)
    return terms


class _Rows:
    """Hands out the rows of vectors: a pair's own, or derived ones."""

    def __init__(self, pairs: int) -> None:
        self.count = 2 * pairs
        self._vectors: list[Affine] = []
        self._known: dict[int, tuple[int, int]] = {}

    def of(self, vector: Affine) -> tuple[int, int]:
        """Rows of x and y of a vector."""
        if vector.pair is not None:
            return 2 * vector.pair, 2 * vector.pair + 1
        if id(vector) not in self._known:
            self._known[id(vector)] = (self.count, self.count + 1)
            self._vectors.append(vector)
            self.count += 2
        return self._known[id(vector)]

    def derived(self) -> Derived:
        """All derived rows handed out so far."""
        start, source = [0], []
        coefficients: list[Number] = []
        constants: list[Number] = []
        for vector in self._vectors:
            for part in (np.real, np.imag):
                for pair, c in vector.terms.items():
                    x, y = (np.real(c), -np.imag(c)) if part is np.real else (np.imag(c), np.real(c))
                    for row, coefficient in ((2 * pair, x), (2 * pair + 1, y)):
                        if np.any(coefficient):
                            source.append(row)
                            coefficients.append(coefficient)
                start.append(len(source))
                constants.append(part(vector.constant))
        return Derived(_index(start), _index(source), _stack(coefficients), _stack(constants))


def _add_mass(mass: dict[tuple[int, int], Number], vectors: list[Affine], matrix: list[list[Number]]) -> None:
    """Add T^H M T for the body coordinates `vectors` = T q, T = 1/2 sum conj(v_a) M_ab v_b."""
    for a, left in enumerate(vectors):
        for b, right in enumerate(vectors):
            for i, ci in left.terms.items():
                for j, cj in right.terms.items():
                    if i >= j:
                        mass[i, j] = mass.get((i, j), 0.0) + np.conj(ci) * matrix[a][b] * cj


def _add_load(load: list[Number], vectors: list[Affine], forces: list[Number]) -> None:
    for vector, force in zip(vectors, forces, strict=True):
        for pair, coefficient in vector.terms.items():
            load[pair] = load[pair] + np.conj(coefficient) * force


def _real_entries(mass: dict[tuple[int, int], Number]) -> dict[tuple[int, int], Array]:
    """Real lower-triangle entries of a Hermitian matrix of pairs."""
    entries: dict[tuple[int, int], Array] = {}
    for (i, j), h in mass.items():
        real, imag = np.real(h), np.imag(h)
        entries[2 * i, 2 * j] = real
        entries[2 * i + 1, 2 * j + 1] = real
        if np.any(imag) and i != j:
            entries[2 * i, 2 * j + 1] = -imag
            entries[2 * i + 1, 2 * j] = imag
    return entries


def _real_pairs(pairs: Iterable[Number]) -> Array:
    return _stack([part for value in pairs for part in (np.real(value), np.imag(value))])


def _stack(values: list[Number]) -> Array:
    """One row per value, (rows, lanes), or (rows, 1) if no value depends on the lane."""
    lanes = max((np.size(value) for value in values), default=1)
    out = np.empty((len(values), lanes))
    for row, value in enumerate(values):
        out[row] = value
    return out


def _index(values: list[int] | list[list[int]]) -> Index:
    return np.array(values, dtype=np.int64)


def _cable_family(family: tuple[list[list[int]], list[Number]]) -> AncfCables:
    return AncfCables(len(family[0]), _index(family[0]).ravel(), _stack(family[1]))
