"""Scalar measures of a machine (distances, angles, places along a line) and the laws of forces along them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import fitting
from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.hinges import turning
from shoal.mechanics.derived import RowAllocator
from shoal.mechanics.forces import ANGLE, Forces
from shoal.mechanics.functions import Piecewise
from shoal.mechanics.numerics.tile import Number, index, stacked
from shoal.scene import GROUND, Attachment, Function, PointMass, Scene
from shoal.scene.record import Vector3


class ElementForceLaw(NamedTuple):
    """The force of an element along its measure g, F = -[k x + k3 x^3] - [(c + c2 |g'|) g' + F_c tanh(g'/v_s)] + A.

    x = g - g0, A times the element's drive where it has one. Numbers, or one for each lane, in the order in which
    `forces.Forces` holds them. stiffness: k; cubic: k3; damping: c; natural: g0; coulomb: F_c; speed: v_s, positive;
    amplitude: A, of a drive; drag: c2.
    """

    stiffness: Number = 0.0
    cubic: Number = 0.0
    damping: Number = 0.0
    natural: Number = 0.0
    coulomb: Number = 0.0
    speed: Number = 1.0
    amplitude: Number = 0.0
    drag: Number = 0.0


@contextmanager
def naming(field: str) -> Iterator[None]:
    """Name the field in what is said of its function."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{field}: {str(error).removeprefix('function: ')}") from None


class Measures:
    """Scalar measures of a machine and their laws, in the order of the arrays of `forces.Forces`."""

    def __init__(self, scene: Scene, placement: Placement, rows: RowAllocator, horizon: float) -> None:
        self.scene, self.placement, self.rows, self.horizon = scene, placement, rows, horizon
        self.fitted: list[Piecewise] = []
        self.kinds: list[int] = []
        self.names: list[str] = []
        """Of the joint, the load or the body that every element is part of."""
        self.places: list[list[int]] = []
        self.numbers: list[list[int]] = []
        self.laws: list[Number] = []
        self.angles: list[Number] = []

    def _measure(
        self,
        name: str,
        kind: int,
        vectors: list[Affine],
        law: ElementForceLaw,
        angle: Number,
        *,
        elastic: Function | None = None,
        drive: Function | None = None,
    ) -> None:
        table = energy = -1
        if elastic is not None and self.horizon > 0.0:
            with naming(self._field(name, elastic)):
                fitted = fitting.fit_law(elastic)
            self.fitted += [fitting.ended(one) for one in (fitted, fitting.antiderivative(fitted))]
            table, energy = len(self.fitted) - 2, len(self.fitted) - 1
        driven = -1
        if drive is not None and self.horizon > 0.0:
            with naming(self._field(name, drive)):
                self.fitted.append(fitting.fit(drive, self.horizon, drive.knots))
            driven = len(self.fitted) - 1
        vectors = [*vectors, *vectors[-1:] * (3 - len(vectors))]
        self.kinds.append(kind)
        self.names.append(name)
        self.places.append(self.rows.of_all(vectors))
        self.numbers.append([table, energy, driven])
        self.laws += law
        self.angles.append(angle)

    def _angle(
        self,
        name: str,
        first: Attachment,
        second: Attachment,
        law: ElementForceLaw,
        axis: Vector3,
        *,
        elastic: Function | None = None,
        drive: Function | None = None,
    ) -> None:
        for side in (first, second):
            self._require_angle(name, side)
        if isinstance(self.placement, SpatialPlacement):
            directions = list(turning(self.scene, name, self.placement, first, second, axis))
            a, b, ahead = (self.placement.start_of(one)[0] for one in directions)
            turn: Number = np.arctan2(sum(ahead * b), sum(a * b))
        else:
            directions = [self.placement.direction(self.scene, side) for side in (first, second)]
            turn = self._turn(first, second)
        self._measure(name, ANGLE, directions, law, turn, elastic=elastic, drive=drive)

    def _require_angle(self, name: str, side: Attachment) -> None:
        if side.body != GROUND and isinstance(self.scene.bodies[side.body], PointMass):
            raise InputError(
                f"{name}: {side.body} is a point mass, which has no angle; of a torsion spring, first_to or second_to "
                "can tell the place to which its direction leads"
            )

    def _turn(self, first: Attachment, second: Attachment) -> Number:
        return start_angle(self.scene, second) - start_angle(self.scene, first)

    def _field(self, name: str, function: Function) -> str:
        """Return the path of a function of a load, or of the load alone if that has made it."""
        return ".".join([f"loads.{name}", *(field for field, value in self.scene.loads[name] if value is function)])

    def forces(self) -> Forces:
        """Springs, dampers, friction and torques as arrays."""
        table, energy, drive = np.array(self.numbers, dtype=np.int64).reshape(-1, 3).T.copy()
        rows = index(self.places).ravel()
        return Forces(
            self.scene.dimensions, len(self.kinds), index(self.kinds), rows, table, energy, drive, stacked(self.laws)
        )
