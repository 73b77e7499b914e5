"""Scene -> Model: masses, loads, elements, forces and constraints on the coordinates that the placement gave."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import fitting, functions
from shoal.mechanics.applied import Applied
from shoal.mechanics.assembly.affine import Affine, Number
from shoal.mechanics.assembly.frames import BeamFrame, PointFrame, RigidFrame
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.assembly.placement import Placement, place
from shoal.mechanics.assembly.pose import as_complex, unit
from shoal.mechanics.elements import ELEMENTS, ancf_cable, ancf_full, beam
from shoal.mechanics.elements.ancf_cable import AncfCables
from shoal.mechanics.elements.ancf_full import AncfFull
from shoal.mechanics.elements.beam import Beams
from shoal.mechanics.forces import ANGLE, DISTANCE, PLACE, Forces
from shoal.mechanics.functions import Piecewise
from shoal.mechanics.least import constraints, gauss
from shoal.mechanics.model import Derived, Elements, Model
from shoal.mechanics.numerics.tile import Array, Index
from shoal.scene import (
    GROUND,
    Attachment,
    DistributedForce,
    Force,
    Function,
    PointMass,
    Revolute,
    RigidBody,
    Rod,
    Scene,
    Slider,
    Spring,
    Torque,
    TorsionSpring,
)


def with_start(model: Model, scene: Scene, lanes: int) -> Model:
    """The same model with the initial state of a scene that differs in nothing else."""
    placement = place(scene)
    scene = placement.scene
    return replace(
        model,
        scene=scene,
        failed=placement.failed,
        lanes=lanes,
        q0=_stack(placement.positions),
        v0=_stack(placement.velocities),
        start_angles=_stack(_Loads(scene, placement, _Rows(0), 0.0).angles),
    )


def build(scene: Scene, lanes: int = 1, horizon: float = 0.0) -> Model:
    """Assemble the model of a scene whose numbers may be arrays over lanes. Raises InputError.

    horizon [s]: functions of time are fitted up to it, and at least up to the end of the scene's duration.
    """
    placement = place(scene)
    scene = placement.scene
    horizon = max(horizon, scene.solver.duration)
    rows = _Rows(len(placement.positions))
    masses = _Masses(scene, placement, rows)
    for name, body in scene.bodies.items():
        masses.add(name, body)
    for pair in placement.drivers.values():
        masses.add_driver(pair)
    loads = _Loads(scene, placement, rows, horizon)
    force_rows = rows.size
    terms = placement.terms
    held = constraints.assemble(terms, rows.of, _stack, len(loads.fitted))
    for one in terms.held:
        if one.drive is not None:
            stated = f"joints.{one.name}" if one.name in scene.joints else one.name.replace(GROUND, "ground_points", 1)
            with _naming(stated):
                fitting.require_no_jump(one.drive.function, horizon)
                loads.fitted.append(fitting.fit(one.drive, horizon, one.drive.knots, steep=False))
    held_rows = rows.size
    marker_rows = []
    for marker in scene.markers.values():
        point, direction = placement.point(scene, marker), placement.direction(scene, marker)
        marker_rows.append([*rows.of(point), *rows.of(direction)])
    return Model(
        scene=scene,
        failed=placement.failed,
        frames=placement.frames,
        lanes=lanes,
        q0=_stack(placement.positions),
        v0=_stack(placement.velocities),
        force_rows=force_rows,
        held_rows=held_rows,
        derived=rows.derived(),
        mass_entries=masses.entries,
        weight=_stack(masses.weight),
        elements=masses.elements(),
        owners=masses.owners(),
        forces=loads.forces(),
        start_angles=_stack(loads.angles),
        applied=loads.applied(),
        functions=functions.pack(loads.fitted),
        kinks=tuple(one.kinks for one in loads.fitted),
        constraints=held,
        constraint_names=tuple(one.name for one in terms.held),
        marker_rows=_index(marker_rows),
        method=gauss.METHODS.get(scene.solver.acceleration, gauss.PROJECTION),
        baumgarte=scene.solver.baumgarte,
    )


@contextmanager
def _naming(field: str) -> Iterator[None]:
    """Name the field in what is said of its function."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{field}: {str(error).removeprefix('function: ')}") from None


