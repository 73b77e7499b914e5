"""Rigid bodies, cables and the ground in space inside Exudyn, and how their places move."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.engines.exudyn.bodies import BodyPart, Energy, Place, System
from shoal.engines.exudyn.cable import CablePart, add_cables
from shoal.engines.exudyn.ground import GroundPart
from shoal.engines.exudyn.user import rotation, rotation_slope
from shoal.engines.sections import Sections
from shoal.errors import InputError
from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.masses import second_moments
from shoal.mechanics.frames import BeamFrame, PointFrame, RigidFrame
from shoal.scene import PointMass, RigidBody, Rod
from shoal.scene.dimensions import padded
from shoal.trajectory import Array


class SpatialPointMotion(NamedTuple):
    """One material point: position [m] and velocity [m/s] (rows, 3), axes of its body and their rates (rows, 3, 3).

    The axes are columns. Of a cable only the first is known, along the tangent and of no unit length.
    """

    position: Array
    velocity: Array
    axes: Array
    turning: Array

    @property
    def direction(self) -> Array:
        """Angle [rad] of the first axis about z, (rows,)."""
        return np.asarray(np.arctan2(self.axes[:, 1, 0], self.axes[:, 0, 0]))


class Side(NamedTuple):
    """A node, and how many coordinates it has: none of the ground, 6 of a cable, 7 of a rigid body."""

    node: Any
    size: int


class SpatialHolder(Protocol):
    """Base of what joints and loads attach to in space: a body or the ground."""

    def hold(self, system: System, place: Place) -> Any:
        """A new marker at a place [m] in its frame."""
        ...

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """A new marker that turns with it there. Raises InputError."""
        ...

    def framed(self, system: System, place: Place, axes: Array) -> Any:
        """The same, with axes (3, 3) of its own as the body's frame has them."""
        ...

    def side(self, place: Place) -> Side:
        """Return the node whose coordinates define the directions there. Raises InputError."""
        ...

    def motion(self, q: Array, v: Array, place: Place) -> Any:
        """Motion of a place."""
        ...


@dataclass(frozen=True)
class Framed:
    """An object of Exudyn's with a frame, at whose places there are markers with axes."""

    body: Any

    def hold(self, system: System, place: Place) -> Any:
        """See SpatialHolder."""
        return system.marker("MarkerBodyPosition", self.body, place)

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """See SpatialHolder."""
        return self.framed(system, place, np.eye(3))

    def framed(self, system: System, place: Place, axes: Array) -> Any:
        """See SpatialHolder."""
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = axes, place
        return system.add("MarkerBodyRigid", bodyNumber=self.body, localHT=frame)


@dataclass(frozen=True)
class SolidPart(Framed, BodyPart):
    """ObjectRigidBody on a node of Euler parameters, to which no attitude is singular, at the body's origin.

    A point mass is a ball held at its centre, where nothing turns it; its inertia is of no consequence.
    """

    node: Any
    columns: list[int]
    mass: float
    inertia: Array
    centre: Array

    @classmethod
    def add(cls, system: System, given: Rod | RigidBody | PointMass, frame: Any, q: Array, v: Array) -> SolidPart:
        """Enter a rigid body where its frame is at the coordinates q and rates v of the native machine."""
        if isinstance(given, PointMass):
            centre, about_centre = np.zeros(3), given.mass * np.eye(3)
        else:
            moments = np.array(second_moments(given), dtype=float)
            centre = np.array(padded(given.centre_of_mass, 3), dtype=float)
            about_centre = np.trace(moments) * np.eye(3) - moments
        axes, spin = np.eye(3), np.zeros(3)
        if isinstance(frame, RigidFrame):
            axes = np.array([one.at(q) for one in frame.directors]).T
            turning = np.array([one.rate(v) for one in frame.directors]).T
            spin = 0.5 * np.sum(np.cross(axes.T, turning.T), axis=0)
        assert isinstance(frame, RigidFrame | PointFrame)
        turn = Rotation.from_matrix(axes).as_quat(scalar_first=True)
        rate = 0.25 * local_rates(turn).T @ (axes.T @ spin)
        begin, rates = [*frame.origin.at(q), *turn], [*frame.origin.rate(v), *rate]
        node, columns = system.node("NodeRigidBodyEP", begin, rates)
        about = about_centre + given.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        body = system.add(
            "ObjectRigidBody",
            mass=given.mass,
            inertia=[about[0, 0], about[1, 1], about[2, 2], about[1, 2], about[0, 2], about[0, 1]],
            centerOfMass=centre.tolist(),
            nodeNumber=node,
        )
        marker = system.marker("MarkerBodyPosition", body, tuple(centre))
        weight = given.mass * np.array(system.gravity)
        system.add("LoadForceVector", markerNumber=marker, loadVector=weight.tolist())
        return cls(body, node, columns, given.mass, about_centre, centre)

    def side(self, place: Place) -> Side:
        """See SpatialHolder."""
        return Side(self.node, 7)

    def motion(self, q: Array, v: Array, place: Place) -> Any:
        """See Part."""
        q, v = q[:, self.columns], v[:, self.columns]
        axes = rotation(q[:, 3:])
        turning = np.einsum("rijk,rk->rij", rotation_slope(q[:, 3:]), v[:, 3:])
        at = np.array(place)
        return SpatialPointMotion(q[:, :3] + axes @ at, v[:, :3] + turning @ at, axes, turning)

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        centre = self.motion(q, v, tuple(self.centre))
        spin = np.einsum("rij,rj->ri", local_rates(q[:, self.columns[3:]]), v[:, self.columns[3:]])
        kinetic = self.mass * np.sum(centre.velocity**2, axis=1) / 2
        kinetic = kinetic + np.einsum("ri,ij,rj->r", spin, self.inertia, spin) / 2
        return Energy(kinetic, np.zeros(len(q)), self.mass * centre.position)


