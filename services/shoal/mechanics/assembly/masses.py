"""Mass matrix, weight, flexible elements and their stiffness against stretching, body by body."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.lifted import Lifted
from shoal.mechanics.assembly.rods import rod_axis
from shoal.mechanics.derived import RowAllocator
from shoal.mechanics.elements import FAMILIES, SPATIAL_FAMILIES
from shoal.mechanics.elements.families import Collected
from shoal.mechanics.elements.unstrained import unstrained
from shoal.mechanics.frames import BeamFrame, ModalFrame, PointFrame, RigidFrame
from shoal.mechanics.joints import Meet, conditions
from shoal.mechanics.numerics.tile import Array, Number
from shoal.scene import GROUND, Body, PointMass, RigidBody, Rod, Scene
from shoal.scene.dimensions import padded

ADDED = np.array([1e-8, 1e-5])
"""Of the inertia of slope and director, which a further axis of a section has so that the mass matrix is positive.

The first is for threads, whose constraints would seem dependent. Where an element is a thousand times as long as thick
it is the larger one, and changes a frequency of torsion by less than 1e-3.
"""
STATE = 1e-40
"""Mass of an unknown whose rate is a state of the user: so small that its energy is none."""
Entries = dict[tuple[int, int], Number]


class Masses:
    """Matrices as entries (row, column), row >= column, the weight by unknown, and the flexible elements.

    mass: the mass matrix; lent: added mass of thin bodies, see `_regularised`; flat: whether one of them is flat;
    stretching: of `Element.stretching`, of all rods, where their inertia is capped.
    """

    def __init__(self, scene: Scene, placement: Placement, rows: RowAllocator) -> None:
        self.scene, self.placement, self.rows = scene, placement, rows
        self.gravity = plane.vector(*padded(scene.gravity, scene.dimensions))
        self.mass: Entries = {}
        self.lent: Entries = {}
        self.flat = False
        self.stretching: Entries = {}
        self.weight: list[Number] = [0.0] * len(placement.positions)
        self.families = {kind: Collected() for kind in (FAMILIES if scene.dimensions == 2 else SPATIAL_FAMILIES)}
        for name, body in scene.bodies.items():
            self._add(name, body)
        for vector in placement.drivers.values():
            # The motion of a moving point of the ground is prescribed, so its mass is of no consequence.
            least = min(np.min(np.asarray(body.mass)) for body in scene.bodies.values())
            _add(self.mass, [vector], [[least]])
        for name, vector in placement.phases.items():
            rotor = getattr(scene.joints[name], "armature", 0.0)
            if np.any(rotor):
                _add(self.mass, [vector], [[rotor]])
        for one in placement.lifted:
            self._lift(one)
        for name in placement.terms.pressed:
            self._lend(name)
        for unknown in placement.states.values():
            self.mass[unknown, unknown] = STATE

    def _lift(self, one: Lifted) -> None:
        """Give unknowns of a measure a negligible mass, and an added one of a part of the lightest body's."""
        least: Number = np.inf
        for body in self.scene.bodies.values():
            size = body.mass
            if one.turns and not isinstance(body, PointMass):
                size = _turning(body, self.scene.dimensions)
            elif one.turns:
                continue
            least = np.minimum(least, np.asarray(size, dtype=float))
        least = least * one.lever**2
        for unknown in one.unknowns:
            known = self.mass.get((unknown, unknown), 0.0)  # that of a rotor
            self.mass[unknown, unknown] = np.maximum(known, THINNEST * least)
            if np.any(known < THIN * least):
                self.lent[unknown, unknown], self.flat = np.maximum(THIN * least - known, 0.0), True

    def _lend(self, name: str) -> None:
        """The place that a pin holds on the ground has its body's mass besides: it is at rest, so nothing else changes.

        A body without inertia would else move no mass by turning about its centre of mass.
        """
        for pin in conditions(self.scene.joints[name]):
            if isinstance(pin, Meet):
                sides = pin.first, pin.second
                free = [side for side in sides if side.body != GROUND]
                if len(free) == 1 and not any(isinstance(side.point, str) for side in sides if side.body == GROUND):
                    mass = self.scene.bodies[free[0].body].mass
                    _add(self.mass, [self.placement.point(self.scene, free[0])], [[mass]])

    def _add(self, name: str, body: Body) -> None:
        frame = self.placement.frames[name]
        if isinstance(frame, BeamFrame):
            assert isinstance(body, Rod)
            self._add_rod(name, body, frame)
        elif isinstance(frame, ModalFrame):
            moments = frame.modes.moments
            vectors = [*frame.vectors, *(vector.turned(plane.QUARTER) for vector in frame.vectors)]
            matrix = [[*np.real(row), *np.imag(row)] for row in moments]
            _add(self.mass, vectors, matrix)
            self._add_load(vectors, matrix[0])
        elif isinstance(frame, PointFrame):
            _add(self.mass, [frame.origin], [[body.mass]])
            self._add_load([frame.origin], [body.mass])
        else:
            assert isinstance(frame, RigidFrame)
            assert isinstance(body, Rod | RigidBody)
            if len(frame.directors) == 3:
                self._add_solid(body, frame)
                return
            x, y = body.centre_of_mass
            mx, my = body.mass * x, body.mass * y
            # Of the moments of second order the plane knows the sum only, as its directors turn together.
            inertia = body.inertia + body.mass * (x**2 + y**2)
            vectors = [frame.origin, *frame.directors]
            _add(self.mass, vectors, [[body.mass, mx, my], [mx, inertia, 0.0], [my, 0.0, 0.0]])
            self._add_load(vectors, [body.mass, mx, my])

    def _add_solid(self, body: Rod | RigidBody, frame: RigidFrame) -> None:
        """A rigid body in space, by its first and second moments along its directors."""
        mass, moments = body.mass, second_moments(body)
        x = padded(body.centre_of_mass, 3)
        rows = ([mass * x[k], *(moments[k][j] + mass * x[k] * x[j] for j in range(3))] for k in range(3))
        matrix = [[mass, *(mass * one for one in x)], *rows]
        vectors = [frame.origin, *frame.directors]
        _add(self.mass, vectors, matrix)
        lent, flat = _regularised(moments)
        self.flat = self.flat or flat
        _add(self.lent, list(frame.directors), lent)
        self._add_load(vectors, matrix[0])

    def _add_rod(self, name: str, rod: Rod, frame: BeamFrame) -> None:
        element = frame.element
        length = frame.element_length * np.ones(1) if np.ndim(frame.element_length) else frame.element_length
        nodes = [self._unstrained(rod, frame, node) for node in range(rod.elements + 1)]
        for number in range(rod.elements):
            if number == 0 or rod.tapered:
                middle = (number + 0.5) / rod.elements
                section, (density, heavy) = rod.section_at(middle), rod.masses_at(middle)
                masses = element.mass(density, heavy, length)
                weight = element.weight(density * heavy.area, length)
            vectors = frame.of_element(number)
            _add(self.mass, vectors, masses)
            if element.stretching is not None and self.scene.solver.caps_inertia:
                _add(self.stretching, vectors, element.stretching(rod.modulus * section.area, length))
            self._add_load(vectors, weight)
            for (node, _), vector in frame.axes.items():
                if node in (number, number + 1):
                    lent = sum(share * masses[k][k] for share, k in zip(ADDED, (-2, -1), strict=True))
                    _add(self.mass, [vector], [[lent]])
            part = element.part(rod, section, length, nodes[number] + nodes[number + 1])
            self.families[element.family].add(name, self.rows.of_all(vectors), part)

    def _unstrained(self, rod: Rod, frame: BeamFrame, node: int) -> list[Any]:
        """The nodal vectors of a rod at rest."""
        s = rod.length * node / rod.elements
        axis = plane.vector(*rod_axis(rod, s)) if self.scene.dimensions == 2 else unstrained(rod, s)[0]
        return [axis, *frame.element.nodal_vectors(rod, s)]

    def _add_load(self, vectors: list[Affine], masses: list[Number]) -> None:
        for vector, mass in zip(vectors, masses, strict=True):
            if vector.own:
                for unknown, g in zip(vector.own, self.gravity, strict=True):
                    self.weight[unknown] = self.weight[unknown] + mass * g
                continue
            for unknown, coefficient in vector.terms.items():
                force = sum(c * mass * g for c, g in zip(coefficient, self.gravity, strict=True))
                self.weight[unknown] = self.weight[unknown] + force

    def elements(self) -> tuple[Any, ...]:
        """The families as arrays."""
        return tuple(found.family(kind) for kind, found in self.families.items())

    def owners(self) -> tuple[tuple[str, ...], ...]:
        """The body of every element, by family."""
        return tuple(tuple(found.owners) for found in self.families.values())


