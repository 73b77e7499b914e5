"""Position analysis: poses that satisfy the loop closure equations, by the Levenberg-Marquardt method.

Stated poses are held; the step is the least displacement of the bodies. Where it fails from the first guess, angles
that are not stated are shaken, a little at first. Many lanes are one batch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from shoal.mechanics.joints import of_scene
from shoal.mechanics.numerics.tile import Array, Flags
from shoal.mechanics.reach import extents, span
from shoal.mechanics.start.closure import Closure
from shoal.mechanics.start.walk import Walk, guessed_angles
from shoal.scene import Scene
from shoal.scene.initial import Quantity

CLOSED = 1e-11
"""A joint that gapes by less, relative to the size of the machine or in rad, is closed."""
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
_PATIENCE, _STANDS = 8, 0.99
"""In so many steps a search that does not stand still lowers its gaps to less than this part."""
DEPENDENT = 1e-6
"""Part of a pose that the joints leave free, below which they determine it."""


@dataclass(frozen=True)
class Statement:
    """A stated quantity of a body: columns of the poses or rates, and values (lanes, columns). firm: not a guess."""

    body: str
    quantity: Quantity
    columns: tuple[int, ...]
    values: Array
    firm: bool

    @property
    def path(self) -> str:
        """The path of its field in the scene."""
        return f"initial.{self.body}.{self.quantity}"


class Placed(NamedTuple):
    """Poses (lanes, 3 bodies), and whether they close the joints and keep the stated values, (lanes,)."""

    poses: Array
    ok: Flags


def stated(scene: Scene, lanes: int, quantities: tuple[Quantity, ...]) -> list[Statement]:
    """Return the statements of these quantities: first the firm ones, then guesses, each in the order of the scene."""
    found = []
    number = {name: 3 * k for k, name in enumerate(scene.bodies)}
    for name, start in scene.initial.items():
        for quantity in quantities:
            value = getattr(start, quantity)
            if value is None:
                continue
            turning = quantity in ("angle", "rate")
            columns = (number[name] + 2,) if turning else (number[name], number[name] + 1)
            parts = (value,) if turning else value
            values = np.stack([np.broadcast_to(np.asarray(part, dtype=float), lanes) for part in parts], 1)
            found.append(Statement(name, quantity, columns, values, quantity not in start.guess))
    return sorted(found, key=lambda one: not one.firm)


class Assembly:
    """The search for the poses of one scene, of one or many lanes."""

    def __init__(self, scene: Scene, lanes: int) -> None:
        self.scene, self.lanes = scene, lanes
        self.walk = Walk(scene)
        self.statements = stated(scene, lanes, ("angle", "position"))
        self.angles, self.rates = guessed_angles(scene, lanes)
        self.closure = Closure(scene, np.zeros((lanes, 3 * len(scene.bodies))))
        self.guess = self._guess(0, np.ones(self.angles.shape, dtype=bool))
        self.size = span(scene)
        arms = np.array([max(float(np.max(arm)), 1e-3 * self.size) for arm in extents(scene).values()])
        self.give = np.stack([np.ones_like(arms), np.ones_like(arms), arms**-2], 1).ravel()
        """Inverse of the metric in which displacements are measured, (3 bodies,)."""
        self.closure = self.closure.at(self.guess)
        self._sought: dict[tuple[bytes, bytes], Placed] = {}
        """What was looked for before: where it is not there, the reason is sought by the same steps."""
        self.effort = 0
        """Gaps that were looked at while closing joints, those of many lanes at once counted once."""

    def _guess(self, attempt: int, keep: Flags) -> Array:
        """Poses from the stated angles; later attempts shake those not in `keep`, (lanes, bodies)."""
        angles = self.angles
        if attempt:
            rng = np.random.default_rng(attempt)
            shaken = min(0.3 * attempt, np.pi) * rng.uniform(-1.0, 1.0, angles.shape[1])
            angles = np.where(keep, angles, angles + shaken)
        return self.walk.poses(angles, self.rates)[0]

    def held(self, chosen: list[Statement]) -> tuple[Flags, Array]:
        """Return flags of the poses that these statements fix, and their values; each (lanes, 3 bodies)."""
        fixed, values = np.zeros(self.guess.shape, dtype=bool), np.zeros(self.guess.shape)
        for one in chosen:
            fixed[:, one.columns], values[:, one.columns] = True, one.values
        return fixed, values

    def run(self) -> Placed:
        """Return poses with all statements, or with as many as the joints allow."""
        fixed, values = self.held(self.statements)
        found = self.seek(fixed, values)
        if np.all(found.ok):
            return found
        loose = self._in_order()
        return Placed(np.where(found.ok[:, None], found.poses, loose.poses), found.ok | loose.ok)

    def seek(self, fixed: Flags, values: Array, near: Array | None = None) -> Placed:
        """Poses with some held, from one guess after another (or near one)."""
        begun = np.where(fixed, values, self.guess if near is None else near)
        asked = (fixed.tobytes(), begun.tobytes())
        if asked not in self._sought:
            self._sought[asked] = self._seek(fixed, values, near, self._attempts if self.lanes == 1 else FEW)
        return self._sought[asked]

    def closes(self, chosen: list[Statement], joints: Sequence[str]) -> bool:
        """Return whether these joints of one machine close with these statements held: a few guesses, all at once."""
        fixed, values = self.held(chosen)
        begin = np.concatenate([self._guess(number, fixed[:, 2::3]) for number in range(FEWER)])
        for own in (True, False) if self._own else (True,):
            closure = self.closure.at(np.where(fixed, values, self.guess), own)
            rows = closure.rows(self.close(closure, np.where(fixed, values, begin), fixed, most=ITERATIONS // 2)[0])
            gap = np.abs(rows.gap / np.where(rows.angular, 1.0, self.size))[:, np.isin(rows.names, joints)]
            if np.any(np.max(gap, axis=1, initial=0.0) <= CLOSED):
                return True
        return False

    @property
    def _attempts(self) -> int:
        return int(np.clip(_SHAKEN // max(self.guess.shape[1], 1), FEW, ATTEMPTS))

    def _seek(self, fixed: Flags, values: Array, near: Array | None, most: int) -> Placed:
        best, ok = np.where(fixed, values, self.guess), np.zeros(self.lanes, dtype=bool)
        for own in (True, False) if self._own else (True,):
            closure = self.closure.at(np.where(fixed, values, self.guess), own)
            for attempt in range(most):
                if attempt == 1 and self.lanes == 1:
                    # The later guesses at once, as lanes: they take as long as two, and the first that closes is taken.
                    others = [self._guess(number, fixed[:, 2::3]) for number in range(1, most)]
                    poses, gap = self.close(closure, np.where(fixed, values, np.concatenate(others)), fixed)
                    if np.any(gap <= CLOSED):
                        return Placed(poses[[np.argmax(gap <= CLOSED)]], ~ok)
                    break
                begin = near if near is not None and not attempt else self._guess(attempt, fixed[:, 2::3])
                poses, gap = self.close(closure, np.where(fixed, values, begin), fixed)
                better = ~ok & (gap <= CLOSED)
                best, ok = np.where(better[:, None], poses, best), ok | better
                if np.all(ok):
                    return Placed(best, ok)
        return Placed(best, ok)

    def others(self, poses: Array) -> Iterator[Array]:
        """Yield other poses of one machine that keep all firm statements, each once (other assembly modes)."""
        fixed, values = self.held([one for one in self.statements if one.firm])
        known, first = [poses], np.where(fixed, values, self.guess)
        shaken = [self._guess(attempt, fixed[:, 2::3]) for attempt in range(1, ATTEMPTS)]
        found, gap = self.close(self.closure.at(first), np.where(fixed, values, np.concatenate(shaken)), fixed)
        for closed in np.flatnonzero(gap <= CLOSED):
            other = found[[closed]]
            # Turns of a body are one pose.
            away = [np.max(np.abs(np.exp(1j * (other - one)[:, 2::3]) - 1.0)) for one in known]
            if min(away) > 1e-6:
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
        free = np.where(fixed, 0.0, self.give)
        u = u.copy()
        rows = closure.rows(u)
        if not len(rows.names):
            return u, np.zeros(len(u))
        length = np.where(rows.angular, 1.0, self.size) / (1.0 if weight is None else weight)
        gap = rows.gap / length
        norm = np.linalg.norm(gap, axis=1)
        damping = np.full(len(u), 1e-3)
        running = norm > 1e-15
        if not np.any(running):
            return u, np.max(np.abs(gap), axis=1)
        slope = rows.slope / length[:, None]
        before = np.full(len(u), np.inf)
        for iteration in range(most):
            if not np.any(running):
                break
            each = slope * free[:, None, :]
            matrix = each @ slope.transpose(0, 2, 1)
            scale = np.sqrt(np.einsum("lkk->lk", slope * self.give @ slope.transpose(0, 2, 1)))
            scale = np.where(scale > 0, scale, 1.0)  # what closes a rod upon itself depends on no pose
            matrix = matrix / scale[:, :, None] / scale[:, None, :]
            small = np.clip(damping * norm, 1e-13, 1e3)
            matrix += small[:, None, None] * np.eye(matrix.shape[1])
            multiplier = np.linalg.solve(matrix, (gap / scale)[..., None])[..., 0] / scale
            step = -np.einsum("lki,lk->li", each, multiplier)
            ahead = u + np.where(running[:, None], step, 0.0)
            rows = closure.rows(ahead)
            self.effort += len(rows.names)
            new = np.linalg.norm(rows.gap / length, axis=1)
            taken = running & (new < norm)
            damping = np.where(taken, damping / 10.0, damping * 10.0)
            stalled = (norm < 1e-12) & ~(new < 0.5 * norm)
            u = np.where(taken[:, None], ahead, u)
            gap = np.where(taken[:, None], rows.gap / length, gap)
            slope = np.where(taken[:, None, None], rows.slope / length[:, None], slope)
            norm = np.where(taken, new, norm)
            running &= (norm > 1e-15) & ~stalled & (damping * norm < 1e6)
            if iteration % _PATIENCE == _PATIENCE - 1:
                running &= (norm < _STANDS * before) | (norm < ROUNDING)
                before = norm
        return u, np.max(np.abs(gap), axis=1)

    def _in_order(self) -> Placed:
        """Keep statements one after the other; firm ones must all be met, up to the rounding of their digits."""
        firm = [one for one in self.statements if one.firm]
        fixed, values = self.held(firm)
        found = self.seek(fixed, values)
        kept, ok, u = fixed & found.ok[:, None], found.ok, found.poses
        if not np.all(ok):
            none = np.zeros_like(fixed)
            near = np.where(fixed, values, self.guess)
            free = self.seek(none, values, near)
            u, ok = np.where(ok[:, None], u, free.poses), ok | free.ok
            if not np.any(ok):
                return Placed(u, ok)
            for one in firm:
                u, kept = self._keep(one, u, kept)
            length = np.tile([self.size, self.size, 1.0], len(self.scene.bodies))
            missed = np.max(np.abs(u - values) * fixed / length, axis=1, initial=0.0)
            ok &= missed <= ROUNDING
        for one in self.statements:
            if not one.firm:
                u, kept = self._keep(one, u, kept)
        return Placed(u, ok)

    def _keep(self, one: Statement, u: Array, kept: Flags) -> tuple[Array, Flags]:
        """Hold one more statement in the lanes where that can be."""
        more, values = kept.copy(), np.where(kept, u, 0.0)
        more[:, one.columns], values[:, one.columns] = True, one.values
        trying = ~np.all(kept[:, one.columns], axis=1)
        if not np.any(trying) or not np.any(
            self._free(one, u, kept) | (np.abs(u[:, one.columns] - one.values) < CLOSED)
        ):
            return u, kept
        closure = self.closure.at(np.where(more, values, u), own=False)
        found, gap = self.close(closure, np.where(more, values, u), more)
        better = trying & (gap <= CLOSED)
        return np.where(better[:, None], found, u), np.where(better[:, None], more, kept)

    def _free(self, one: Statement, u: Array, kept: Flags) -> Flags:
        """Return whether the joints and what is kept leave the columns of a statement free, (lanes, columns)."""
        slope = self.closure.at(u, own=False).rows(u).slope * np.sqrt(np.where(kept, 0.0, self.give))[:, None, :]
        basis = np.linalg.svd(slope, full_matrices=False)
        rank = DEPENDENT * np.max(basis.S, axis=1, initial=1e-300, keepdims=True) < basis.S
        told = np.einsum("lri,lr->li", basis.Vh**2, rank.astype(float))
        return np.asarray(1.0 - told[:, one.columns] > DEPENDENT)