class _Rows:
    """Hands out the rows of vectors: a pair's own, or derived ones."""

    def __init__(self, unknowns: int) -> None:
        self.size = unknowns
        self._vectors: list[Affine] = []
        self._known: dict[int, tuple[int, int]] = {}

    def of(self, vector: Affine) -> tuple[int, int]:
        """Rows of x and y of a vector."""
        if vector.pair is not None:
            return vector.pair
        if id(vector) not in self._known:
            self._known[id(vector)] = (self.size, self.size + 1)
            self._vectors.append(vector)
            self.size += 2
        return self._known[id(vector)]

    def derived(self) -> Derived:
        """All derived rows handed out so far."""
        start, source = [0], []
        coefficients: list[Number] = []
        constants: list[Number] = []
        for vector in self._vectors:
            for part in (np.real, np.imag):
                for unknown, c in vector.terms.items():
                    if np.any(part(c)):
                        source.append(unknown)
                        coefficients.append(part(c))
                start.append(len(source))
                constants.append(part(vector.constant))
        return Derived(_index(start), _index(source), _stack(coefficients), _stack(constants))


@dataclass
class _Family:
    """The elements of one family as they are found."""

    rows: list[list[int]] = field(default_factory=list)
    numbers: list[Number] = field(default_factory=list)
    reference: list[Number] = field(default_factory=list)
    owners: list[str] = field(default_factory=list)
    damped: bool = False


