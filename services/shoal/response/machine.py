"""A scene as a function of some of its fields: where its markers are at all instants. Failed runs are repeated."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeVar

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.one_by_one import one_by_one
from shoal.engines.starts import Tally
from shoal.errors import InputError, UnstableStepError
from shoal.mechanics.event_record import word
from shoal.response.inputs import BoolArray, IntArray
from shoal.response.runs import Answers, Keep
from shoal.scene import Scene
from shoal.trajectory import Array, Status, Trajectory

Run = TypeVar("Run")
CHUNK = 2_000_000
"""Numbers of an answer that are computed in one call: 16 MB."""
FINER = 4.0, 16.0
"""A run that failed is repeated with a step, and adaptive errors, smaller by this, then by that."""
LEAST_TOLERANCE = 1e-14
"""Least relative tolerance of an integrator: some rounding units."""
ALONE = 32
"""So many runs of a call at most, that fail with smaller steps too, are made one by one."""


def quantities(dimensions: int) -> tuple[str, ...]:
    """Return the quantities of every marker in a study."""
    return ("x", "y", "angle") if dimensions == 2 else ("x", "y", "z")


@dataclass(frozen=True)
class ResponseModel:
    """Call it with path -> values. Columns: instants, markers and quantities, in this order.

    Quantities are x, y [m] and angle [rad]; in space x, y and z, where an angle in the plane z = 0 may jump.

    columns: their number along each of the three; reduce: gives the answers, (lanes, columns), of the motion of a
    scene with some values of its lanes; keep: of the runs; fixed: values of parameters that are set in the scene, in
    words, by which these are distinguished; starts: counts the runs that start elsewhere than stated; texts: of words
    of events by their number
    """

    scene: Scene
    times: Array
    engine: Engine
    reduce: Callable[[Trajectory, Scene, Mapping[str, Array]], Array] = field(default_factory=lambda: _columns)
    keep: Keep | None = None
    fixed: str = ""
    starts: Tally | None = None
    texts: dict[float, str] = field(default_factory=dict)

    def at(self, values: Mapping[str, float]) -> ResponseModel:
        """The same machine with these values. Raises InputError."""
        return replace(self, scene=self.scene.with_values(values), fixed=f"{self.fixed}{dict(values)}")

    @property
    def touches(self) -> bool:
        """Return whether runs have words of events."""
        return self.scene.touches

    def _words(self, motion: Trajectory, lanes: int) -> Array:
        """Return the words of events until each instant as numbers, (lanes, instants), and keep their texts."""
        found = np.zeros((lanes, len(self.times)))
        for lane, letters in enumerate(motion.words):
            # A word changes at events only.
            edges = np.unique([time for time, _ in letters])
            last = np.searchsorted(edges, self.times, side="right")
            for k in np.unique(last[last > 0]):
                text = word(letters, float(edges[k - 1]))
                number = float(int.from_bytes(hashlib.blake2b(text.encode(), digest_size=6).digest()))
                self.texts[number], found[lane, last == k] = text, number
        return found

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantities of every marker."""
        return quantities(self.scene.dimensions)

    @property
    def columns(self) -> tuple[int, int, int]:
        """Instants, markers, quantities."""
        return len(self.times), len(self.scene.markers), len(self.quantities)

    def __call__(self, values: Mapping[str, Array]) -> Answers:
        """The answers of all runs. Raises InputError."""
        count = len(next(iter(values.values())))
        chunk = max(64, CHUNK // int(np.prod(self.columns)))
        parts = [
            self._known({path: lanes[k : k + chunk] for path, lanes in values.items()}) for k in range(0, count, chunk)
        ]
        return Answers(
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.good for part in parts]),
            sum(part.repeated for part in parts),
            next((part.why for part in parts if part.why), ""),
            words=np.concatenate([part.words for part in parts if part.words is not None]) if self.touches else None,
        )

    def _known(self, values: Mapping[str, Array]) -> Answers:
        if self.keep is None:
            found = self._some(values)
        else:
            label, stated = repr(getattr(self.reduce, "__self__", "markers")) + self.fixed, 0
            if self.starts is not None and (stated := len(self.starts.stated.values)):
                label += repr(self.starts.stated.values)
            found = self.keep(label, values, self._some, stated + len(self.times) * self.touches)
        if found.away is not None and self.touches:
            away, words = np.split(found.away, [-len(self.times)], axis=1)
            found = replace(found, away=away, words=words)
        if self.starts is not None and found.away is not None:
            self.starts.count(found.away[found.good])
        return found

    def _some(self, values: Mapping[str, Array]) -> Answers:
        lanes = np.arange(len(next(iter(values.values()))))
        done, why = self._run(self.scene, values, lanes)
        repeated = 0
        for finer in FINER:
            left = _left(lanes, done)
            if not left.size:
                break
            if not repeated and not done:
                # Where the machine is too fast as it is stated, so are its steps.
                self.engine.simulate(self.scene, self.times)
            repeated = max(repeated, left.size)
            try:
                again, why = self._run(self.scene.with_values(_smaller_steps(self.scene, finer)), values, left)
            except InputError as error:
                why = str(error)
                break
            done |= again
        left = _left(lanes, done)
        if 0 < left.size <= ALONE and done and self.scene.solver.integrator == "auto":
            done |= self._alone(values, left)
        if not done:
            raise InputError(why)
        missing = np.full_like(next(iter(done.values())).values, np.nan)
        found = np.array([done[lane].values if lane in done else missing for lane in lanes.tolist()])
        failed = _left(lanes, done)
        away = None
        if self.starts is not None or self.touches:
            none = np.zeros_like(next(iter(done.values())).away)
            away = np.array([done[lane].away if lane in done else none for lane in lanes.tolist()])
        return Answers(found, np.isin(lanes, failed, invert=True), repeated, why if failed.size else "", away)

    def _run(self, scene: Scene, values: Mapping[str, Array], lanes: IntArray) -> tuple[dict[int, _Lane], str]:
        """Some lanes, without those whose step is too long; why the first failed. Raises InputError."""
        those = {path: at[lanes] for path, at in values.items()}
        try:
            motion = self.engine.simulate_many(scene, those, self.times)
        except UnstableStepError as error:
            if len(lanes) == 1:
                return {}, str(error)
            halves = [self._run(scene, values, half) for half in np.array_split(lanes, 2)]
            return halves[0][0] | halves[1][0], halves[0][1] or halves[1][1]
        except InputError as error:
            raise InputError(f"{error}{self._impossible(scene, values, lanes)}") from None
        return self._lanes(motion, scene, those, lanes), motion.message

    def _impossible(self, scene: Scene, values: Mapping[str, Array], lanes: IntArray) -> str:
        """Name the values that are refused; empty where all of these lanes are, or none alone. By bisection."""

        def refused(some: IntArray) -> bool:
            try:
                self.engine.simulate_many(scene, {path: at[some] for path, at in values.items()}, self.times)
            except UnstableStepError:
                return False
            except InputError:
                return True
            return False

        left, accepted = lanes, False
        while len(left) > 1:
            first, second = np.array_split(left, 2)
            if refused(first):
                left = first
            else:
                left, accepted = second, True
        if not refused(left) or (not accepted and refused(lanes[-1:])):
            return ""
        return f" (with {', '.join(f'{path} = {at[left[0]]:.6g}' for path, at in values.items())}; others are accepted)"

    def _alone(self, values: Mapping[str, Array], lanes: IntArray) -> dict[int, _Lane]:
        """Some lanes one after the other: then `auto` takes another integrator where its first choice fails."""
        those = {path: at[lanes] for path, at in values.items()}
        return self._lanes(one_by_one(self.engine, self.scene, those, self.times), self.scene, those, lanes)

    def _lanes(
        self, motion: Trajectory, scene: Scene, values: Mapping[str, Array], lanes: IntArray
    ) -> dict[int, _Lane]:
        reduce, good = self.reduce(motion, scene, values), _good(motion)
        away = np.zeros((len(lanes), 0)) if self.starts is None else self.starts.of(motion)
        if self.touches:
            away = np.column_stack([away, self._words(motion, len(lanes))])
        each = zip(lanes.tolist(), reduce, good.tolist(), away, strict=True)
        return {lane: _Lane(row, well, off) for lane, row, well, off in each}


