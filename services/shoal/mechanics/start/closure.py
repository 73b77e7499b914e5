"""Loop closure equations: residuals of the joints by the poses of rigid bodies, their Jacobian and their drift.

Every body, flexible ones too, is a rigid one here (`rigid_bodies`). In the plane a pose is x, y [m] of its origin and
its angle [rad], three numbers a body in the order of the scene. All arrays lead with the lanes.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from shoal.mechanics import rotation as turns
from shoal.mechanics.numerics.tile import Array, Flags, Index
from shoal.mechanics.plane import phasor
from shoal.mechanics.start.rigid_bodies import ANGLE, PLACE, RigidBodies
from shoal.mechanics.term_values import TermValues, laned, of_lanes
from shoal.scene import Scene

POSE = 3
"""Numbers of a pose in the plane."""


class Poses(NamedTuple):
    """Poses of rigid bodies, the last of which is the ground.

    places [m], (lanes, bodies, d); axes: of the bodies as columns, (lanes, bodies, d, d); angles: in the plane, with
    all turns [rad], (lanes, bodies)
    """

    places: Array
    axes: Array
    angles: Array

    @classmethod
    def of(cls, u: Array | Poses, bodies: int) -> Poses:
        """Return those of numbers, (lanes, numbers): of each body its place and angle, or in space its axes in rows."""
        if isinstance(u, Poses):
            return u
        each = np.pad(u.reshape(len(u), bodies, -1), ((0, 0), (0, 1), (0, 0)))
        if each.shape[-1] == POSE:
            cosine, sine = np.cos(each[..., 2]), np.sin(each[..., 2])
            axes = np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
            return cls(each[..., :2], axes, each[..., 2])
        each[:, -1, 3:] = np.eye(3).ravel()
        return cls(each[..., :3], each[..., 3:].reshape(*each.shape[:2], 3, 3), np.zeros(each.shape[:2]))

    @property
    def numbers(self) -> Array:
        """The numbers of the bodies, (lanes, numbers)."""
        d = self.places.shape[-1]
        turn = self.angles[..., None] if d == 2 else self.axes.reshape(*self.angles.shape, 9)
        return np.concatenate([self.places, turn], axis=-1)[:, :-1].reshape(len(self.places), -1)

    def moved(self, step: Array) -> Poses:
        """Return the poses after small displacements and turns of the bodies, (lanes, bodies, d + turns)."""
        d = self.places.shape[-1]
        step = np.pad(step, ((0, 0), (0, 1), (0, 0)))
        turn, angles = step[..., d:], self.angles
        if d == 2:
            angles, turn = angles + turn[..., 0], np.pad(turn, ((0, 0), (0, 0), (2, 0)))
        rotation = np.moveaxis(turns.of_vector(np.moveaxis(turn, -1, 0).reshape(3, -1)), -1, 0)
        rotation = rotation.reshape(*turn.shape[:-1], 3, 3)[..., :d, :d]
        return Poses(self.places + step[..., :d], rotation @ self.axes, angles)

    def away(self, other: Poses) -> Array:
        """Return how far each column of the bodies is from that of others, [m, rad], (lanes, columns).

        In space each column of a turn has the angle between both.
        """
        turned = (self.angles - other.angles)[..., None]
        if self.places.shape[-1] == 3:
            chord = np.linalg.norm(self.axes - other.axes, axis=(-2, -1)) / np.sqrt(8.0)
            turned = np.repeat(2.0 * np.arcsin(np.minimum(chord, 1.0))[..., None], 3, axis=-1)
        both = np.concatenate([self.places - other.places, turned], axis=-1)
        return np.asarray(np.abs(both[:, :-1].reshape(len(both), -1)))


@dataclass(frozen=True)
class Rows:
    """Gaps (lanes, rows) [m, rad], and their derivatives by time (lanes, rows).

    names: of every row its joint. angular: whether its gap is an angle. parts: derivatives by poses, each with rows and
    bodies, (parts,), (lanes or 1, parts, 3), which add up; in one of them no row is there twice. bodies: how many
    """

    gap: Array
    rate: Array
    names: tuple[str, ...]
    angular: Flags
    parts: list[tuple[Index, Index, Array]]
    bodies: int

    @cached_property
    def slope(self) -> Array:
        """Derivatives by all poses, (lanes, rows, 3 bodies), in space by small displacements and turns, 6 a body."""
        dense = np.zeros((*self.gap.shape, self.bodies, self.parts[0][2].shape[-1] if self.parts else POSE))
        for rows, bodies, slope in self.parts:
            dense[:, rows, bodies] += slope
        return dense.reshape(*self.gap.shape, -1)

    def along(self, v: Array) -> Array:
        """The derivatives times rates v (lanes, 3 bodies)."""
        total, each = np.zeros_like(self.gap), v.reshape(len(v), self.bodies, POSE)
        for rows, bodies, slope in self.parts:
            total[:, rows] += np.sum(slope * each[:, bodies], axis=2)
        return total


class Closure:
    """The joints of a scene. begin: poses (lanes, 3 bodies) at which joints without a value of their own hold.

    own: whether joints that keep what the start gives them (a weld without an angle, a distance without a length)
    hold at `begin`, or take any value there is. bodies: that the conditions refer to, by default those of the plane.
    names, angular: of every row its joint, and whether its gap is an angle
    """

    def __init__(self, scene: Scene, begin: Array | Poses, own: bool = True, bodies: RigidBodies | None = None) -> None:
        bodies = RigidBodies(scene) if bodies is None else bodies
        held, marks, d = bodies.terms.held, bodies.marks, scene.dimensions
        self._terms = TermValues(held, d, counted=d == 2)
        self.names, self._bodies = tuple(one.name for one in held), len(bodies.owners)
        self.angular = np.array([one.lengths == 0 for one in held], dtype=bool)
        self.begin, self.own = Poses.of(begin, self._bodies), own
        self._wrapping = bodies.wrapping
        self._of_start, self._kept = list(bodies.of_start), list(bodies.of_start.values())
        is_free = [one is None or one.is_of_start for one in self._kept]
        self._free = np.array(self._of_start, dtype=np.int64)[is_free]
        self._body = np.array([one.body for one in marks], dtype=np.int64)
        kinds = np.array([one.kind for one in marks], dtype=np.int64)
        self._places, self._angles = (kinds == PLACE) & (self._body >= 0), kinds == ANGLE
        self._vectors = laned([one.components.T for one in marks], (d,))
        self._rates = laned([one.rates.T for one in marks], (d,))
        self._mark, self._axis = np.divmod(self._terms.unknowns, d)
        self._at_start: Array | None = None

    def at(self, begin: Array | Poses, own: bool = True) -> Closure:
        """Return the same joints with other poses at which those hold that take their value from the start."""
        other = copy(self)
        other.begin, other.own, other._at_start = Poses.of(begin, self._bodies), own, None
        return other

    def of_lanes(self, lanes: Index) -> Closure:
        """Return the joints of some lanes, with what they keep."""
        other = copy(self)
        other._terms = self._terms.of_lanes(lanes)
        other._vectors, other._rates = of_lanes(self._vectors, lanes), of_lanes(self._rates, lanes)
        other.begin = Poses(*(of_lanes(part, lanes) for part in self.begin))
        other._at_start = of_lanes(self._values_at_start, lanes)
        return other

    @property
    def is_carried(self) -> bool:
        """Return whether a point or direction that joints hold moves in its body, as one of a moving ground."""
        return bool(np.any(self._rates))

    @property
    def bend(self) -> Array:
        """Second derivatives of the joints by time at poses that rest, of their drives, (rows,)."""
        return self._terms.bend

    def rows(self, u: Array | Poses) -> Rows:
        """All joints at poses."""
        poses = Poses.of(u, self._bodies)
        vectors, turning, rates = self._evaluate(poses)
        gap, slopes = self._terms.at(vectors)
        gap[:, self._of_start] -= self._values_at_start
        gap[:, self._wrapping] = np.angle(phasor(gap[:, self._wrapping]))
        if not self.own:
            gap[:, self._free] = 0.0
        rate = np.repeat(self._terms.drift[None], len(gap), axis=0)
        d = poses.places.shape[-1]
        by_pose = np.zeros((*slopes.shape, d + turning.shape[-1]))
        by_pose[:, np.arange(len(self._axis)), self._axis] = slopes * self._places[self._mark]
        by_pose[..., d:] = slopes[..., None] * turning[:, self._mark, self._axis]
        drift = None if rates is None else slopes * rates[:, self._mark, self._axis]
        parts = []
        for part in self._terms.groups:
            rows, bodies = self._terms.rows[part], self._body[self._mark[part]]
            if drift is not None:
                rate[:, rows] += drift[:, part]
            of_body = bodies >= 0
            parts.append((rows[of_body], bodies[of_body], by_pose[:, part][:, of_body]))
        return Rows(gap, rate, self.names, self.angular, parts, self._bodies)

    def _evaluate(self, poses: Poses) -> tuple[Array, Array, Array | None]:
        """The components of all vectors at poses, (lanes, d vectors), and their derivatives, (lanes, vectors, d, ...).

        These are by small turns of the body, and by time; None: all vectors rest in their bodies.
        """
        axes = poses.axes[:, self._body]
        vectors = _turned(axes, self._vectors)
        turning = _by_turns(vectors)
        if np.any(self._angles):
            vectors[:, self._angles], turning[:, self._angles] = self._vectors[:, self._angles], [[1.0], [0.0]]
            vectors[:, self._angles, 0] += poses.angles[:, self._body[self._angles]]
        vectors[:, self._places] += poses.places[:, self._body[self._places]]
        rates = None
        if np.any(self._rates):
            rates = _turned(axes, self._rates)
            rates[:, self._angles] = self._rates[:, self._angles]
        return vectors.reshape(len(vectors), -1), turning, rates

    @property
    def _values_at_start(self) -> Array:
        """Lengths [m] and sums of angles [rad] that are kept of those at the start, (lanes, terms)."""
        if self._at_start is None:
            found = self._terms.at(self._evaluate(self.begin)[0])[0][:, self._of_start]
            for k, one in enumerate(self._kept):
                found[:, k] = found[:, k] if one is None else one.kept(found[:, k])
            self._at_start = found
        return self._at_start


def _turned(axes: Array, components: Array) -> Array:
    """Vectors of their components (..., d) along axes (..., d, d)."""
    parts = (axes[..., k] * components[..., k : k + 1] for k in range(1, axes.shape[-1]))
    return np.asarray(sum(parts, axes[..., 0] * components[..., :1]))


def _by_turns(vectors: Array) -> Array:
    """Derivatives of vectors (lanes, vectors, d) by small turns, (lanes, vectors, d, 1 or 3)."""
    if vectors.shape[-1] == 2:
        return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)[..., None]
    return np.moveaxis(-turns.skew(np.moveaxis(vectors, -1, 0)), (0, 1), (-2, -1))
