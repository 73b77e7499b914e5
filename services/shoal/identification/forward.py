"""The forward model of a problem: parameters in, residuals out, every evaluation counted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.engines import get_engine
from shoal.engines.contract import Engine
from shoal.errors import InputError
from shoal.evaluation_cache import EvaluationCache
from shoal.identification.bounds import Accepted, accepts
from shoal.identification.deadline import Deadline, TimeIsUp
from shoal.identification.loss import flatten, steepness
from shoal.identification.parametrization import Parametrization
from shoal.identification.placement import AngleSensitivity, placement
from shoal.identification.problem import Problem
from shoal.identification.recording.clocks import by_clock
from shoal.identification.recording.impacts import LATER, TINY, impact_times
from shoal.identification.recording.measurement import Measurement, Recording
from shoal.identification.recording.observation import Camera, observe, without_turns
from shoal.identification.recording.rows import ResidualRows
from shoal.identification.recording.source import IMPACT
from shoal.identification.recording.virtual_sensors import engine_options, from_start, with_sensor_markers
from shoal.mechanics.numerics.tile import WIDE
from shoal.scene import Scene
from shoal.swarm import EvaluationCounter
from shoal.trajectory import Array, Status, Trajectory

AT_ONCE = 2 * len(WIDE)
"""Lanes of a call where the time is limited: whole tiles, enough for two threads."""

_KEPT = ("parameters", "rows", "loss_scale", "_native", "_placements", "_accepted", "_together")
"""What models of the same scene, engine and measurement share."""

Progress = Callable[[int, float, float], None]
"""Called with (iteration, best fitness, mean fitness of the iteration)."""


@dataclass
class ForwardModel:
    """Simulates parameter sets, one per lane, and compares them with the measurement.

    Points are vectors as `Parametrization` has them. `residuals` is wrapped by one counter, which every method shares.
    Fitness is the mean over the samples of the sum of squared residuals (for a tip: the mean squared distance [m^2]).
    Where channels have different noise or units they are weighted (`ResidualRows.weight`).

    deadline: after which simulations raise TimeIsUp; memory: of evaluations made earlier
    whole: of a model of a part of the recordings, the model of all, which counts its evaluations too
    """

    problem: Problem
    scene: Scene
    engine: Engine
    measurement: Measurement
    deadline: Deadline | None = None
    memory: EvaluationCache | None = None
    whole: ForwardModel | None = None
    counter: EvaluationCounter = field(init=False)
    placements: int = field(init=False, default=0)
    """Poses computed without simulating a motion."""
    work: float = field(init=False, default=0.0)
    """Simulated time over that of one run of all recordings: full-run equivalents."""
    refusal: str = field(init=False, default="")
    """Why a simulation was refused, if one was."""
    failure: str = field(init=False, default="")
    """Why a simulation failed, if one did."""
    longest_fit: tuple[float, float, Array] = field(init=False, default=(0.0, np.inf, np.empty(0)))
    """Longest part of the recordings that was fitted: its end [s], the best fitness on it, and the point."""

    _placements: dict[str, AngleSensitivity] = field(init=False, default_factory=dict)
    _together: dict[tuple[str, ...], bool] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.counter = EvaluationCounter(self._residuals, cost=self.cost)

    @cached_property
    def parameters(self) -> Parametrization:
        """The parameters as a vector."""
        return Parametrization.of(self.problem, self.scene, tuple(self.measurement.recordings))

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters, in the order of the vectors."""
        return self.parameters.names

    @property
    def lower(self) -> Array:
        """Lower bounds, (parameters,)."""
        return self.parameters.lower

    @property
    def upper(self) -> Array:
        """Upper bounds, (parameters,)."""
        return self.parameters.upper

    def box_at(self, point: Array) -> tuple[Array, Array]:
        """Bounds that no step from a point crosses, (parameters,) each; from outside none leads further out."""
        return np.minimum(self.lower, point), np.maximum(self.upper, point)

    def sizes(self, point: Array) -> Array:
        """Size of each parameter at a point, at least a thousandth of its range, 1 of a logarithm, (parameters,)."""
        sizes = np.maximum(np.abs(point), 1e-3 * (self.upper - self.lower))
        return np.where(self.parameters.logarithmic, 1.0, sizes)

    @cached_property
    def rows(self) -> ResidualRows:
        """Rows of the residuals, but for those of priors at their end."""
        return ResidualRows.of(self.measurement, (self.whole or self).measurement)

    def until(self, end: float) -> ForwardModel:
        """The model of the samples up to a time [s]; its evaluations count here too."""
        return replace(self, measurement=self.measurement.until(end), whole=self.whole or self)

    def aside(self, **changes: Any) -> ForwardModel:
        """The model with some of its fields changed, whose runs are not counted."""
        other = replace(self, memory=None, whole=None, **changes)
        if not changes:
            other.__dict__.update({name: self.__dict__[name] for name in _KEPT if name in self.__dict__})
        return other

    def residuals(self, points: Array) -> Array:
        """Model minus measurement, (points, rows), and a row for each prior; inf where a simulation failed.

        Counted. Raises TimeIsUp.
        """
        return np.asarray(self.counter(points))

    def uncounted(self, points: Array) -> Array:
        """Return `residuals` without counting the runs, for diagnostics of an answer. Raises TimeIsUp."""
        return np.concatenate([self._simulated_residuals(part) for part in self._portions(points)])

    def fitness(self, points: Array) -> Array:
        """Mean squared deviation of each point, (points,). Counted."""
        return self.cost(self.residuals(points))

    def cost(self, residuals: Array) -> Array:
        """Fitness of residuals (points, rows)."""
        return np.asarray(np.sum(residuals**2, axis=1) / self.rows.samples)

    def observe(
        self,
        points: Array,
        name: str | None = None,
        times: Array | None = None,
        scene: Scene | None = None,
        factors: Mapping[str, float] | None = None,
    ) -> Array:
        """Channels of a recording in the model, (points, samples, channels); nan where a simulation failed.

        name: of the recording, else the first; times: by its clock [s], else those of its samples; scene: instead of
        the model's; factors: by which fields of it are multiplied. Not counted. Until its time zero a machine is held
        at its start.
        """
        name = name or next(iter(self.measurement.recordings))
        recording = self.measurement.recordings[name]
        times = recording.times if times is None else times
        scene = scene or self.scene
        scene = scene.with_values(recording.stated.known) if recording.stated.known else scene
        values = self.parameters.scene_values(points, name)
        factors = factors or {}
        fixed = {path: factor * scene.value(path) for path, factor in factors.items() if path not in values}
        values |= {path: factor * values[path] for path, factor in factors.items() if path not in fixed}
        seen_by = self.parameters.measurement_values(points, name, recording.stated)
        seen = np.full((len(points), len(times), len(recording.channels)), np.nan)
        clock, delay = seen_by.pop("clock"), seen_by.pop("delay")
        possible = self._possible(points, values | {path: np.full(len(points), x) for path, x in fixed.items()}, scene)
        if recording.channels[0].quantity == IMPACT:
            lanes = np.flatnonzero(possible)
            inputs = {path: numbers[lanes] for path, numbers in values.items()}
            if lanes.size:
                held, inputs = _with_shared(scene, fixed, inputs, len(lanes))
                heard = self._heard(held, inputs, recording, times, clock[lanes], delay[lanes])
                seen[lanes] = heard[:, recording.numbers(times), None]
            return seen
        for lanes, instants, rows in by_clock(times, clock, delay, possible):
            inputs = {path: numbers[lanes] for path, numbers in values.items()}
            held, inputs = _with_shared(scene, fixed, inputs, len(lanes))
            view = Camera(**{key: numbers[lanes] for key, numbers in seen_by.items()})
            found = self._simulate(held, inputs, instants, view, name)
            seen[lanes] = np.take_along_axis(found, rows[:, :, None], axis=1)
        return seen

    def _heard(
        self, scene: Scene, values: dict[str, Array], recording: Recording, times: Array, clock: Array, delay: Array
    ) -> Array:
        """Times of all impacts by the recording's clock [s], (lanes, impacts); lanes that are refused stay nan."""
        lanes, place = len(clock), recording.channels[0].place
        count = int(recording.numbers(times[-1:])[0]) + 1
        end = LATER * float(np.max(times[-1] / clock + delay))
        try:
            trajectory = self._run(scene, values, np.array([0.0, max(end, TINY)]), lanes, {})
        except InputError as error:

            def again(values: dict[str, Array], clocks: list[Array]) -> Array:
                return self._heard(scene, values, recording, times, *clocks)

            return self._halved(error, values, [clock, delay], again, np.full((1, count), np.nan))
        if not trajectory.words:
            raise InputError(f"channels: {IMPACT} is known to the engine gauss alone; found {trajectory.engine}")
        found = np.stack([impact_times(letters, place, count, end) for letters in trajectory.words])
        found[[status is not Status.OK for status in trajectory.status]] = np.nan
        return (np.broadcast_to(found, (lanes, count)) - delay[:, None]) * clock[:, None]

    def _simulate(self, scene: Scene, values: dict[str, Array], times: Array, view: Camera, name: str) -> Array:
        """One call of the engine; lanes that it refuses are found by halving and stay nan."""
        lanes = len(next(iter(values.values()))) if values else len(np.atleast_1d(view.x))
        channels = self.measurement.recordings[name].channels
        instants = from_start(times, channels)
        try:
            options = engine_options(self.engine, scene, channels)
            trajectory = self._run(with_sensor_markers(scene, channels), values, instants, lanes, options)
            seen = observe(trajectory, channels, view, scene, values)
        except InputError as error:

            def again(values: dict[str, Array], view: list[Array]) -> Array:
                return self._simulate(scene, values, times, Camera(*view), name)

            of_view = [np.broadcast_to(number, lanes) for number in view]
            return self._halved(error, values, of_view, again, np.full((1, len(times), len(channels)), np.nan))
        seen = without_turns(seen, channels)[:, len(instants) - len(times) :]
        failed = np.array([status is not Status.OK for status in trajectory.status])
        seen[np.broadcast_to(failed, len(seen))] = np.nan
        if np.any(failed):
            asked = self.whole or self
            self.failure = asked.failure = asked.failure or trajectory.message
        return seen

    def _halved(
        self,
        error: InputError,
        values: dict[str, Array],
        others: list[Array],
        again: Callable[[dict[str, Array], list[Array]], Array],
        nothing: Array,
    ) -> Array:
        """Run both halves of the lanes of a refused call again; a single lane that is refused gives `nothing`.

        values, others: of the lanes, those of the scene by path
        """
        asked, lanes = self.whole or self, len(others[0])
        self.refusal = asked.refusal = asked.refusal or str(error)
        if lanes == 1:
            return nothing
        halves = (slice(0, lanes // 2), slice(lanes // 2, lanes))
        parts = [({path: x[half] for path, x in values.items()}, [x[half] for x in others]) for half in halves]
        return np.concatenate([again(*part) for part in parts])

    def _run(
        self, scene: Scene, values: dict[str, Array], times: Array, lanes: int, options: dict[str, bool]
    ) -> Trajectory:
        """One call of the engine, if there is time for it. Raises TimeIsUp, InputError."""

        def run(scene: Scene, times: Array) -> Trajectory:
            if values:
                return self.engine.simulate_many(scene, values, times, **options)
            return self.engine.simulate(scene, times, **options)

        if self.deadline is None:
            return run(scene, times)
        sized = [(name, getattr(body, "elements", 0)) for name, body in scene.bodies.items()]
        kind = (self.engine.name, str(sized), scene.solver.integrator, scene.solver.step, lanes == 1)
        return self.deadline.run(kind, scene, times, run)

    def off_the_clock(self) -> AbstractContextManager[None]:
        """For what does not count against the deadline."""
        return nullcontext() if self.deadline is None else self.deadline.paused()

    def warm_up(self) -> None:
        """Have the engine load or compile what it needs, so that no clock counts it."""
        start = self.parameters.start
        for points in (start[None], np.array([start, start])):
            replace(self, deadline=None).observe(points, times=np.array([min(1e-3, self.measurement.end)]))

    def at_start(self, name: str) -> Array:
        """Channels of a recording at the start of the parameters, (samples, channels)."""
        return np.asarray(self.observe(self.parameters.start[None], name)[0])

    def poses(self, points: Array, name: str | None = None) -> Array:
        """Channels at time zero, (points, channels), nan of those that sensors feel, which no pose shows.

        No motion is simulated, so nothing is counted as an evaluation.
        """
        (self.whole or self).placements += len(points)
        recordings = self.measurement.recordings
        name = name or next(iter(recordings))
        channels = recordings[name].channels
        if (known := self._placement(points, name)) is not None:
            return known(points)
        shown = [not channel.is_sensor for channel in channels]
        found = np.full((len(points), len(channels)), np.nan)
        if any(shown):
            found[:, shown] = self._native.observe(points, name, np.zeros(1))[:, 0]
        return found

    def _placement(self, points: Array, name: str) -> AngleSensitivity | None:
        """Channels of a recording as functions of the angles of these points, where nothing else differs."""
        known = self._placements.get(name)
        if known is not None and known.knows(points):
            return known
        recording = self.measurement.recordings[name]

        def place(poses: Array) -> Array:
            return self._native.observe(poses, name, np.zeros(1))[:, 0]

        found = placement(self.problem, self.parameters, self.scene, name, recording, points, place)
        if found is not None:
            self._placements[name] = found
        return found

    @cached_property
    def _native(self) -> ForwardModel:
        """Placing bodies is the same for every engine, and the native one places all points in one call."""
        return replace(self, engine=get_engine("gauss"), measurement=self.measurement.changed(_not_sensors))

    def scene_at(self, point: Array, name: str | None = None) -> Scene:
        """The scene of a point, in a recording (else the first). Raises InputError."""
        name = name or next(iter(self.measurement.recordings))
        values = self.parameters.scene_values(point[None], name)
        stated = self.measurement.recordings[name].stated.known
        return self.scene.with_values({**stated, **{path: float(x[0]) for path, x in values.items()}})

    def _possible(self, points: Array, values: dict[str, Array], scene: Scene) -> npt.NDArray[np.bool_]:
        """Mask of the points that are scenes at all, (points,): outside the box a mass may be negative.

        Inside it all are, but for numbers that limit each other, such as the moments of inertia of a body.
        """
        possible: npt.NDArray[np.bool_] = np.ones(len(points), dtype=bool)
        outside = np.any((points < self.lower) | (points > self.upper), axis=1)
        doubtful = possible.copy() if self.problem.ties else outside
        for path, numbers in values.items() if np.any(doubtful) else ():
            # Limits of fields are intervals: where the extremes are accepted, so is what lies between.
            extremes = {float(np.min(numbers[doubtful])), float(np.max(numbers[doubtful]))}
            if not all(self.accepts(path, x, scene) for x in extremes):
                possible[doubtful] &= [self.accepts(path, float(x), scene) for x in numbers[doubtful]]
        # What cannot be beside the other values of the scene may be beside those of the point.
        for k in np.flatnonzero(np.logical_not(possible)):
            possible[k] = accepts(scene, {path: float(numbers[k]) for path, numbers in values.items()})
        for group in scene.bound_together(values):
            if not self._box_accepts(group):
                possible &= [
                    accepts(scene, {path: float(values[path][k]) for path in group}) for k in range(len(points))
                ]
        return possible

    def _box_accepts(self, paths: tuple[str, ...]) -> bool:
        """Return whether the scene accepts the bounds of the parameters at some paths with each other."""
        if paths not in self._together:
            bounds = {one.path: (one.lower, one.upper) for one in self.problem.parameters.values()}
            self._together[paths] = all(path in bounds for path in paths) and all(
                accepts(self.scene, dict(zip(paths, corner, strict=True)))
                for corner in product(*(bounds[path] for path in paths))
            )
        return self._together[paths]

    def accepts(self, path: str, value: float, scene: Scene | None = None) -> bool:
        """Return whether a scene, else the model's, may have a value at a path."""
        if scene is not None and scene is not self.scene:
            return accepts(scene, {path: value})
        return self._accepted(path, value)

    def can_be(self, point: Array, name: str | None) -> bool:
        """Return whether a point (parameters,) is a scene in a recording."""
        try:
            self.scene_at(point, name)
        except InputError:
            return False
        return True

    @cached_property
    def _accepted(self) -> Accepted:
        known = [entry.parameter for entry in self.parameters.entries.values()]
        return Accepted(self.scene, {one.path: (one.lower, one.upper) for one in known if one.path is not None})

    def _residuals(self, points: Array) -> Array:
        found = self._remembered(points) if self.memory is not None else self._evaluated(points)
        self.work += len(points)
        if self.whole is not None:
            whole = self.whole
            whole.work += len(points) * self.measurement.end / whole.measurement.end
            # Values of a part cannot be compared with those of the whole, so it counts without a best value.
            whole.counter.charge(len(points), points[0], np.inf)
            values = self.cost(found)
            best = int(np.argmin(values))
            longer = (-self.measurement.end, values[best]) < (-whole.longest_fit[0], whole.longest_fit[1])
            if longer and np.isfinite(values[best]):
                whole.longest_fit = (self.measurement.end, float(values[best]), points[best].copy())
        return found

    def _remembered(self, points: Array) -> Array:
        assert self.memory is not None
        # One identification may run models of several meshes and horizons.
        model = (self.scene.fingerprint, self.measurement.end)
        if (known := self.memory.recall(model, points)) is not None:
            return known
        found = self._evaluated(points)
        self.memory.keep(model, points, found)
        return found

    def _evaluated(self, points: Array) -> Array:
        """Residuals of points; where the time ends on the way, the best of those that were run counts."""
        found = list[Array]()
        try:
            for part in self._portions(points):
                found.append(self._simulated_residuals(part))
        except TimeIsUp:
            if found:
                values = self.cost(np.concatenate(found))
                best = int(np.argmin(values))
                self.counter.charge(0, points[best], float(values[best]))
            raise
        return np.concatenate(found)

    def _portions(self, points: Array) -> Iterator[Array]:
        """Points by as many as are simulated at once where the time is limited."""
        size = len(points) if self.deadline is None else AT_ONCE if self.engine.name == "gauss" else 1
        yield from (points[k : k + size] for k in range(0, len(points), max(size, 1)))

    def _simulated_residuals(self, points: Array) -> Array:
        return self.compared(points, {name: self.observe(points, name) for name in self.measurement.recordings})

    def compared(self, points: Array, seen: Mapping[str, Array]) -> Array:
        """Return `residuals` of points whose channels are known: by recording, as `observe` gives them."""
        columns = []
        for name, recording in self.measurement.recordings.items():
            columns.append((seen[name] - recording.values)[:, np.isfinite(recording.values)])
        rows = np.concatenate(columns, axis=1) * self.rows.weight
        if self.problem.loss != "squares":
            rows = flatten(rows, self.problem.loss, self.loss_scale)
        rows = np.concatenate([rows, self._prior_rows(points)], axis=1)
        return np.where(np.isfinite(rows), rows, np.inf)

    @cached_property
    def loss_scale(self) -> Array:
        """Size of a residual from which on it counts as an outlier, (rows,): by the noise, stated or estimated."""
        return self.rows.estimated * self.rows.weight

    def steepness(self, residual: Array) -> Array:
        """Factors of the rows of the Jacobian, and divisors of the residual, in a Gauss-Newton step, (rows,)."""
        if self.problem.loss == "squares":
            return np.ones_like(residual)
        data = len(self.rows.time)
        of_data = steepness(residual[:data], self.problem.loss, self.loss_scale)
        return np.append(of_data, np.ones(len(residual) - data))

    def _prior_rows(self, points: Array) -> Array:
        values = self.parameters.to_values(points)
        rows = [(values[:, k] - prior.mean) / prior.std for k, prior in self.parameters.priors]
        return (self.rows.noise or 1.0) * np.array(rows).reshape(len(rows), len(points)).T


def _not_sensors(recording: Recording) -> Recording:
    """Without the channels that sensors feel."""
    shown = [k for k, channel in enumerate(recording.channels) if not channel.is_sensor]
    channels = tuple(recording.channels[k] for k in shown)
    return replace(recording, channels=channels, values=recording.values[:, shown], noise=recording.noise[shown])


def _with_shared(
    scene: Scene, fixed: dict[str, float], values: dict[str, Array], lanes: int
) -> tuple[Scene, dict[str, Array]]:
    """The scene with what is the same in all lanes, so that its model is kept, and the remaining values."""
    shared = fixed | {path: float(x[0]) for path, x in values.items() if _same_in_all(path, x)}
    if not shared:
        return scene, values
    try:
        return scene.with_values(shared), {path: x for path, x in values.items() if path not in shared}
    except InputError:
        # What cannot be beside the other values of the scene may be beside those of its lane.
        return scene, values | {path: np.full(lanes, x) for path, x in fixed.items()}


def _same_in_all(path: str, numbers: Array) -> bool:
    """Return whether a field other than a start is that of every lane: such lanes share one model, which is kept."""
    return len(numbers) > 1 and not path.startswith("initial.") and bool(np.all(numbers == numbers[0]))