class _Masses:
    """Mass matrix, weight and flexible elements, body by body."""

    def __init__(self, scene: Scene, placement: Placement, rows: _Rows) -> None:
        self.scene, self.placement, self.rows = scene, placement, rows
        self.gravity = as_complex(scene.gravity)
        self.entries: dict[tuple[int, int], Number] = {}
        self.weight: list[Number] = [0.0] * len(placement.positions)
        self.families = {name: _Family() for name in Elements._fields}

    def add(self, name: str, body: Rod | RigidBody | PointMass) -> None:
        """One body."""
        frame = self.placement.frames[name]
        if isinstance(frame, BeamFrame):
            assert isinstance(body, Rod)
            self._add_rod(name, body, frame)
        elif isinstance(frame, PointFrame):
            self._add_mass([frame.origin], [[body.mass]])
            self._add_load([frame.origin], [body.mass * self.gravity])
        else:
            assert isinstance(frame, RigidFrame)
            assert not isinstance(body, PointMass)
            c = as_complex(body.centre_of_mass)
            moment = body.mass * c
            inertia = body.inertia + body.mass * np.abs(c) ** 2
            vectors = [frame.origin, frame.axis]
            self._add_mass(vectors, [[body.mass, moment], [np.conj(moment), inertia]])
            self._add_load(vectors, [body.mass * self.gravity, np.conj(moment) * self.gravity])

    def add_driver(self, pair: Affine) -> None:
        """A moving point of the ground; its motion is prescribed, so its mass is of no consequence."""
        self._add_mass([pair], [[min(np.min(np.asarray(body.mass)) for body in self.scene.bodies.values())]])

    def _add_rod(self, name: str, rod: Rod, frame: BeamFrame) -> None:
        element = ELEMENTS[rod.element]
        length = frame.element_length * np.ones(1) if np.ndim(frame.element_length) else frame.element_length
        for number in range(rod.elements):
            height, width = rod.section((number + 0.5) / rod.elements)
            vectors = frame.vectors(number)
            self._add_mass(vectors, element.mass(rod.density, height, width, length))
            weight = element.weight(rod.density, height, width, length)
            self._add_load(vectors, [part * self.gravity for part in weight])
            family, numbers, reference = _elastic(self.scene, rod, number, height, width, length)
            found = self.families[family]
            found.rows.append([row for vector in vectors for row in self.rows.of(vector)])
            found.numbers.extend(numbers)
            found.reference.extend(reference)
            found.owners.append(name)
            found.damped = found.damped or bool(np.any(rod.retardation))

    def _add_mass(self, vectors: list[Affine], matrix: list[list[Number]]) -> None:
        """Add T' M T for the body coordinates `vectors` = T q, T = 1/2 sum Re(conj(v_a) M_ab v_b)."""
        for a, left in enumerate(vectors):
            for b, right in enumerate(vectors):
                for i, ci in left.terms.items():
                    for j, cj in right.terms.items():
                        if i >= j:
                            value = np.real(np.conj(ci) * matrix[a][b] * cj)
                            if np.any(value) or i == j:
                                self.entries[i, j] = self.entries.get((i, j), 0.0) + value

    def _add_load(self, vectors: list[Affine], parts: list[Number]) -> None:
        for vector, part in zip(vectors, parts, strict=True):
            for unknown, coefficient in vector.terms.items():
                self.weight[unknown] = self.weight[unknown] + np.real(np.conj(coefficient) * part)

    def elements(self) -> Elements:
        """The families as arrays."""
        f = self.families

        def cables(family: _Family) -> AncfCables:
            return AncfCables(len(family.rows), _index(family.rows).ravel(), _stack(family.numbers))

        def beams(family: _Family, vectors: int) -> Beams:
            rule = _rule(self.scene, vectors)
            rows, numbers, reference = _index(family.rows).ravel(), _stack(family.numbers), _stack(family.reference)
            return Beams(len(family.rows), vectors, family.damped, len(rule), rule.ravel(), rows, numbers, reference)

        def solids(family: _Family, law: str) -> AncfFull:
            rule = ancf_full.quadrature(ancf_full.LAWS[law])
            rows, numbers = _index(family.rows).ravel(), _stack(family.numbers)
            return AncfFull(len(family.rows), len(rule), rule.ravel(), rows, numbers)

        return Elements(
            cables(f["cables_full"]),
            cables(f["cables_reduced"]),
            beams(f["cubics"], beam.CUBIC),
            beams(f["quintics"], beam.QUINTIC),
            solids(f["solids"], "plane-stress"),
            solids(f["two_point_solids"], "two-point"),
        )

    def owners(self) -> tuple[tuple[str, ...], ...]:
        """The body of every element, by family."""
        return tuple(tuple(self.families[name].owners) for name in Elements._fields)


def _rule(scene: Scene, vectors: int) -> Array:
    """The quadrature of all beams of one order; of quintic ones that of the shortest rod."""
    if vectors == beam.CUBIC:
        return beam.quadrature(beam.CUBIC, 5, 3)
    rods = [body for body in scene.bodies.values() if isinstance(body, Rod) and body.element == "ancf-quintic"]
    return beam.recommended(beam.QUINTIC, min((rod.elements for rod in rods), default=2))


def _elastic(
    scene: Scene, rod: Rod, number: int, height: Number, width: Number, length: Number
) -> tuple[str, list[Number], list[Number]]:
    """Family, coefficients and reference numbers of one element of a rod."""
    assert rod.youngs_modulus is not None
    if rod.element == "ancf-full":
        law = ancf_full.LAWS[rod.law]
        numbers = ancf_full.coefficients(law, length, height, width, rod.youngs_modulus, rod.poisson_ratio)
        return ("two_point_solids" if rod.law == "two-point" else "solids"), numbers, []
    axial = rod.youngs_modulus * height * width
    bending = rod.youngs_modulus * width * height**3 / 12
    plain = not rod.curvature and not np.any(rod.retardation)
    if rod.element == "ancf-cable" and plain:
        family = "cables_full" if rod.quadrature == "full" else "cables_reduced"
        return family, ancf_cable.coefficients(length, axial, bending), []
    if rod.element == "ancf-cable" and rod.quadrature != "full":
        raise InputError("quadrature: a curved or damped ancf-cable has the full quadrature")
    vectors = beam.QUINTIC if rod.element == "ancf-quintic" else beam.CUBIC
    rule = _rule(scene, vectors)
    nodal = []
    for node in (number, number + 1):
        s = rod.length * node / rod.elements
        nodal += [rod.axis(s), *ELEMENTS[rod.element].nodal_vectors(rod, s)]
    numbers = beam.coefficients(length, axial, bending, rod.retardation + 0.0 * length)
    return ("quintics" if vectors == beam.QUINTIC else "cubics"), numbers, beam.reference(vectors, rule, nodal, length)