def _turning(body: Body, dimensions: int) -> Number:
    """Return the least inertia of a rigid body about an axis, or the mass of a flexible one at half its length."""
    if dimensions == plane.DIMENSIONS or body.element != "rigid":
        return body.inertia if body.element == "rigid" else body.mass * (body.length / 2) ** 2  # type: ignore[union-attr]
    second = second_moments(body)  # type: ignore[arg-type]
    return sum(row[k] for k, row in enumerate(second))


THINNEST = 1e-11
"""Of the sum of the second moments: less has none of them, so that every director has inertia."""
THIN, FLAT = 1e-3, 1e-5
"""Of its second largest second moment: a body that has less as its smallest one is lent the rest up to the first. What
is below the second cannot do without to find accelerations."""


def second_moments(body: Rod | RigidBody) -> list[list[Number]]:
    """The integral of x_i x_j dm about the centre of mass along the axes of a body in space [kg m^2].

    J = tr(I)/2 - I of the inertia I. A rod has about its own axis the inertia of its sections, m (h^2 + w^2)/12 of a
    rectangle. About the two others it has m (L^2 + w^2)/12 and m (L^2 + h^2)/12, or without rotary inertia m L^2/12, as
    in the plane, where it is so much longer than thick that a body can have both.
    """
    if isinstance(body, Rod):
        across, wide = body.section_inertia
        if not body.rotary_inertia:
            across = wide = (across + wide) / 2
        matrix = [[body.inertia - across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, wide]]
    else:
        inertia = body.inertia_matrix
        half = sum(inertia[k][k] for k in range(3)) / 2
        matrix = [[half * (i == j) - inertia[i][j] for j in range(3)] for i in range(3)]
    moments, axes = _principal(matrix)
    for k in range(2):
        missing = np.maximum(THINNEST * np.sum(moments, axis=-1) - moments[..., k], 0.0)
        if np.any(missing):
            more = _along(axes[..., k], missing)
            matrix = [[matrix[i][j] + more[i][j] for j in range(3)] for i in range(3)]
    return matrix