class _Lane(NamedTuple):
    """One run of a batch.

    values: (columns,); good: whether they may be believed; away: from what is stated of the start, see `Answers`, and
    then the words of events of a machine that touches.
    """

    values: Array
    good: bool
    away: Array


def _left(lanes: IntArray, done: Mapping[int, _Lane]) -> IntArray:
    """Lanes that have no run yet that may be believed."""
    return lanes[[lane not in done or not done[lane].good for lane in lanes.tolist()]]


def _smaller_steps(scene: Scene, finer: float) -> dict[str, float]:
    """Settings of the solver for runs that failed."""
    solver = scene.solver
    return {
        "solver.step": solver.step / finer,
        "solver.relative_tolerance": max(solver.relative_tolerance / finer, LEAST_TOLERANCE),
        "solver.absolute_tolerance": solver.absolute_tolerance / finer,
    }


def stable(scene: Scene, run: Callable[[Scene], Run]) -> tuple[Run, dict[str, float]]:
    """A run of a scene, and a setting of the solver where its own steps are too long. Raises InputError."""
    settings: dict[str, float] = {}
    for finer in FINER:
        try:
            return run(scene.with_values(settings) if settings else scene), settings
        except UnstableStepError:
            settings = {"solver.step": scene.solver.step / finer}
    return run(scene.with_values(settings)), settings


def _columns(motion: Trajectory, _scene: Scene, _values: Mapping[str, Array]) -> Array:
    """Return positions and angles of all markers, (lanes, instants * markers * 3)."""
    plane = motion.points.shape[2] == 2
    whole = np.concatenate([motion.points, motion.angles[:, :, None]], axis=2) if plane else motion.points
    return np.moveaxis(whole, -1, 0).reshape(motion.lanes, -1).copy()


def _good(motion: Trajectory) -> BoolArray:
    good = np.array([status is Status.OK for status in motion.status])
    finite = np.isfinite(motion.points).all(axis=(0, 1, 2)) & np.isfinite(motion.angles).all(axis=(0, 1))
    return np.asarray(good & finite)
