"""Consistent initial conditions in space: poses as in the plane (`start.poses`), rates of least kinetic energy.

The rates are those of the machine's coordinates, with its mass matrix, as flexible rods may start to stretch. Stated
values are kept exactly if possible; all others follow from them, with the least change.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import reach
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import points
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.locking import require_unlocked
from shoal.mechanics.assembly.space.placement import place_in_space
from shoal.mechanics.assembly.space.rigid_bodies import SpatialBodies
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.numerics.tile import Array, Flags, stacked
from shoal.mechanics.start.closure import Closure, Poses
from shoal.mechanics.start.poses import CLOSED, ROUNDING, Assembly, Statement, stated
from shoal.mechanics.start.start import place_at, pose_refused
from shoal.mechanics.start.strained import gives_way, require_numbers
from shoal.mechanics.term_values import TermValues
from shoal.scene import Scene
from shoal.scene.initial import POSES, RATES
from shoal.scene.joints import places
from shoal.scene.paths import lanes_of

DEPENDENT = 1e-9
"""Singular values below this, relative to the largest, are of rows that depend on others."""
MET = 1e-9
"""Rates that miss an equation by less, relative to the largest, meet it."""


def place_started(scene: Scene) -> SpatialPlacement:
    """The placement of a scene with a start that agrees with its joints. Raises InputError where there is none."""
    return _Start(scene).run()


class _Wish(NamedTuple):
    """Equations rows v = values of the rates of one lane, (equations, unknowns) and (equations,)."""

    rows: Array
    values: Array
    stated: Statement | None = None

    @property
    def is_firm(self) -> bool:
        """Return whether it is a statement, and not a guess."""
        return self.stated is not None and self.stated.firm

    def off(self, v: Array) -> float:
        """Return the largest residual at rates."""
        return float(np.max(np.abs(self.rows @ v - self.values), initial=0.0))


class _Start:
    """Coordinates and rates that meet the constraints of a placement."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.size = scene, float(reach.span(scene))
        self._take(place_in_space(scene))

    def _take(self, placement: SpatialPlacement) -> None:
        self.placement = placement
        self.terms = [one for one in placement.terms.held if not one.of_start]
        self.moving_terms = [*self.terms, *(one for one in placement.terms.held if one.of_start)]
        self.moving = TermValues(self.moving_terms, 3)
        self.q, self.v = stacked(placement.positions), stacked(placement.velocities)
        values, scale = TermValues(self.terms, 3), np.array([self.size**term.lengths for term in self.terms])
        self.gaps = np.max(np.abs(values.at(self.q.T)[0] / scale), axis=1, initial=0.0)
        """Largest residual of the constraints by lane or of all, relative to the size of the machine."""
        placed = max(part.shape[-1] for pose in placement.poses.values() for part in (pose.position, pose.directors))
        self._spread(max(self.q.shape[1], self.v.shape[1], len(self.gaps), placed))

    def _spread(self, lanes: int) -> None:
        self.q, self.v = (np.repeat(x, lanes // x.shape[1], 1) for x in (self.q, self.v))
        self.lanes = lanes

    def run(self) -> SpatialPlacement:
        """Return a placement with the result. Raises InputError if a scene without lanes has no start."""
        begin = self._poses(shared=True)
        off = np.maximum(np.zeros(self.lanes) + self.gaps, self._open(begin))
        for one in stated(self.scene, self.lanes, POSES):
            wanted = begin.numbers
            wanted[:, one.numbers] = one.put
            away = begin.away(Poses.of(wanted, len(self.scene.bodies)))
            off = np.maximum(off, np.max(away, axis=1) / max(self.size, 1.0))
        is_open = off > CLOSED
        failed = self._assemble(is_open) if np.any(is_open) else np.zeros(self.lanes, dtype=bool)
        if self.lanes == 1 and len(self.scene.joints) > len(self.scene.bodies):  # there are loops
            require_unlocked(self.scene, self.terms, self.q[:, 0])
        heavy = lanes_of(self.scene.bodies)
        # The least kinetic energy depends on masses.
        if heavy > self.lanes and not failed[0] and not self._moves(0):
            self._spread(heavy)
            failed = np.repeat(failed, heavy)
        for moving in np.flatnonzero(~failed):
            failed[moving] |= not self._move(int(moving))
        self.placement.positions, self.placement.velocities = list(self.q), list(self.v)
        self.placement.terms.begin(lambda vector: place_at(vector, self.q))
        self.placement.failed = failed
        return self.placement

    def _poses(self, shared: bool = False) -> Poses:
        """Return the poses of the bodies as they are placed; shared: of rigid ones by closed coordinates."""
        count = len(self.scene.bodies)
        origins, axes = np.zeros((self.lanes, count + 1, 3)), np.zeros((self.lanes, count + 1, 3, 3)) + np.eye(3)
        for k, name in enumerate(self.scene.bodies):
            pose, frame = self.placement.poses[name], self.placement.frames[name]
            origins[:, k], axes[:, k] = pose.position.T, pose.directors.transpose(2, 1, 0)
            if shared and isinstance(frame, RigidFrame):
                origins[:, k] = place_at(frame.origin, self.q).T
                axes[:, k] = np.array([place_at(one, self.q) for one in frame.directors]).transpose(2, 1, 0)
        return Poses(origins, axes, np.zeros(origins.shape[:2]))

    @cached_property
    def _bodies(self) -> SpatialBodies:
        return SpatialBodies(self.scene, attitudes=self.placement.attitudes)

    def _open(self, begin: Poses) -> Array:
        """Return the largest residual of joints between rigid bodies by lane or of all, relative to the size.

        Coordinates that bodies share leave out of the constraints what no motion changes, as an offset along the axes
        of a planar loop.
        """
        scene = self.scene
        rigid = [name for name, j in scene.joints.items() if all(is_stiff(scene, side.body) for side in places(j))]
        rows = Closure(scene, begin, bodies=self._bodies).rows(begin)
        gaps = np.abs(rows.gap / np.where(rows.angular, 1.0, self.size)) * np.isin(rows.names, rigid)
        found = np.asarray(np.max(gaps, axis=1, initial=0.0))
        return found if len(found) == self.lanes else np.max(found, keepdims=True)

    def _assemble(self, chosen: Flags) -> Flags:
        """Place these lanes so that their joints close, and return which have no such poses. Raises InputError."""
        scene = self.scene
        self._spread(max(self.lanes, lanes_of((scene.initial, scene.joints, scene.bodies))))
        chosen, begin = np.repeat(chosen, self.lanes // len(chosen)), self._poses()
        assembly = Assembly(scene, self.lanes, self._bodies, begin)
        found = assembly.run()
        if self.lanes == 1 and not found.ok[0]:
            if not gives_way(scene):
                raise pose_refused(assembly)
            require_numbers(scene)
            return ~chosen
        used = np.where((chosen & found.ok)[:, None], found.poses, begin.numbers)
        poses = Poses.of(used, len(scene.bodies))
        each = zip(scene.bodies, np.moveaxis(poses.places, 0, -1), np.moveaxis(poses.axes, 0, -1), strict=False)
        self._take(place_in_space(scene, {name: (place, axes) for name, place, axes in each}))
        return chosen & ~found.ok

    def _moving(self, lane: int) -> tuple[_Wish, float]:
        """Return the constraints on the rates, by their scales, and the largest rate."""
        scale = np.array([self.size**term.lengths for term in self.moving_terms])
        slope = self.moving.of_lane(lane).jacobian(self.q[:, lane][None])[0] / scale[:, None]
        return _Wish(slope, -self.moving.drift / scale), max(1.0, float(np.max(np.abs(self.v[:, lane]), initial=0.0)))

    def _stated(self, lane: int) -> list[_Wish]:
        """Return the stated rates."""
        found, q = [], self.q[:, lane]
        for one in stated(self.scene, self.lanes, RATES):
            frame, values = self.placement.frames[one.body], one.values[lane]
            if one.quantity == "velocity":
                found.append(_Wish(points([frame.point((0.0, 0.0, 0.0))], len(q), lane).matrix[0], values, one))
            elif isinstance(frame, RigidFrame):
                directors = points(frame.directors, len(q), lane)
                turning = np.cross(np.pad(values, (3 - len(values), 0)), directors.at(q))
                found.append(_Wish(directors.matrix.reshape(9, len(q)), turning.ravel(), one))
        return found

    def _straining(self, lane: int) -> Iterator[_Wish]:
        """Yield for every flexible rod the rates that vanish in rigid motions of its vectors.

        A rod starts as a rigid body moves, unless the joints forbid it.
        """
        q = self.q[:, lane]
        for frame in self.placement.frames.values():
            if isinstance(frame, BeamFrame):
                vectors = points(frame.vectors, len(q), lane)
                turning = [-turns.skew(one) for one in vectors.at(q)]
                moving = [np.eye(3) * (k % len(frame.nodes[0]) == 0) for k in range(len(turning))]
                motions = np.linalg.svd(np.hstack([np.vstack(turning), np.vstack(moving)]), full_matrices=False)
                rigid = motions.U[:, DEPENDENT * motions.S[0] < motions.S]
                flat = vectors.matrix.reshape(-1, len(q))
                yield _Wish(flat - rigid @ (rigid.T @ flat), np.zeros(len(flat)))

    def _moves(self, lane: int) -> bool:
        """Return whether the rates satisfy the constraints and all statements, guesses included."""
        constraints, pace = self._moving(lane)
        every = (constraints, *self._stated(lane), *self._straining(lane))
        return all(one.off(self.v[:, lane]) <= CLOSED * pace for one in every)

    def _move(self, lane: int) -> bool:
        """Find rates that satisfy the constraints and the statements; return false if there are none."""
        if self._moves(lane):
            return True
        (constraints, pace), asked, v = self._moving(lane), self._stated(lane), self.v[:, lane].copy()
        root = np.linalg.cholesky(self._mass(lane))

        def nearest(wish: _Wish, v: Array) -> Array:
            move = np.linalg.lstsq(np.linalg.solve(root, wish.rows.T).T, wish.values - wish.rows @ v, DEPENDENT)[0]
            return np.asarray(v + np.linalg.solve(root.T, move))

        firm = [one for one in asked if one.is_firm]
        held = _joined([constraints, *firm])
        v = nearest(held, v)
        for wish in (*self._straining(lane), *(one for one in asked if not one.is_firm)):
            more = _joined([held, wish])
            if more.off(moved := nearest(more, v)) <= MET * pace:
                v, held = moved, more
        left = held.rows @ v - held.values
        worst = int(np.argmax(np.abs(left))) if left.size else 0
        if left.size and abs(left[worst]) > ROUNDING * pace:
            if self.lanes == 1 and worst < len(constraints.values) and not firm:
                raise InputError(f"joints.{self.moving_terms[worst].name}: cannot begin to move as it is driven")
            return self._kept(firm, v, 0.0)
        if left.size and abs(left[worst]) > MET * pace:  # digits of stated rates: the joints come first
            v = nearest(constraints, v)
            if not self._kept(firm, v, ROUNDING * pace):
                return False
        self.v[:, lane] = v
        return True

    def _kept(self, firm: list[_Wish], v: Array, allowed: float) -> bool:
        """Return whether rates are the stated ones but for rounding.

        Raises InputError of a single scene if they are not.
        """
        worst = max(firm, key=lambda one: one.off(v), default=None)
        if worst is None or worst.off(v) <= allowed:
            return True
        if self.lanes > 1:
            return False
        assert worst.stated is not None
        raise InputError(
            f"{worst.stated.path}: contradicts the joints and the other rates, by {worst.off(v):.3g}; leave it out "
            "and it follows from the rest"
        )

    def _mass(self, lane: int) -> Array:
        from shoal.mechanics.assembly.masses import Masses
        from shoal.mechanics.derived import RowAllocator

        count = len(self.q)
        matrix = np.zeros((count, count))
        for (i, j), value in Masses(self.scene, self.placement, RowAllocator(count)).mass.items():
            matrix[i, j] = matrix[j, i] = np.ravel(value)[min(lane, np.size(value) - 1)]
        return matrix


def _joined(wishes: list[_Wish]) -> _Wish:
    """Return the equations of all."""
    rows, values = zip(*((one.rows, one.values) for one in wishes), strict=True)
    return _Wish(np.vstack(rows), np.concatenate(values))