class _Loads:
    """Springs, dampers, joint friction, forces and torques."""

    def __init__(self, scene: Scene, placement: Placement, rows: _Rows, horizon: float) -> None:
        self.scene, self.placement, self.rows, self.horizon = scene, placement, rows, horizon
        self.fitted: list[Piecewise] = []
        self.kinds: list[int] = []
        self.places: list[list[int]] = []
        self.numbers: list[list[int]] = []
        self.laws: list[Number] = []
        self.angles: list[Number] = []
        self.fixed: list[tuple[int, Number, int]] = []
        self.following: list[tuple[list[int], Number, int]] = []
        for name, joint in scene.joints.items():
            if isinstance(joint, Revolute | Slider) and (np.any(joint.friction) or np.any(joint.coulomb)):
                law = [0.0, 0.0, joint.friction, 0.0, joint.coulomb, joint.coulomb_speed, 0.0]
                if isinstance(joint, Revolute):
                    self._angle(name, joint.first, joint.second, law)
                else:
                    line = placement.direction(scene, joint.first) * unit(joint.direction)
                    ends = [placement.point(scene, side) for side in (joint.first, joint.second)]
                    self._measure(name, PLACE, [*ends, line], law, 0.0)
        for name, load in scene.loads.items():
            if isinstance(load, Spring):
                self._spring(name, load)
            elif isinstance(load, TorsionSpring):
                rest = self._turn(load.first, load.second) if load.angle is None else load.angle
                law = [load.stiffness, load.cubic, load.damping, rest, 0.0, 1.0, 0.0]
                self._angle(name, load.first, load.second, law, elastic=load.elastic)
            elif isinstance(load, Torque):
                law = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
                base = load.reaction or Attachment(body=GROUND, point=(0.0, 0.0))
                self._angle(name, base, load.at, law, drive=load.torque)
            elif isinstance(load, Force):
                self._force(name, load)
            elif isinstance(load, DistributedForce):
                self._distributed(name, load)

    def _function(self, field: str, f: Function) -> int:
        """Number of a function of time; -1 for the constant 1."""
        if f.number == 1.0 or self.horizon == 0.0:
            return -1
        with _naming(field):
            self.fitted.append(fitting.fit(f, self.horizon, f.knots))
        return len(self.fitted) - 1

    def _turn(self, first: Attachment, second: Attachment) -> Number:
        return start_angle(self.scene, second) - start_angle(self.scene, first)

    def _measure(
        self,
        name: str,
        kind: int,
        vectors: list[Affine],
        law: list[Number],
        angle: Number,
        *,
        elastic: Function | None = None,
        drive: Function | None = None,
    ) -> None:
        table = energy = -1
        if elastic is not None and self.horizon > 0.0:
            with _naming(f"loads.{name}.elastic"):
                fitted = fitting.fit_law(elastic)
            self.fitted += [fitted, fitting.antiderivative(fitted)]
            table, energy = len(self.fitted) - 2, len(self.fitted) - 1
        driven = -1
        if drive is not None and self.horizon > 0.0:
            with _naming(f"loads.{name}.torque"):
                self.fitted.append(fitting.fit(drive, self.horizon, drive.knots))
            driven = len(self.fitted) - 1
        vectors = [*vectors, *vectors[-1:] * (3 - len(vectors))]
        self.kinds.append(kind)
        self.places.append([row for vector in vectors for row in self.rows.of(vector)])
        self.numbers.append([table, energy, driven])
        self.laws += law
        self.angles.append(angle)

    def _angle(
        self,
        name: str,
        first: Attachment,
        second: Attachment,
        law: list[Number],
        *,
        elastic: Function | None = None,
        drive: Function | None = None,
    ) -> None:
        for side in (first, second):
            if side.body != GROUND and isinstance(self.scene.bodies[side.body], PointMass):
                raise InputError(f"{name}: {side.body} is a point mass, which has no angle")
        directions = [self.placement.direction(self.scene, side) for side in (first, second)]
        self._measure(name, ANGLE, directions, law, self._turn(first, second), elastic=elastic, drive=drive)

    def _spring(self, name: str, load: Spring) -> None:
        ends = [self.placement.point(self.scene, side) for side in (load.first, load.second)]
        rest: Number = load.length
        if rest is None:
            first, second = (self.placement.start_of(end)[0] for end in ends)
            rest = np.abs(second - first)
        self._measure(name, DISTANCE, ends, [load.stiffness, load.cubic, load.damping, rest, 0.0, 1.0, 0.0], 0.0,
                      elastic=load.elastic)  # fmt: skip

    def _force(self, name: str, load: Force) -> None:
        point = self.placement.point(self.scene, load.at)
        value, number = as_complex(load.force), self._function(f"loads.{name}.scale", load.scale)
        if load.follows:
            direction = self.placement.direction(self.scene, load.at)
            self.following.append(([*self.rows.of(point), *self.rows.of(direction)], value, number))
            return
        for row, part in zip(self.rows.of(point), (np.real(value), np.imag(value)), strict=True):
            self.fixed.append((row, part, number))

    def _distributed(self, name: str, load: DistributedForce) -> None:
        rod, frame = self.scene.bodies[load.body], self.placement.frames[load.body]
        assert isinstance(rod, Rod)
        value, number = as_complex(load.force), self._function(f"loads.{name}.scale", load.scale)
        if isinstance(frame, BeamFrame):
            element = ELEMENTS[rod.element]
            parts = element.weight(1.0, 1.0, 1.0, frame.element_length)
            loads = [pair for k in range(rod.elements) for pair in zip(frame.vectors(k), parts, strict=True)]
        else:
            assert isinstance(frame, RigidFrame)
            nodes, weights = np.polynomial.legendre.leggauss(24)
            loads = [
                (frame.point(rod.axis((x + 1) / 2 * rod.length)), w / 2 * rod.length)
                for x, w in zip(nodes, weights, strict=True)
            ]
        for vector, size in loads:
            force = value * size
            for row, part in zip(self.rows.of(vector), (np.real(force), np.imag(force)), strict=True):
                self.fixed.append((row, part, number))

    def forces(self) -> Forces:
        """Springs, dampers, friction and torques as arrays."""
        table, energy, drive = np.array(self.numbers, dtype=np.int64).reshape(-1, 3).T.copy()
        rows = _index(self.places).ravel()
        return Forces(len(self.kinds), _index(self.kinds), rows, table, energy, drive, _stack(self.laws))

    def applied(self) -> Applied:
        """Applied loads as arrays."""
        factors = [part for _, value, _ in self.following for part in (np.real(value), np.imag(value))]
        return Applied(
            len(self.fixed),
            _index([row for row, _, _ in self.fixed]),
            _stack([part for _, part, _ in self.fixed]),
            _index([number for _, _, number in self.fixed]),
            len(self.following),
            _index([rows for rows, _, _ in self.following]).ravel(),
            _stack(factors),
            _index([number for _, _, number in self.following]),
        )


def _stack(values: list[Number]) -> Array:
    """One row per value, (rows, lanes), or (rows, 1) if no value depends on the lane."""
    lanes = max((np.size(value) for value in values), default=1)
    out = np.empty((len(values), lanes))
    for row, value in enumerate(values):
        out[row] = value
    return out


def _index(values: list[int] | list[list[int]]) -> Index:
    return np.array(values, dtype=np.int64)