@dataclass(frozen=True)
class SpatialCablePart(CablePart):
    """A chain of ObjectANCFCable; coordinates of a node: r and r'."""

    nodes: list[Any]

    @classmethod
    def enter(cls, system: System, rod: Rod, frame: BeamFrame, q: Array, v: Array) -> SpatialCablePart:
        """Enter an unstrained straight rod without damping whose nodes are where its frame is.

        Exudyn's damping follows the rate of the curvature's components, which a bent cable has that turns as a whole.
        """
        sections = Sections.of(rod)
        nodes, columns = [], []
        for vectors in frame.nodes:
            begin, rates = np.concatenate(_both(vectors, q, v), axis=1)
            node, places = system.node("NodePointSlope1", begin.tolist(), rates.tolist())
            nodes.append(node)
            columns.append(places)
        elements = add_cables(system, "ObjectANCFCable", rod, sections, nodes, {})
        per_element = np.array([first + last for first, last in pairwise(columns)])
        return cls(rod, sections, elements, per_element, np.zeros(0), nodes)

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """See Part; Exudyn's spatial cable gives markers no orientation."""
        raise InputError(
            "joints: engine exudyn gives no direction to a place of a cable in space; use a rigid body there"
        )

    def framed(self, system: System, place: Place, axes: Array) -> Any:
        """See SpatialHolder."""
        return self.turn(system, place)

    def side(self, place: Place) -> Side:
        """See SpatialHolder."""
        node = place[0] / self.size
        if abs(node - round(node)) > 1e-9 or any(place[1:]):
            raise InputError(
                f"joints: engine exudyn holds the direction of a cable at its nodes only, not at {place[0]:g} m"
            )
        return Side(self.nodes[round(node)], 6)

    def motion(self, q: Array, v: Array, place: Place) -> Any:
        """See Part."""
        if any(place[1:]):
            raise InputError("joints: engine exudyn has no places beside the axis of a cable in space")
        index, xi = self.find(place)
        shape, slope, _ = self._shapes(np.array([xi]))
        position, velocity = (self.values(shape, x)[:, index, 0] for x in (q, v))
        tangent, turn = (self.values(slope, x)[:, index, 0] for x in (q, v))
        none = np.full((len(q), 3, 2), np.nan)
        return SpatialPointMotion(
            position,
            velocity,
            np.concatenate([tangent[:, :, None], none], axis=2),
            np.concatenate([turn[:, :, None], none], axis=2),
        )

    def _strains(self, q: Array, v: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Axial strain, and curvature |r' x r''| / |r'|^2 [1/m], whose rates are not needed."""
        (axial_points, _), (bending_points, _) = self._rules
        stretch = np.linalg.norm(self.values(self._shapes(axial_points)[1], q), axis=-1)
        slope, bend = (self.values(shape, q) for shape in self._shapes(bending_points)[1:])
        curvature = np.linalg.norm(np.cross(slope, bend), axis=-1) / np.sum(slope**2, axis=-1)
        none = np.zeros(1)
        return (stretch - 1.0, none), (curvature, none)


@dataclass(frozen=True)
class SpatialGround(Framed, GroundPart):
    """ObjectGround, and a node without coordinates."""

    def side(self, place: Place) -> Side:
        """See SpatialHolder."""
        return Side(self.node, 0)

    def motion(self, q: Array, v: Array, place: Place) -> Any:
        """See SpatialHolder."""
        rows = len(q)
        still = np.zeros((rows, 3, 3))
        return SpatialPointMotion(
            np.tile(np.array(place, dtype=float), (rows, 1)), still[:, 0], still + np.eye(3), still
        )


def local_rates(turn: Array) -> Array:
    """The matrix (..., 3, 4) that maps rates of Euler parameters to the angular velocity along the body's axes."""
    s, x, y, z = np.moveaxis(turn, -1, 0)
    rows = [[-x, s, z, -y], [-y, -z, s, x], [-z, y, -x, s]]
    return np.asarray(2 * np.moveaxis(np.array(rows), (0, 1), (-2, -1)))


def _both(vectors: tuple[Affine, ...], q: Array, v: Array) -> list[tuple[Array, Array]]:
    """Value and rate of vectors."""
    return [(one.at(q), one.rate(v)) for one in vectors]
