"""Springs, dampers, joint friction, forces and torques on the vectors that the placement gave."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import fitting, plane
from shoal.mechanics.affine import Affine
from shoal.mechanics.applied import Applied
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.assembly.rods import rod_axis
from shoal.mechanics.assembly.rows import Rows
from shoal.mechanics.elements import ELEMENTS
from shoal.mechanics.forces import ANGLE, DISTANCE, PLACE, Forces
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.functions import Piecewise
from shoal.mechanics.numerics.tile import Number, index, stacked
from shoal.scene import (
    GROUND,
    Attachment,
    DistributedForce,
    Force,
    Function,
    PointMass,
    Revolute,
    Rod,
    Scene,
    Slider,
    Spring,
    Torque,
    TorsionSpring,
)


@contextmanager
def naming(field: str) -> Iterator[None]:
    """Name the field in what is said of its function."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{field}: {str(error).removeprefix('function: ')}") from None


class Loads:
    """Springs, dampers, joint friction, forces and torques."""

    def __init__(self, scene: Scene, placement: Placement, rows: Rows, horizon: float) -> None:
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
                self._friction(name, joint)
        for name, load in scene.loads.items():
            if type(load) not in LOADS:
                raise NotImplementedError(f"the mechanics knows no load of kind {load.kind!r}")
            LOADS[type(load)](self, name, load)

    def _friction(self, name: str, joint: Revolute | Slider) -> None:
        law = [0.0, 0.0, joint.friction, 0.0, joint.coulomb, joint.coulomb_speed, 0.0]
        if isinstance(joint, Revolute):
            self._angle(name, joint.first, joint.second, law)
            return
        line = self.placement.direction(self.scene, joint.first).turned(plane.rotation(joint.direction))
        ends = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        self._measure(name, PLACE, [*ends, line], law, 0.0)

    def _torsion_spring(self, name: str, load: TorsionSpring) -> None:
        rest = self._turn(load.first, load.second) if load.angle is None else load.angle
        law = [load.stiffness, load.cubic, load.damping, rest, 0.0, 1.0, 0.0]
        self._angle(name, load.first, load.second, law, elastic=load.elastic)

    def _torque(self, name: str, load: Torque) -> None:
        law = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
        base = load.reaction or Attachment(body=GROUND, point=(0.0, 0.0))
        self._angle(name, base, load.at, law, drive=load.torque)

    def _function(self, field: str, f: Function) -> int:
        """Number of a function of time; -1 for the constant 1."""
        if f.number == 1.0 or self.horizon == 0.0:
            return -1
        with naming(field):
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
            with naming(f"loads.{name}.elastic"):
                fitted = fitting.fit_law(elastic)
            self.fitted += [fitted, fitting.antiderivative(fitted)]
            table, energy = len(self.fitted) - 2, len(self.fitted) - 1
        driven = -1
        if drive is not None and self.horizon > 0.0:
            with naming(f"loads.{name}.torque"):
                self.fitted.append(fitting.fit(drive, self.horizon, drive.knots))
            driven = len(self.fitted) - 1
        vectors = [*vectors, *vectors[-1:] * (3 - len(vectors))]
        self.kinds.append(kind)
        self.places.append(self.rows.of_all(vectors))
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
            rest = np.sqrt(sum((second - first) ** 2))
        law = [load.stiffness, load.cubic, load.damping, rest, 0.0, 1.0, 0.0]
        self._measure(name, DISTANCE, ends, law, 0.0, elastic=load.elastic)

    def _force(self, name: str, load: Force) -> None:
        point = self.placement.point(self.scene, load.at)
        number = self._function(f"loads.{name}.scale", load.scale)
        if load.follows:
            direction = self.placement.direction(self.scene, load.at)
            self.following.append((self.rows.of_all([point, direction]), load.force, number))
        else:
            self._fix(point, load.force, number)

    def _fix(self, vector: Affine, force: tuple[Number, ...], number: int) -> None:
        """A force on a vector; number: of the function of time that scales it."""
        self.fixed += [(row, part, number) for row, part in zip(self.rows.of(vector), force, strict=True)]

    def _distributed(self, name: str, load: DistributedForce) -> None:
        rod, frame = self.scene.bodies[load.body], self.placement.frames[load.body]
        assert isinstance(rod, Rod)
        number = self._function(f"loads.{name}.scale", load.scale)
        if isinstance(frame, BeamFrame):
            parts = ELEMENTS[rod.element].weight(1.0, 1.0, 1.0, frame.element_length)
            loads = [pair for k in range(rod.elements) for pair in zip(frame.of_element(k), parts, strict=True)]
        else:
            assert isinstance(frame, RigidFrame)
            nodes, weights = np.polynomial.legendre.leggauss(24)
            loads = [
                (frame.point(rod_axis(rod, (x + 1) / 2 * rod.length)), w / 2 * rod.length)
                for x, w in zip(nodes, weights, strict=True)
            ]
        for vector, size in loads:
            self._fix(vector, tuple(part * size for part in load.force), number)

    def forces(self) -> Forces:
        """Springs, dampers, friction and torques as arrays."""
        table, energy, drive = np.array(self.numbers, dtype=np.int64).reshape(-1, 3).T.copy()
        rows = index(self.places).ravel()
        space = (0,) * plane.DIMENSIONS
        return Forces(space, len(self.kinds), index(self.kinds), rows, table, energy, drive, stacked(self.laws))

    def applied(self) -> Applied:
        """Applied loads as arrays."""
        factors = [part for _, value, _ in self.following for part in value]
        return Applied(
            len(self.fixed),
            index([row for row, _, _ in self.fixed]),
            stacked([part for _, part, _ in self.fixed]),
            index([number for _, _, number in self.fixed]),
            len(self.following),
            index([rows for rows, _, _ in self.following]).ravel(),
            stacked(factors),
            index([number for _, _, number in self.following]),
        )


LOADS: dict[type, Callable[[Loads, str, Any], None]] = {
    Spring: Loads._spring,
    TorsionSpring: Loads._torsion_spring,
    Force: Loads._force,
    Torque: Loads._torque,
    DistributedForce: Loads._distributed,
}
