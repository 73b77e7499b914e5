"""Consistent initial conditions in space: poses as in the plane (`start.poses`), rates of least kinetic energy.

The rates are those of the machine's coordinates, with its mass matrix, as flexible rods may start to stretch. Stated
values are kept exactly if possible; all others follow from them, with the least change.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import reach
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, matrices
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.locking import require_unlocked
from shoal.mechanics.assembly.space.placement import place_in_space
from shoal.mechanics.assembly.space.rigid_bodies import SpatialBodies
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.numerics.tile import Array, Flags, Index, Number, stacked
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


AT_ONCE = 64
"""Lanes whose rates are found in one batch: the memory of their matrices, (unknowns, unknowns) each, stays bounded."""


class _Wish(NamedTuple):
    """Equations rows v = values of the rates, (lanes or 1, equations, unknowns) and (lanes or 1, equations).

    allowed: orthonormal residuals that count for nothing, (lanes, equations, ...)
    """

    rows: Array
    values: Array
    stated: Statement | None = None
    allowed: Array | None = None

    @property
    def is_firm(self) -> bool:
        """Return whether it is a statement, and not a guess."""
        return self.stated is not None and self.stated.firm

    def left(self, v: Array) -> Array:
        """Return the residuals at rates (lanes, unknowns), (lanes, equations)."""
        return self._counting((self.rows @ v[..., None]) - self.values[..., None])[..., 0]

    def off(self, v: Array) -> Array:
        """Return the largest residual at rates, (lanes,)."""
        return np.asarray(np.max(np.abs(self.left(v)), axis=1, initial=0.0))

    def of(self, chosen: Flags) -> _Wish:
        """Return the equations of some lanes, which ask for nothing in the others, and allow for nothing."""
        return _Wish(self._counting(self.rows) * chosen[:, None, None], self.values * chosen[:, None])

    def _counting(self, residuals: Array) -> Array:
        if self.allowed is None:
            return residuals
        return np.asarray(residuals - self.allowed @ (self.allowed.swapaxes(1, 2) @ residuals))


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
        if heavy > self.lanes and not failed[0] and not self._moves(np.zeros(1, dtype=np.int64))[0]:
            self._spread(heavy)
            failed = np.repeat(failed, heavy)
        moving = np.flatnonzero(~failed)
        for first in range(0, len(moving), AT_ONCE):
            lanes = moving[first : first + AT_ONCE]
            failed[lanes] = ~self._move(lanes)
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
        if not rigid:
            return np.zeros(1)
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

    def _moving(self, lanes: Index) -> tuple[_Wish, Array]:
        """Return the constraints on the rates of some lanes, by their scales, and their largest rates."""
        scale = np.array([self.size**term.lengths for term in self.moving_terms])
        slope = self.moving.of_lanes(lanes).jacobian(self.q[:, lanes].T) / scale[:, None]
        fastest = np.max(np.abs(self.v[:, lanes]), axis=0, initial=1.0)
        return _Wish(slope, -self.moving.drift[None] / scale), np.asarray(fastest)

    def _vectors(self, vectors: Sequence[Affine], lanes: Index) -> tuple[Array, Array]:
        """Return the matrices of vectors (see `affine.matrices`), and the vectors at the start, (lanes, vectors, 3)."""
        matrix, constant = matrices(vectors, len(self.q), lanes)
        flat = matrix.reshape(len(matrix), 3 * len(vectors), len(self.q))
        return matrix, (flat @ self.q[:, lanes].T[..., None]).reshape(len(lanes), len(vectors), 3) + constant

    def _stated(self, lanes: Index) -> list[_Wish]:
        """Return the stated rates."""
        found = []
        for one in stated(self.scene, self.lanes, RATES):
            frame, values = self.placement.frames[one.body], one.values[lanes]
            if one.quantity == "velocity":
                found.append(_Wish(self._vectors([frame.point((0.0, 0.0, 0.0))], lanes)[0][:, 0], values, one))
            elif isinstance(frame, RigidFrame):
                matrix, directors = self._vectors(frame.directors, lanes)
                spin = np.pad(values, ((0, 0), (3 - values.shape[1], 0)))
                turning = np.cross(spin[:, None], directors).reshape(len(lanes), 9)
                found.append(_Wish(matrix.reshape(len(matrix), 9, -1), turning, one))
        return found

    def _straining(self, lanes: Index) -> Iterator[_Wish]:
        """Yield for every flexible rod the rates that vanish in rigid motions of its vectors.

        A rod starts as a rigid body moves, unless the joints forbid it.
        """
        for frame in self.placement.frames.values():
            if isinstance(frame, BeamFrame):
                matrix, vectors = self._vectors(frame.vectors, lanes)
                count = 3 * vectors.shape[1]
                turning = -np.moveaxis(turns.skew(np.moveaxis(vectors, -1, 0)), (0, 1), (-2, -1))
                places = np.arange(vectors.shape[1]) % len(frame.nodes[0]) == 0
                moving = np.broadcast_to(places[:, None, None] * np.eye(3), turning.shape)
                motions = np.linalg.svd(np.concatenate([turning, moving], 3).reshape(-1, count, 6), full_matrices=False)
                rigid = motions.U * (DEPENDENT * motions.S[:, :1] < motions.S)[:, None]
                yield _Wish(matrix.reshape(len(matrix), count, -1), np.zeros((1, count)), allowed=rigid)

    def _rests(self, lanes: Index) -> bool:
        """Return whether nothing moves and nothing is asked to."""
        asked = (one.values[lanes] for one in stated(self.scene, self.lanes, RATES))
        return not (np.any(self.v[:, lanes]) or np.any(self.moving.drift) or any(map(np.any, asked)))

    def _moves(self, lanes: Index) -> Flags:
        """Return whether the rates satisfy the constraints and all statements, guesses included, (lanes,)."""
        if self._rests(lanes):
            return np.ones(len(lanes), dtype=bool)
        constraints, pace = self._moving(lanes)
        every = (constraints, *self._stated(lanes), *self._straining(lanes))
        return np.asarray(np.all([one.off(self.v[:, lanes].T) <= CLOSED * pace for one in every], axis=0))

    def _move(self, lanes: Index) -> Flags:
        """Find rates that satisfy the constraints and the statements; return which lanes have some, (lanes,)."""
        found = self._moves(lanes)
        if np.all(found):
            return found
        every, lanes = lanes, lanes[~found]
        (constraints, pace), asked, v = self._moving(lanes), self._stated(lanes), self.v[:, lanes].T
        root = np.linalg.cholesky(self._mass(lanes))

        def nearest(wish: _Wish, v: Array) -> Array:
            rows = np.linalg.solve(root, wish.rows.swapaxes(1, 2)).swapaxes(1, 2)
            parts = np.linalg.svd(rows, full_matrices=False)
            large = DEPENDENT * np.max(parts.S, axis=1, initial=0.0, keepdims=True) < parts.S
            along = parts.U.swapaxes(1, 2) @ -wish.left(v)[..., None]
            along *= (large / np.where(large, parts.S, 1.0))[..., None]
            move = parts.Vh.swapaxes(1, 2) @ along
            return np.asarray(v + np.linalg.solve(root.swapaxes(1, 2), move)[..., 0])

        firm = [one for one in asked if one.is_firm]
        held = _joined([constraints, *firm], len(lanes))
        v = nearest(held, v)
        for wish in (*self._straining(lanes), *(one for one in asked if not one.is_firm)):
            more = _joined([held, wish.of(np.ones(len(lanes), dtype=bool))], len(lanes))
            moved = nearest(more, v)
            if np.any(kept := more.off(moved) <= MET * pace):
                v, held = np.where(kept[:, None], moved, v), _joined([held, wish.of(kept)], len(lanes))
        left = held.off(v)
        stuck = left > ROUNDING * pace
        if self.lanes == 1 and stuck[0] and not firm:
            worst = int(np.argmax(np.abs(held.left(v)[0])))
            if worst < len(self.moving_terms):
                raise InputError(f"joints.{self.moving_terms[worst].name}: cannot begin to move as it is driven")
        # Digits of stated rates: the joints come first.
        rounded = (left > MET * pace) & ~stuck
        if np.any(rounded):
            v = np.where(rounded[:, None], nearest(constraints, v), v)
        allowed = np.where(rounded, ROUNDING * pace, np.where(stuck, 0.0, np.inf))
        kept = self._kept(firm, v, allowed)
        self.v[:, lanes] = np.where(kept & ~stuck, v.T, self.v[:, lanes])
        found[np.isin(every, lanes)] = kept
        return found

    def _kept(self, firm: list[_Wish], v: Array, allowed: Array) -> Flags:
        """Return whether rates are the stated ones but for rounding, (lanes,).

        Raises InputError of a single scene if they are not.
        """
        kept = np.ones(len(v), dtype=bool)
        for one in firm:
            kept &= one.off(v) <= allowed
        if self.lanes == 1 and not kept[0]:
            worst = max(firm, key=lambda one: float(one.off(v)[0]))
            assert worst.stated is not None
            raise InputError(
                f"{worst.stated.path}: contradicts the joints and the other rates, by {worst.off(v)[0]:.3g}; leave it "
                "out and it follows from the rest"
            )
        return kept

    def _mass(self, lanes: Index) -> Array:
        """Return the mass matrices of some lanes, (lanes, unknowns, unknowns)."""
        matrix = np.zeros((len(lanes), len(self.q), len(self.q)))
        for (i, j), value in self._mass_entries.items():
            numbers = np.ravel(value)
            matrix[:, i, j] = matrix[:, j, i] = numbers[np.minimum(lanes, len(numbers) - 1)]
        return matrix

    @cached_property
    def _mass_entries(self) -> Mapping[tuple[int, int], Number]:
        from shoal.mechanics.assembly.masses import Masses
        from shoal.mechanics.derived import RowAllocator

        return Masses(self.scene, self.placement, RowAllocator(len(self.q))).mass


def _joined(wishes: list[_Wish], lanes: int) -> _Wish:
    """Return the equations of all, of each lane."""
    rows = [np.broadcast_to(one.rows, (lanes, *one.rows.shape[1:])) for one in wishes]
    values = [np.broadcast_to(one.values, (lanes, one.values.shape[1])) for one in wishes]
    return _Wish(np.concatenate(rows, axis=1), np.concatenate(values, axis=1))
