"""Consistent initial conditions in space: the Gauss-Newton method for poses, least kinetic energy for rates.

Stated values are kept exactly if possible; all others follow from them, with the least change. Unlike in the plane the
search is made in the coordinates of the machine.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import reach
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.locking import require_unlocked
from shoal.mechanics.assembly.space.placement import place_in_space
from shoal.mechanics.assembly.space.values import at, of_lane
from shoal.mechanics.frames import BeamFrame, Frame, PointFrame, RigidFrame
from shoal.mechanics.numerics.tile import Array, stacked
from shoal.mechanics.start.start import place_at, rate_at
from shoal.mechanics.start.strained import gives_way, require_numbers
from shoal.mechanics.term_values import TermValues
from shoal.scene import InitialState, Scene
from shoal.scene.initial import Quantity
from shoal.scene.paths import lanes_of

CLOSED = 1e-11
"""A joint that gapes by less, relative to the size of the machine, is closed."""
ROUNDING = 1e-4
"""Stated values may miss by so much, relative to the size of the machine or in rad, and are then corrected."""
STRAIN = 1e-6
"""Nodes of a flexible rod that closing the joints would move by more, relative to the size of the machine, are not."""
ITERATIONS = 60
STALLED, FALLS = 10, 0.9
"""Iterations without a fall of the worst gap to this part of it: from there on no poses are near that close."""
ATTEMPTS = 16
DEPENDENT = 1e-9
"""Singular values below this, relative to the largest, are of rows that depend on others."""
FREE = 1e-6
"""Part of a guess that the joints and kept statements leave free, below which they determine it."""
GUESSED = 10
"""Iterations in which a guess is met, if it can be."""


def place_started(scene: Scene) -> SpatialPlacement:
    """The placement of a scene with a start that agrees with its joints. Raises InputError where there is none."""
    placement = place_in_space(scene)
    closing = _Closing(scene, placement)
    closing.run()
    return placement


class _Stated(NamedTuple):
    """A component of a stated vector, a sum of factors times coordinates, and its value."""

    parts: list[tuple[int, float]]
    value: float
    quantity: Quantity
    body: str
    firm: bool

    def off(self, q: Array) -> float:
        """Return the residual at the coordinates, or rates, q."""
        return float(sum(factor * q[unknown] for unknown, factor in self.parts)) - self.value


def _dense(stated: list[_Stated], unknowns: int) -> Array:
    """Their rows, (stated, unknowns)."""
    rows = np.zeros((len(stated), unknowns))
    for row, one in zip(rows, stated, strict=True):
        for unknown, factor in one.parts:
            row[unknown] += factor
    return rows


def _guesses(stated: list[_Stated]) -> Iterator[list[_Stated]]:
    """The components of every guess, one after the other."""
    for _, parts in groupby(stated, key=lambda one: (one.body, one.quantity)):
        if not (guess := list(parts))[0].firm:
            yield guess


def _leaves_free(held: Array, asked: Array) -> bool:
    """Return whether some row of those asked for changes while those that are held do not."""
    _, sizes, rows = np.linalg.svd(held, full_matrices=False)
    told = rows[: int(np.sum(sizes > DEPENDENT * sizes[:1]))]
    left = asked - (asked @ told.T) @ told
    return bool(np.any(np.linalg.norm(left, axis=1) > FREE * np.linalg.norm(asked, axis=1)))


class _Rates(NamedTuple):
    """Linear equations of the rates of one lane.

    slope: Jacobian of the constraints, and driven: their derivatives by time, both by their scales; stated: rates;
    pace: the largest rate
    """

    slope: Array
    driven: Array
    stated: list[_Stated]
    pace: float


class _Closing:
    """Coordinates and rates that meet the constraints of a placement, from those it has."""

    def __init__(self, scene: Scene, placement: SpatialPlacement) -> None:
        self.scene, self.placement = scene, placement
        self.terms = [one for one in placement.terms.held if not one.of_start]
        self.moving_terms = [*self.terms, *(one for one in placement.terms.held if one.of_start)]
        self.values = TermValues(self.terms, 3)
        self.moving = TermValues(self.moving_terms, 3)
        self.q, self.v = stacked(placement.positions), stacked(placement.velocities)
        self.size = float(reach.span(scene))
        self.gives_way = gives_way(scene)
        self.scale = np.array([self.size**term.lengths for term in self.terms])
        lanes = max(self.q.shape[1], self.v.shape[1], self.residual(self.q).shape[1])
        self.lanes = 0
        self._spread(lanes)

    def _spread(self, lanes: int) -> None:
        self.q, self.v = (np.repeat(x, lanes // x.shape[1], 1) for x in (self.q, self.v))
        self.lanes = lanes

    def run(self) -> None:
        """Close, and put the result into the placement. Raises InputError if a scene without lanes has no start."""
        failed = np.zeros(self.lanes, dtype=bool)
        off = np.max(np.abs(self.residual(self.q)) / self.scale[:, None], axis=0, initial=0.0)
        for lane in range(self.lanes):
            if off[min(lane, len(off) - 1)] > CLOSED or not self._keeps(lane):
                failed[lane] |= not self._close(lane)
        if self.lanes == 1 and len(self.scene.joints) > len(self.scene.bodies):  # there are loops
            require_unlocked(self.scene, self.terms, self.q[:, 0])
        heavy = lanes_of(self.scene.bodies)
        # The least kinetic energy depends on masses.
        if heavy > self.lanes and not failed[0] and not self._moves(0, self._rates(0)):
            self._spread(heavy)
            failed = np.repeat(failed, heavy)
        for moving in np.flatnonzero(~failed):
            failed[moving] |= not self._move(int(moving))
        self.placement.positions, self.placement.velocities = list(self.q), list(self.v)
        self.placement.terms.begin(lambda vector: place_at(vector, self.q))
        self.placement.failed = failed

    def residual(self, q: Array) -> Array:
        """The constraints at time zero, (constraints, lanes)."""
        return self.values.at(q.T)[0].T

    def _keeps(self, lane: int) -> bool:
        """Return whether the poses are those that are stated."""
        away = (abs(one.off(self.q[:, lane])) for one in self._rows(_POSES, lane))
        return all(off <= CLOSED * max(self.size, 1.0) for off in away)

    def _close(self, lane: int) -> bool:
        stated = [one for one in self._rows(_POSES, lane) if one.firm]
        begin = self.q[:, lane].copy()
        rng = np.random.default_rng(0)
        for attempt in range(ATTEMPTS):
            shaken = 0.05 * 1.3**attempt * rng.normal(size=len(begin)) if attempt else 0.0
            found = self._newton(begin + shaken, lane, stated)
            if found is not None and not self._flipped(found, lane):
                self.q[:, lane] = self._with_guesses(found, lane, stated)
                self._check_strain(begin, self.q[:, lane], lane)
                return True
        found = self._newton(begin, lane, [])
        if self.lanes > 1:
            return found is not None and not self._flipped(found, lane) and self._corrected(found, stated, lane)
        if self.gives_way:
            require_numbers(self.scene)
            self.q[:, lane] = begin if found is None else found
            return True
        if found is None:
            off = np.abs(self.residual(begin[:, None])[:, 0]) / self.scale
            worst = self.terms[int(np.argmax(off))].name
            raise InputError(f"joints.{worst}: cannot be assembled; no poses near the stated ones close it")
        return self._corrected(found, stated, lane)

    def _with_guesses(self, q: Array, lane: int, kept: list[_Stated]) -> Array:
        """Poses that keep the guesses too, one after the other, where the joints and those before let them."""
        for guess in _guesses(self._rows(_POSES, lane)):
            if max(abs(one.off(q)) for one in guess) > CLOSED * max(self.size, 1.0):
                slope = self.values.of_lane(lane).jacobian(q[None])[0]
                held = np.vstack([slope / self.scale[:, None], _dense(kept, len(q))])
                if not _leaves_free(held, _dense(guess, len(q))):
                    continue
                found = self._newton(q, lane, [*kept, *guess], GUESSED)
                if found is None or self._flipped(found, lane):
                    continue
                q = found
            kept = [*kept, *guess]
        return q

    def _corrected(self, q: Array, stated: list[_Stated], lane: int) -> bool:
        """Take poses that close the joints if the stated ones miss them by rounding only, and return whether they do.

        Raises InputError of a single scene if they do not.
        """
        off = [abs(one.off(q)) / self._unit(one.quantity) for one in stated]
        if max(off, default=0.0) > ROUNDING:
            if self.lanes > 1:
                return False
            worst = stated[int(np.argmax(off))]
            unit = "m" if worst.quantity == "position" else "rad"
            raise InputError(
                f"initial.{worst.body}.{worst.quantity}: contradicts the joints and what else is stated of the start, "
                f"by {max(off) * self._unit(worst.quantity):.3g} {unit}; leave it out and it follows from the rest"
            )
        self._check_strain(self.q[:, lane], q, lane)
        self.q[:, lane] = q
        return True

    def _check_strain(self, before: Array, after: Array, lane: int) -> None:
        """Raises InputError where closing the joints would bend or stretch a rod that starts unstrained.

        One that may start strained must not define numbers of joints and loads then.
        """
        for name, frame in self.placement.frames.items():
            if isinstance(frame, BeamFrame):
                moved = (np.max(np.abs(at(one, before, lane) - at(one, after, lane))) for one in frame.vectors)
                if max(moved) > STRAIN * max(self.size, 1.0):
                    if self.gives_way:
                        require_numbers(self.scene)
                        return
                    raise InputError(
                        f"initial.{name}: the joints hold {name} where the unstrained rod would not start; state a "
                        "start that agrees with them"
                    )

    def _unit(self, quantity: Quantity) -> float:
        return self.size if quantity == "position" else 1.0

    def _newton(self, q: Array, lane: int, stated: list[_Stated], most: int = ITERATIONS) -> Array | None:
        held = _dense(stated, len(q))
        wanted = np.array([one.value for one in stated])
        small, values = CLOSED * self.scale, self.values.of_lane(lane)
        least, since = np.inf, 0
        for _ in range(most):
            (gap,), slopes = values.at(q[None])
            away = held @ q - wanted
            if np.all(np.abs(gap) <= small) and np.all(np.abs(away) <= CLOSED * max(self.size, 1.0)):
                return q
            off = float(np.max(np.abs(np.concatenate([gap / self.scale, away])), initial=0.0))
            least, since = (off, 0) if off < FALLS * least else (least, since + 1)
            if since >= STALLED:
                return None
            rows = np.vstack([values.dense(slopes, len(q))[0] / self.scale[:, None], held])
            move = np.linalg.lstsq(rows, -np.concatenate([gap / self.scale, away]), DEPENDENT)[0]
            longest = float(np.max(np.abs(move), initial=0.0))
            q = q + move * min(1.0, 0.5 * max(self.size, 1.0) / (longest + 1e-300))
            if not np.all(np.isfinite(q)):
                return None
        return None

    def _flipped(self, q: Array, lane: int) -> bool:
        """Return whether a body has become its own mirror image."""
        for frame in self.placement.frames.values():
            if isinstance(frame, RigidFrame):
                directors = np.array([at(one, q, lane) for one in frame.directors])
                if np.linalg.det(directors) < 0:
                    return True
        return False

    def _rows(self, quantities: tuple[Quantity, ...], lane: int) -> list[_Stated]:
        """Return the statements of these quantities."""
        found = []
        for body, start in self.scene.initial.items():
            frame = self.placement.frames[body]
            for quantity in quantities:
                if (value := getattr(start, quantity)) is None:
                    continue
                for vector, target in self._targets(body, frame, quantity, value, lane):
                    for k in range(3):
                        parts = [(unknown, float(of_lane(one, lane)[k])) for unknown, one in vector.terms.items()]
                        wanted = target[k] - of_lane(vector.constant, lane)[k] * (quantity in _POSES)
                        found.append(_Stated(parts, float(wanted), quantity, body, quantity not in start.guess))
        return found

    def _targets(
        self, body: str, frame: Frame, quantity: Quantity, value: Any, lane: int
    ) -> list[tuple[Affine, Array]]:
        origin = frame.point((0.0, 0.0, 0.0))
        if quantity in ("position", "velocity"):
            stated = [float(np.atleast_1d(part)[min(lane, np.size(part) - 1)]) for part in value]
            return [(origin, np.array([*stated, 0.0][:3]))]
        if isinstance(frame, PointFrame) or not isinstance(frame, RigidFrame):
            return []
        if quantity in ("angle", "rotation"):
            rotation = self.placement.attitudes.stated(body)
            assert rotation is not None
            return [(one, of_lane(rotation[:, k], lane)) for k, one in enumerate(frame.directors)]
        turning = self.placement.attitudes.stated_spin(body)
        assert turning is not None
        spin = of_lane(turning, lane)
        return [(one, np.cross(spin, at(one, self.q, lane))) for one in frame.directors]

    def _rates(self, lane: int) -> _Rates:
        scale = np.array([self.size**term.lengths for term in self.moving_terms])
        slope = self.moving.of_lane(lane).jacobian(self.q[:, lane][None])[0] / scale[:, None]
        stated = [one for one in self._rows(_RATES, lane) if one.firm]
        return _Rates(
            slope, self.moving.drift / scale, stated, max(1.0, float(np.max(np.abs(self.v[:, lane]), initial=0.0)))
        )

    def _moves(self, lane: int, wanted: _Rates) -> bool:
        """Return whether the rates satisfy the constraints and all statements, guesses included."""
        (slope, driven, _, pace), v = wanted, self.v[:, lane]
        kept = all(abs(one.off(v)) <= CLOSED * pace for one in self._rows(_RATES, lane))
        kept = kept and all(np.all(np.abs(rows @ v) <= CLOSED * pace) for rows in self._straining(lane))
        return bool(kept and np.all(np.abs(slope @ v + driven) <= CLOSED * pace))

    def _straining(self, lane: int) -> Iterator[Array]:
        """Yield for every flexible rod rows of the rates that vanish in rigid motions of its vectors.

        A rod starts as a rigid body moves, unless the joints forbid it.
        """
        q = self.q[:, lane]
        for frame in self.placement.frames.values():
            if isinstance(frame, BeamFrame):
                rates = np.zeros((len(frame.vectors), 3, len(q)))
                for one, row in zip(frame.vectors, rates, strict=True):
                    for unknown, coefficient in one.terms.items():
                        row[:, unknown] = of_lane(coefficient, lane)
                turning = [-turns.skew(at(one, q, lane)) for one in frame.vectors]
                moving = [np.eye(3) * (k % len(frame.nodes[0]) == 0) for k in range(len(turning))]
                motions = np.linalg.svd(np.hstack([np.vstack(turning), np.vstack(moving)]), full_matrices=False)
                rigid = motions.U[:, DEPENDENT * motions.S[0] < motions.S]
                flat = rates.reshape(-1, len(q))
                yield flat - rigid @ (rigid.T @ flat)

    def _move(self, lane: int) -> bool:
        """Find rates that satisfy the constraints and the statements; return false if there are none."""
        asked = self._rates(lane)
        if self._moves(lane, asked):
            return True
        (slope, driven, stated, pace), q, v = asked, self.q[:, lane], self.v[:, lane].copy()
        held = _dense(stated, len(q))
        wanted = np.array([one.value for one in stated])
        rows, right = np.vstack([slope, held]), np.concatenate([-driven, wanted])
        root = np.linalg.cholesky(self._mass(lane))
        move = np.linalg.lstsq(np.linalg.solve(root, rows.T).T, right - rows @ v, DEPENDENT)[0]
        v = v + np.linalg.solve(root.T, move)
        wishes = [(unstrained, np.zeros(len(unstrained))) for unstrained in self._straining(lane)]
        guesses = _guesses(self._rows(_RATES, lane))
        wishes += [(_dense(guess, len(q)), np.array([one.value for one in guess])) for guess in guesses]
        for wish, value in wishes:
            more, right_of_more = np.vstack([rows, wish]), np.concatenate([right, value])
            move = np.linalg.lstsq(np.linalg.solve(root, more.T).T, right_of_more - more @ v, DEPENDENT)[0]
            moved = v + np.linalg.solve(root.T, move)
            if np.all(np.abs(more @ moved - right_of_more) <= 1e-9 * pace):
                v, rows, right = moved, more, right_of_more
        left = rows @ v - right
        worst = int(np.argmax(np.abs(left))) if left.size else 0
        if left.size and abs(left[worst]) > ROUNDING * pace:
            if self.lanes == 1 and worst < len(slope) and not stated:
                raise InputError(f"joints.{self.moving_terms[worst].name}: cannot begin to move as it is driven")
            return self._kept(stated, v, 0.0)
        if left.size and abs(left[worst]) > 1e-9 * pace:  # digits of stated rates: the joints come first
            slope_root = np.linalg.solve(root, slope.T).T
            v = v - np.linalg.solve(root.T, np.linalg.lstsq(slope_root, slope @ v + driven, DEPENDENT)[0])
            if not self._kept(stated, v, pace):
                return False
        self.v[:, lane] = v
        return True

    def _kept(self, stated: list[_Stated], v: Array, pace: float) -> bool:
        """Return whether rates are the stated ones but for rounding. Raises InputError of a single scene if they are
        not.
        """
        off = [abs(one.off(v)) for one in stated]
        if max(off, default=0.0) <= ROUNDING * pace:
            return True
        if self.lanes > 1:
            return False
        guilty = stated[int(np.argmax(off))]
        raise InputError(
            f"initial.{guilty.body}.{guilty.quantity}: contradicts the joints and the other rates, by "
            f"{max(off):.3g}; leave it out and it follows from the rest"
        )

    def _mass(self, lane: int) -> Array:
        from shoal.mechanics.assembly.masses import Masses
        from shoal.mechanics.rows import Rows

        count = len(self.q)
        matrix = np.zeros((count, count))
        for (i, j), value in Masses(self.scene, self.placement, Rows(count)).mass.items():
            matrix[i, j] = matrix[j, i] = of_lane(np.atleast_1d(value)[None], lane)[0]
        return matrix


_POSES: tuple[Quantity, ...] = ("position", "rotation", "angle")
_RATES: tuple[Quantity, ...] = ("velocity", "spin", "rate")


def begun(frames: dict[str, Frame], q: Array, v: Array) -> dict[str, InitialState]:
    """State of every body at the coordinates q and rates v of a machine, each (unknowns,); rods have no attitude.

    Of (unknowns, lanes) its numbers are arrays.
    """
    found = {}
    for name, frame in frames.items():
        place = frame.point((0.0, 0.0, 0.0))
        turn: list[Any] | None = None
        spin: list[Any] | None = None
        if isinstance(frame, RigidFrame):
            directors = np.array([place_at(one, q) for one in frame.directors])
            turning = np.array([rate_at(one, v) for one in frame.directors])
            turn = _told(_vectors(directors.swapaxes(0, 1)))
            spin = _told(0.5 * np.sum(np.cross(directors, turning, axis=1), axis=0))
        found[name] = InitialState.model_construct(
            angle=None,
            rate=None,
            position=tuple(_told(place_at(place, q))),
            velocity=tuple(_told(rate_at(place, v))),
            rotation=None if turn is None else (turn[0], turn[1], turn[2]),
            spin=None if spin is None else (spin[0], spin[1], spin[2]),
            guess=(),
        )
    return found


def _vectors(rotation: Array) -> Array:
    """The rotation vector [rad] of a matrix (3, 3), or of all lanes (3, 3, lanes)."""
    if rotation.ndim == 2:
        return turns.vector_of(rotation)
    return np.stack([turns.vector_of(rotation[..., lane]) for lane in range(rotation.shape[2])], axis=1)


def _told(vector: Array) -> list[Any]:
    """Components: numbers of Python, or arrays over lanes."""
    return vector.tolist() if vector.ndim == 1 else list(vector)