def _regularised(matrix: list[list[Number]]) -> tuple[list[list[Number]], bool]:
    """Regularise the mass of a thin body: the added second moment across its plane [kg m^2], and whether it is flat.

    The motion of the director there follows from the other two. Without inertia of its own, constraints on it would be
    nearly dependent in the metric of the mass matrix. The added mass is compensated: in accelerations of flat bodies by
    iterative refinement (`least.lent`), in implicit steps by their iteration.
    """
    moments, axes = _principal(matrix)
    least, middle = moments[..., 0], moments[..., 1]
    return _along(axes[..., 0], np.maximum(THIN * middle - least, 0.0)), bool(np.any(least < FLAT * middle))


def _principal(matrix: list[list[Number]]) -> tuple[Array, Array]:
    """Principal second moments from the smallest on, (..., 3), and their axes as columns, (..., 3, 3)."""
    entries = np.stack(np.broadcast_arrays(*(entry for row in matrix for entry in row)), -1)
    return np.linalg.eigh(entries.reshape(*entries.shape[:-1], 3, 3))


def _along(axis: Array, moment: Array) -> list[list[Number]]:
    """The matrix of a second moment along an axis, (..., 3)."""
    return [[moment * axis[..., i] * axis[..., j] for j in range(3)] for i in range(3)]


def _add(entries: Entries, vectors: list[Affine], matrix: list[list[Number]]) -> None:
    """Add T' M T for the body's vectors = T q, in which it has the quadratic form 1/2 sum M_ab v_a . v_b.

    Of a matrix with fewer rows the others are zero; T' M T must be symmetric, not M.
    """
    for left, row in zip(vectors, matrix, strict=False):
        for right, weight in zip(vectors, row, strict=True):
            if _vanishes(weight):
                continue
            if left.own and right.own:
                for i, j in zip(left.own, right.own, strict=True):
                    if i >= j:
                        entries[i, j] = entries.get((i, j), 0.0) + weight
                continue
            for i, ci in left.terms.items():
                for j, cj in right.terms.items():
                    if i >= j:
                        value = sum(a * weight * b for a, b in zip(ci, cj, strict=True))
                        if i == j or not _vanishes(value):
                            entries[i, j] = entries.get((i, j), 0.0) + value


def _vanishes(value: Number) -> bool:
    """Return whether a number is zero, in all lanes."""
    return not value if isinstance(value, float) else not np.any(value)
