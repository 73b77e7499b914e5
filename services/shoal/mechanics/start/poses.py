"""Position analysis: poses that satisfy the loop closure equations, by the Levenberg-Marquardt method.

Stated poses are held; the step is the least displacement of the bodies. Where it fails from the first guess, angles
that are not stated are shaken, a little at first. Many lanes are one batch.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from shoal.mechanics import rotation as turns
from shoal.mechanics.joints import of_scene
from shoal.mechanics.numerics.levenberg_marquardt import levenberg_marquardt
from shoal.mechanics.numerics.tile import Array, Flags, Index
from shoal.mechanics.reach import extents, span
from shoal.mechanics.start.closure import Closure, Poses
from shoal.mechanics.start.rigid_bodies import RigidBodies
from shoal.mechanics.start.walk import Walk, guessed_angles
from shoal.scene import PointMass, Scene
from shoal.scene.initial import POSES, Quantity

CLOSED = 1e-11
"""A joint with a smaller residual, relative to the size of the machine or in rad, is closed."""
ROUNDING = 1e-4
"""Stated values may miss by so much, relative to the size of the machine or in rad, and are then corrected."""
ITERATIONS = 80
ATTEMPTS = 24
"""Guesses for one machine; of many lanes fewer are tried."""
FEW = 6
FEWER = 8
"""While a contradiction is narrowed down, in half of the iterations."""
_SHAKEN = 1200
"""Poses of all guesses of one machine together: to shake a long chain at random hardly ever helps."""
GAIN = 1e-6
"""A step that promises to lower the squared gaps by less than this part ends a search: nothing near closes."""
SMALLEST = 1e-13
"""Of the damping, so that equations of rows that depend on others can be solved."""
DEPENDENT = 1e-6
"""Part of a pose that the joints leave free, below which they determine it."""
TURNS = {2: (2,), 3: (3, 4, 5)}
"""Columns of a body that are turns, by the number of dimensions; those before are displacements."""
PLACES = ("position", "velocity")


@dataclass(frozen=True)
class Statement:
    """A stated quantity of a body: columns of displacements or rates, and values as stated (lanes, components).

    numbers: of the poses, which are `put` (lanes, numbers). firm: not a guess
    """

    body: str
    quantity: Quantity
    columns: tuple[int, ...]
    values: Array
    numbers: tuple[int, ...]
    put: Array
    firm: bool

    @property
    def path(self) -> str:
        """The path of its field in the scene."""
        return f"initial.{self.body}.{self.quantity}"


class Placed(NamedTuple):
    """Poses (lanes, numbers), and whether they close the joints and keep the stated values, (lanes,)."""

    poses: Array
    ok: Flags


def stated(scene: Scene, lanes: int, quantities: tuple[Quantity, ...]) -> list[Statement]:
    """Return the statements of these quantities: first the firm ones, then guesses, each in the order of the scene."""
    found, d = [], scene.dimensions
    width, size = (3, 3) if d == 2 else (6, 12)
    number = {name: k for k, name in enumerate(scene.bodies)}
    for name, start in scene.initial.items():
        for quantity in quantities:
            value = getattr(start, quantity)
            if value is None or (d == 3 and quantity not in PLACES and isinstance(scene.bodies[name], PointMass)):
                continue
            parts = value if isinstance(value, tuple) else (value,)
            columns: Iterable[int] = TURNS[d]
            if quantity in PLACES:
                parts, columns = (*parts, 0.0)[:d], range(d)
            put = values = np.stack([np.broadcast_to(np.asarray(part, dtype=float), lanes) for part in parts], 1)
            numbers = columns
            if d == 3 and quantity in ("angle", "rotation"):
                turn = turns.about_z(values[:, 0]) if quantity == "angle" else turns.of_vector(values.T)
                numbers, put = range(3, size), np.moveaxis(turn, -1, 0).reshape(lanes, 9)
            own, its = (tuple(k + n * number[name] for k in some) for n, some in ((width, columns), (size, numbers)))
            found.append(Statement(name, quantity, own, values, its, put, quantity not in start.guess))
    return sorted(found, key=lambda one: not one.firm)


class Assembly:
    """The search for the poses of one scene, of one or many lanes.

    bodies: rigid bodies that the joints refer to; begin: poses of the first guess, by default those of the walk along
    the joints of the plane
    """

    def __init__(self, scene: Scene, lanes: int, bodies: RigidBodies | None = None, begin: Poses | None = None) -> None:
        self.scene, self.lanes = scene, lanes
        self.walk = Walk(scene)
        self.statements = stated(scene, lanes, POSES)
        self.turns = TURNS[scene.dimensions]
        self._begin = begin
        self.angles, self.rates = guessed_angles(scene, lanes) if begin is None else (np.zeros((lanes, 0)),) * 2
        self._columns = np.zeros((lanes, len(scene.bodies) * (scene.dimensions + len(self.turns))), dtype=bool)
        self.guess = self._guess(0, self._columns)
        self.size = span(scene)
        arms = np.array([max(float(np.max(arm)), 1e-3 * self.size) for arm in extents(scene).values()])
        one = [np.ones_like(arms)] * scene.dimensions
        self.give = np.stack([*one, *[arms**-2] * len(self.turns)], 1).ravel()
        """Inverse of the metric in which displacements are measured, (columns,)."""
        self.units = np.stack([*[self.size * part for part in one], *one[:1] * len(self.turns)], 1).ravel()
        """Of the columns: the size of the machine [m] and 1 rad."""
        self.closure = Closure(scene, self.guess, bodies=bodies)
        self._sought: dict[tuple[bytes, bytes], Placed] = {}
        """What was looked for before: where it is not there, the reason is sought by the same steps."""
        self._left_free = (b"", b""), self._columns
        """Coordinates and what is kept of them, as bytes, and which columns these and the joints leave free."""
        self.effort = 0
        """Residuals evaluated while closing joints, those of many lanes at once counted once."""

    def _guess(self, attempt: int, keep: Flags) -> Array:
        """Poses of the first guess; later attempts shake the turns that are not in `keep`, (lanes, columns)."""
        count = len(self.scene.bodies)
        shaken = np.zeros((count, len(self.turns)))
        if attempt:
            rng = np.random.default_rng(attempt)
            shaken = min(0.3 * attempt, np.pi) * rng.uniform(-1.0, 1.0, shaken.shape)
        turn = shaken * ~self._turning(keep)
        if self._begin is None:
            return self.walk.poses(self.angles + turn[..., 0], self.rates)[0]
        return self._begin.moved(np.pad(turn, ((0, 0), (0, 0), (len(self.turns), 0)))).numbers

    def _turning(self, columns: Flags) -> Flags:
        """Return those of columns (lanes, columns) that are turns, (lanes, bodies, turns)."""
        return columns.reshape(len(columns), len(self.scene.bodies), -1)[..., self.turns]

    def held(self, chosen: Iterable[Statement], near: Array | None = None) -> tuple[Flags, Array]:
        """Return flags of the columns that statements fix, (lanes, columns), and poses with them, else near others."""
        fixed, poses = self._columns.copy(), (self.guess if near is None else near).copy()
        for one in chosen:
            fixed[:, one.columns], poses[:, one.numbers] = True, one.put
        return fixed, poses

    def run(self) -> Placed:
        """Return poses with all statements, or with as many as the joints allow."""
        found = self.seek(self.statements)
        if np.all(found.ok):
            return found
        loose = self._in_order()
        return Placed(np.where(found.ok[:, None], found.poses, loose.poses), found.ok | loose.ok)

    def seek(self, chosen: Sequence[Statement], near: Array | None = None) -> Placed:
        """Poses with some statements held, from one guess after another (or near one)."""
        fixed, begin = self.held(chosen, near)
        asked = fixed.tobytes(), begin.tobytes()
        if asked not in self._sought:
            self._sought[asked] = self._seek(chosen, near, self._attempts if self.lanes == 1 else FEW)
        return self._sought[asked]

    def closes(self, chosen: list[Statement], joints: Sequence[str]) -> bool:
        """Return whether these joints of one machine close with these statements held: a few guesses, all at once."""
        fixed, first = self.held(chosen)
        begin = self.held(chosen, np.concatenate([self._guess(number, fixed) for number in range(FEWER)]))[1]
        for own in (True, False) if self._own else (True,):
            closure = self.closure.at(first, own)
            rows = closure.rows(self.close(closure, begin, fixed, most=ITERATIONS // 2)[0])
            gap = np.abs(rows.gap / np.where(rows.angular, 1.0, self.size))[:, np.isin(rows.names, joints)]
            if np.any(np.max(gap, axis=1, initial=0.0) <= CLOSED):
                return True
        return False

    @property
    def _attempts(self) -> int:
        return int(np.clip(_SHAKEN // max(self._columns.shape[1], 1), FEW, ATTEMPTS))

    def _seek(self, chosen: Sequence[Statement], near: Array | None, most: int) -> Placed:
        fixed, best = self.held(chosen)
        first, ok = best, np.zeros(self.lanes, dtype=bool)
        if np.all(self._turning(fixed)):  # every guess is the first
            most = 1 if near is None else 2
        for own in (True, False) if self._own else (True,):
            closure = self.closure.at(first, own)
            for attempt in range(most):
                if attempt == 1 and self.lanes == 1:
                    # The later guesses at once, as lanes: they take as long as two, and the first that closes is taken.
                    others = np.concatenate([self._guess(number, fixed) for number in range(1, most)])
                    poses, gap = self.close(closure, self.held(chosen, others)[1], fixed)
                    if np.any(gap <= CLOSED):
                        return Placed(poses[[np.argmax(gap <= CLOSED)]], ~ok)
                    break
                begin = near if near is not None and not attempt else self._guess(attempt, fixed)
                poses, gap = self.close(closure, self.held(chosen, begin)[1], fixed)
                better = ~ok & (gap <= CLOSED)
                best, ok = np.where(better[:, None], poses, best), ok | better
                if np.all(ok):
                    return Placed(best, ok)
        return Placed(best, ok)

    def others(self, poses: Array) -> Iterator[Array]:
        """Yield other poses of one machine that keep all firm statements, each once (other assembly modes)."""
        firm = [one for one in self.statements if one.firm]
        fixed, first = self.held(firm)
        shaken = np.concatenate([self._guess(attempt, fixed) for attempt in range(1, ATTEMPTS)])
        found, gap = self.close(self.closure.at(first), self.held(firm, shaken)[1], fixed)
        known = [poses]
        for closed in np.flatnonzero(gap <= CLOSED):
            other = found[[closed]]
            # Turns of a body are one pose.
            if min(np.max(np.abs(self._poses(other).axes - self._poses(one).axes)) for one in known) > 1e-6:
                known.append(other)
                yield other

    @property
    def _own(self) -> bool:
        """Return whether joints keep what the start gives them."""
        return any(one.is_of_start for _, one in of_scene(self.scene))

    def close(
        self, closure: Closure, u: Array, fixed: Flags, weight: Array | None = None, most: int = ITERATIONS
    ) -> tuple[Array, Array]:
        """Poses from u on with some held, and the largest gap left [1], (lanes,). weight: of every row; most: steps."""
        if not closure.names:
            return u, np.zeros(len(u))
        free = np.broadcast_to(np.where(fixed, 0.0, self.give), (len(u), len(self.give)))
        length = np.where(closure.angular, 1.0, self.size) / (1.0 if weight is None else weight)

        def evaluate(poses: Array, lanes: Index) -> tuple[Array, Array]:
            rows = (closure if len(lanes) == len(u) else closure.of_lanes(lanes)).rows(poses)
            self.effort += len(rows.names)
            return rows.gap / length, rows.slope / length[:, None]

        def solve(gap: Array, slope: Array, damping: Array, lanes: Index) -> Array:
            # Displacements of least size, J W J' + mu |gap| in units of the rows (Yamashita and Fukushima 2001).
            each = slope * free[lanes, None, :]
            scale = np.sqrt(np.einsum("lki,i,lki->lk", slope, self.give, slope))
            scale = np.where(scale > 0, scale, 1.0)  # what closes a rod upon itself depends on no pose
            matrix = each @ slope.transpose(0, 2, 1) / scale[:, :, None] / scale[:, None, :]
            small = np.maximum(damping * np.linalg.norm(gap, axis=1), SMALLEST)
            matrix += small[:, None, None] * np.eye(matrix.shape[1])
            multiplier = np.linalg.solve(matrix, (gap / scale)[..., None])[..., 0] / scale
            return np.asarray(-np.einsum("lki,lk->li", each, multiplier))

        limits = {"gain": GAIN, "close": 1e-15, "round_off": 1e-12}
        found = levenberg_marquardt(evaluate, solve, u, **limits, most=most, move=self._moved)
        return found.points, np.max(np.abs(found.residuals), axis=1)

    def _poses(self, u: Array) -> Poses:
        return Poses.of(u, len(self.scene.bodies))

    def _moved(self, u: Array, step: Array) -> Array:
        """Poses after small displacements."""
        if self._begin is None:
            return np.asarray(u + step)
        return self._poses(u).moved(step.reshape(len(u), len(self.scene.bodies), -1)).numbers

    def _in_order(self) -> Placed:
        """Keep statements one after the other; firm ones must all be met, up to the rounding of their digits."""
        firm = [one for one in self.statements if one.firm]
        fixed, wanted = self.held(firm)
        found = self.seek(firm)
        kept, ok, u = fixed & found.ok[:, None], found.ok, found.poses
        if not np.all(ok):
            free = self.seek([], wanted)
            u, ok = np.where(ok[:, None], u, free.poses), ok | free.ok
            if not np.any(ok):
                return Placed(u, ok)
            for one in firm:
                u, kept = self._keep(one, u, kept)
            missed = np.max(self._poses(u).away(self._poses(wanted)) * fixed / self.units, axis=1, initial=0.0)
            ok &= missed <= ROUNDING
        for one in self.statements:
            if not one.firm:
                u, kept = self._keep(one, u, kept)
        return Placed(u, ok)

    def _keep(self, one: Statement, u: Array, kept: Flags) -> tuple[Array, Flags]:
        """Hold one more statement in the lanes where that can be."""
        more, wanted = kept.copy(), u.copy()
        more[:, one.columns], wanted[:, one.numbers] = True, one.put
        trying = ~np.all(kept[:, one.columns], axis=1)
        met = self._poses(u).away(self._poses(wanted))[:, one.columns] < CLOSED
        if not np.any(trying) or not np.any(self._free(one, u, kept) | met):
            return u, kept
        found, gap = self.close(self.closure.at(wanted, own=False), wanted, more)
        better = trying & (gap <= CLOSED)
        return np.where(better[:, None], found, u), np.where(better[:, None], more, kept)

    def _free(self, one: Statement, u: Array, kept: Flags) -> Flags:
        """Return whether the joints and what is kept leave the columns of a statement free, (lanes, columns)."""
        state = u.tobytes(), kept.tobytes()
        if self._left_free[0] != state:
            slope = self.closure.at(u, own=False).rows(u).slope * np.sqrt(np.where(kept, 0.0, self.give))[:, None, :]
            basis = np.linalg.svd(slope, full_matrices=False)
            rank = DEPENDENT * np.max(basis.S, axis=1, initial=1e-300, keepdims=True) < basis.S
            determined = np.einsum("lri,lr->li", basis.Vh**2, rank.astype(float))
            self._left_free = state, 1.0 - determined > DEPENDENT
        return self._left_free[1][:, one.columns]
