"""Velocity analysis: rates that satisfy the joints and the stated rates, by Gram-Schmidt orthogonalisation.

Rows are orthonormalised in the metric of the kinetic energy: joints first, then statements in their order. A row that
depends on those before it is determined by them. Directions that no row determines stay nearest to a first guess. In a
singular position the second derivative of the joints must vanish along the motion as well, which picks its branch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.mechanics.numerics.newton import newton
from shoal.mechanics.numerics.tile import Array, Flags
from shoal.mechanics.plane import as_complex, phasor
from shoal.mechanics.start.closure import Closure
from shoal.mechanics.start.poses import ROUNDING, Assembly, Statement, stated
from shoal.scene import PointMass, Scene
from shoal.scene.joints import Tie

SINGULAR = 1e-6
"""Part of a row, of its own length, below which it depends on others."""
AGREES = 1e-8
"""Of the fastest speed: rows that depend on others and differ by less agree with them."""
SLOW = 1e-6
"""Of the machine's size, over the duration: rates below this are round-off of what drives them."""
BRANCHES = 12
_LARGEST = 200
"""Rows up to which a motion is tested for the branches of a singular position."""


class Moving(NamedTuple):
    """Rates (lanes, 3 bodies) [m/s, rad/s]; whether they are allowed (lanes,); statements not met in lane 0."""

    rates: Array
    ok: Flags
    broken: list[Statement]


class Velocities:
    """The search for the rates at given poses in the plane, (lanes, 3 bodies)."""

    def __init__(self, assembly: Assembly, poses: Array) -> None:
        self.scene, self.lanes, self.poses = assembly.scene, assembly.lanes, poses
        self.closure = assembly.closure.at(poses)
        self.rows = self.closure.rows(poses)
        # What closes a rod upon itself asks nothing of its rates; its rows are round-off.
        joints = assembly.scene.joints.items()
        self.rings = {name for name, j in joints if isinstance(j, Tie) and j.first.body == j.second.body}
        self.statements = stated(assembly.scene, assembly.lanes, ("rate", "velocity"))
        self.size, self.walk = assembly.size, assembly.walk
        self.guess = assembly.walk.poses(poses[:, 2::3], assembly.rates)[1]
        self.flexible = any(body.element != "rigid" for body in self.scene.bodies.values())
        largest = [np.max(np.abs(one.values), initial=0.0) * self._unit(one) for one in self.statements]
        fastest = max([*largest, float(np.max(np.abs(self.rows.rate), initial=0.0)), float(np.max(np.abs(self.guess)))])
        self.speed = max(fastest, SLOW * self.size / float(np.max(self.scene.solver.duration)))

    def _unit(self, one: Statement) -> float:
        return self.size if one.quantity == "rate" else 1.0

    def run(self, without: Statement | None = None, joint: str = "") -> Moving:
        """The rates; without: a statement, or a joint, that is left out."""
        if without is None and not joint and self._easy():
            return Moving(self.guess, np.ones(self.lanes, dtype=bool), [])
        given = [one for one in self.statements if one is not without]
        keep = [k for k, name in enumerate(self.rows.names) if name != joint and name not in self.rings]
        lower = np.asarray(np.linalg.cholesky(_metric(self.scene, self.poses, self.size)), dtype=float)
        basis = _Basis(lower, self.guess)
        ok, broken = np.ones(self.lanes, dtype=bool), []
        for k in keep:
            length = 1.0 if self.rows.angular[k] else self.size
            left, dependent = basis.add(self.rows.slope[:, k], -self.rows.rate[:, k])
            if not self.flexible:  # an elastic rod gives way
                ok &= ~dependent | (left <= 1e2 * AGREES * self.speed * length / self.size)
        closed = basis.size
        kept: list[tuple[Statement, Flags]] = []
        for one in given:
            good = np.ones(self.lanes, dtype=bool)
            for column, value in zip(one.columns, one.values.T, strict=True):
                row = np.zeros_like(self.guess)
                row[:, column] = 1.0
                left, dependent = basis.add(row, value)
                good &= ~dependent | (left <= AGREES * self.speed / self._unit(one))
                missed = dependent & (left > ROUNDING * self.speed / self._unit(one))
                if one.firm:
                    ok &= ~missed
                    broken += [one] * bool(missed[0] and one not in broken)
            kept.append((one, good))
        rates = basis.rates()
        rates, branch = self._on_branch(rates, basis, closed, keep)
        for one, good in kept:
            rates[:, one.columns] = np.where(good[:, None], one.values, rates[:, one.columns])
        return Moving(rates, ok & branch, broken)

    def _easy(self) -> bool:
        """Return whether the first guess is right: at rest, or too large a machine to look for branches."""
        missed = self.rows.along(self.guess) + self.rows.rate
        wrong = [self.guess[:, one.columns] - one.values for one in self.statements]
        if max(float(np.max(np.abs(part), initial=0.0)) for part in (missed, *wrong)) > 1e-13 * self.speed:
            return False
        return not np.any(self.guess) or len(self.rows.names) > _LARGEST

    def _on_branch(self, rates: Array, basis: _Basis, closed: int, keep: list[int]) -> tuple[Array, Flags]:
        """Rates that a singular position allows: those for which the joints stay closed in second order."""
        ok = np.ones(self.lanes, dtype=bool)
        units = np.tile([self.size, self.size, 1.0], rates.shape[1] // 3)
        singular = closed < len(keep) or bool(np.any(basis.dependent))
        if not singular or self.flexible or len(keep) > _LARGEST or self.closure.is_carried:
            return rates, ok
        for lane in np.flatnonzero(basis.dependent & (np.max(np.abs(rates), axis=1) > AGREES * self.speed / self.size)):
            slope = self.rows.slope[lane, keep] * units
            left = np.linalg.svd(slope / (np.linalg.norm(slope, axis=1, keepdims=True) + 1e-300))
            rank = int(np.sum(left.S > SINGULAR))
            null = left.U[:, rank:].T / (np.linalg.norm(slope, axis=1) + 1e-300)
            bend = _Bend(self.closure.of_lanes(np.array([lane])), self.poses[lane], null, keep, units)
            free = basis.rest(int(lane))
            found = bend.nearest(rates[lane], free, self.speed / self.size)
            ok[lane] = found is not None
            if found is not None:
                rates[lane] = found
        return rates, ok


class _Bend(NamedTuple):
    """Second derivative of dependent joints along a motion, w . d2C/dt2 = v' (w . C_qq) v + w . C_tt.

    units: of the poses, the machine's size [m] and 1 rad, (3 bodies,)
    """

    closure: Closure
    poses: Array
    null: Array
    keep: list[int]
    units: Array

    def value(self, v: Array) -> Array:
        """For rates v (3 bodies,)."""
        step = 1e-4 / max(float(np.max(np.abs(v / self.units))), 1e-300)
        shifts = step * np.array([-2.0, -1.0, 1.0, 2.0])
        u = self.poses + shifts[:, None] * v
        slopes = self.closure.rows(u).slope[:, self.keep] @ v
        bend = np.array([1.0, -8.0, 8.0, -1.0]) @ slopes / (12 * step)
        return np.asarray(self.null @ (bend + self.closure.bend[self.keep]))

    def nearest(self, v: Array, free: Array, scale: float) -> Array | None:
        """Rates on a branch: of those found from several starts the nearest to v in the given directions."""
        small = AGREES * 1e2 * scale**2
        if np.max(np.abs(self.value(v)), initial=0.0) <= small:
            return v
        if not free.shape[0]:
            return None
        free = free / np.max(np.abs(free / self.units))
        h = 1e-6 * scale

        def correct(z: Array) -> tuple[Array, float]:
            value = self.value(v + z @ free)
            slope = np.stack([(self.value(v + (z + h * e) @ free) - self.value(v + (z - h * e) @ free)) / (2 * h)
                              for e in np.eye(len(free))], 1)  # fmt: skip
            move = np.asarray(np.linalg.lstsq(slope, -value)[0], dtype=float)
            return move, float(np.max(np.abs(move))) / scale

        rng = np.random.default_rng(0)
        best, least = None, np.inf
        for attempt in range(BRANCHES):
            begin = np.zeros(len(free)) if not attempt else scale * rng.normal(size=len(free))
            z = newton(correct, begin, close=1e-13, most=30).point
            found = v + z @ free
            if np.max(np.abs(self.value(found)), initial=0.0) <= small and np.linalg.norm(z) < least * (1 - 1e-6):
                best, least = found, float(np.linalg.norm(z))
        return best


class _Basis:
    """Rows made orthonormal in the metric L L', and the rates y = L' v that meet their targets."""

    def __init__(self, lower: Array, guess: Array) -> None:
        self.inverse = np.linalg.inv(lower)
        self.y = np.einsum("lij,li->lj", lower, guess)
        self.rows = np.zeros((len(guess), 0, guess.shape[1]))
        self.dependent = np.zeros(len(guess), dtype=bool)

    @property
    def size(self) -> int:
        """Rows so far."""
        return self.rows.shape[1]

    def add(self, row: Array, target: Array) -> tuple[Array, Flags]:
        """Add a row; return its residual before, and whether it depends on earlier rows, (lanes,) each."""
        a = np.einsum("lij,lj->li", self.inverse, row)
        length = np.linalg.norm(a, axis=1) + 1e-300
        a = a / length[:, None]
        left = target - length * np.einsum("li,li->l", a, self.y)
        rest = a
        for _ in range(2):
            rest = rest - np.einsum("lri,lr->li", self.rows, np.einsum("lri,li->lr", self.rows, rest))
        size = np.linalg.norm(rest, axis=1)
        dependent = size <= SINGULAR
        unit_row = np.where(dependent[:, None], 0.0, rest / np.where(dependent, 1.0, size)[:, None])
        self.y = self.y + unit_row * np.where(dependent, 0.0, left / length / np.where(dependent, 1.0, size))[:, None]
        self.rows = np.concatenate([self.rows, unit_row[:, None]], axis=1)
        self.dependent |= dependent
        return np.abs(left), dependent

    def rates(self) -> Array:
        """v with L' v = y."""
        return np.asarray(np.einsum("lji,lj->li", self.inverse, self.y))

    def rest(self, lane: int) -> Array:
        """Return the null space of the rows, (directions, 3 bodies), orthonormal in the metric."""
        split = np.linalg.svd(self.rows[lane])
        rank = int(np.sum(split.S > 0.5))
        return np.asarray(split.Vh[rank:] @ self.inverse[lane])


def _metric(scene: Scene, poses: Array, size: float) -> Array:
    """The kinetic energy's matrix, (lanes, 3 bodies, 3 bodies); a body turns with at least a little inertia."""
    matrix = np.zeros((len(poses), poses.shape[1], poses.shape[1]))
    for number, body in enumerate(scene.bodies.values()):
        k = 3 * number
        point = isinstance(body, PointMass)
        c = 0.0 if isinstance(body, PointMass) else as_complex(body.centre_of_mass)
        arm = phasor(poses[:, k + 2]) * c
        inertia = 0.0 if isinstance(body, PointMass) else body.inertia
        matrix[:, k, k] = matrix[:, k + 1, k + 1] = body.mass
        turning = body.mass * size**2 if point else np.maximum(inertia, 1e-6 * body.mass * size**2)
        matrix[:, k + 2, k + 2] = turning + body.mass * np.abs(arm) ** 2
        matrix[:, k, k + 2] = matrix[:, k + 2, k] = -body.mass * np.imag(arm)
        matrix[:, k + 1, k + 2] = matrix[:, k + 2, k + 1] = body.mass * np.real(arm)
    return matrix
