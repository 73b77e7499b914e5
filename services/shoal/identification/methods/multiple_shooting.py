"""Multiple shooting: the record in short segments, whose states are unknowns and whose ends must meet.

Every segment is short, so it depends gently on its state even where the whole motion is chaotic; that a segment ends
where the next begins is a condition of the least squares (Bock, Recent advances in parameter identification techniques
for ODE, in Numerical Treatment of Inverse Problems, 1983).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from shoal.errors import InputError
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import differentiate_many
from shoal.identification.methods.least_squares import descend
from shoal.identification.methods.outcome import Outcome
from shoal.identification.methods.progressive import TRUST, progressive
from shoal.identification.methods.starts import starting_points
from shoal.identification.problem import Parameter
from shoal.identification.recording.measurement import Recording
from shoal.identification.recording.source import Channel
from shoal.scene import Scene
from shoal.scene.joints import Attachment, Revolute
from shoal.scene.loads import DistributedForce, Force, Load, Spring, Thrust, Torque, TorsionSpring
from shoal.trajectory import Array

SEGMENT = 0.5
"""Length of a segment [s], longer where it would have too few samples."""
_SAMPLES = 5
"""Of a segment, at least."""
_ITERATIONS = 15
"""Steps at most until the segments meet."""
_MEETING = 1e-5
"""Where no unknown moves more [rad, rad/s, fractions of a range], single shooting takes over."""
_FASTEST = 1e3
"""Bound of the rates at the begins of segments [rad/s]."""
_PREFIX = "state-"
Places = npt.NDArray[np.intp]


def multiple_shooting(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Gauss-Newton on all segments under the conditions that they meet, then single shooting from there.

    Where the markers show the pose of every body the segments begin at the measured poses, else on the motion that the
    progressive horizon found. Raises InputError for machines whose state is more than angles and rates.
    """
    segments = cut(model)
    states, point = segments.measured(), starting_points(model)[0]
    if states is None:
        point = progressive(model, rng, progress).point
        states = segments.simulated(point)
    end = descend(model, segments.meet(point, states), progress)
    return Outcome(end.point, end.fitness, end.rows, end.message)


@dataclass(frozen=True)
class Segments:
    """A record in segments. Unknowns are a state per segment and the other parameters: (segments, states), (others,).

    model: of the problem; short: the same machine, whose parameters are a state and the others, and whose residuals
    are the channels, then the state, at the instants of all segments from the begin of each
    begins: of the segments, by the motion's time [s], (segments,); number: segment of each sample, (samples,);
    place: instant of each sample, (samples,); ends: instant of each end that meets a begin, (segments - 1,)
    others: components of the problem's vector that are no initial state
    """

    model: ForwardModel
    short: ForwardModel
    begins: Array
    number: Places
    place: Places
    ends: Places
    others: list[int]

    @cached_property
    def recording(self) -> Recording:
        """The record."""
        return self.model.measurement.first

    @cached_property
    def sought(self) -> dict[int, int]:
        """Components of the problem's vector that are components of the first state, where it is sought."""
        name = next(iter(self.model.measurement.recordings))
        found = {**self.model.parameters.indices(name, ".angle"), **self.model.parameters.indices(name, ".rate")}
        paths = _state_paths(self.model.scene)
        return {paths.index(path): k for path, k in found.items()}

    def measured(self) -> Array | None:
        """States (segments, states) by the poses and slopes of the data; None where these do not determine them."""
        width = 2 * len(self.model.scene.bodies)
        states = [self._state_of(starting_points(self.model)[0])]
        for k in range(1, len(self.begins)):
            found = starting_points(self._window(k))[:, :width]
            if np.max(np.abs(np.sin((found[:, ::2] - found[0, ::2]) / 2))) > 1e-3:
                return None
            states.append(found[0])
        return np.array(states)

    def simulated(self, point: Array) -> Array:
        """States (segments, states) on the motion of a point."""
        whole = np.concatenate([self._state_of(point), point[self.others]])[None]
        self.model.counter.charge(1, point, np.inf)
        self.model.work += self.begins[-1] / self.model.measurement.end
        seen = self.short.observe(whole, times=self.begins[1:])[0]
        return np.concatenate([whole[:, : -len(self.others) or None], seen[:, len(self.recording.channels) :]])

    def meet(self, point: Array, states: Array) -> Array:
        """The parameters whose motion is nearest to the data, from states at the segments' begins."""
        point = point.copy()
        for iteration in range(_ITERATIONS):
            seen, jacobian = self._differentiate(point, states)
            if not np.all(np.isfinite(seen)):
                break
            if iteration == 0:
                states = self._unwound(states, seen)
            step, moved = self._step(states, seen, jacobian)
            states = states + step
            point[self.others] += moved
            for k, component in self.sought.items():
                point[component] = states[0, k]
            point = np.clip(point, self.model.lower, self.model.upper)
            if max(np.max(np.abs(step)), np.max(np.abs(moved / self._span), initial=0.0)) < _MEETING:
                break
        return point

    def _differentiate(self, point: Array, states: Array) -> tuple[Array, Array]:
        """Channels and states (segments, instants, seen) and their derivatives (..., states and others)."""
        points = np.column_stack([states, np.tile(point[self.others], (len(states), 1))])
        instants = self.short.measurement.first.times
        seen, jacobian = differentiate_many(self.short, points)
        shape = (len(points), len(instants), -1)
        return seen.reshape(shape), jacobian.reshape(*shape, points.shape[1])

    def _step(self, states: Array, seen: Array, jacobian: Array) -> tuple[Array, Array]:
        """Change of the states (segments, states) and of the others (others,): least squares with equations."""
        count, width = states.shape
        channels = len(self.recording.channels)
        columns = np.arange(count * width).reshape(count, width)
        shared = count * width + np.arange(len(self.others))
        size = count * width + len(shared)
        rows, right, squares, numbers = list[Array](), list[Array](), 0.0, 0
        for k in range(count):
            mine, known = self.number == k, np.isfinite(self.recording.values[self.number == k])
            off = (seen[k, self.place[mine], :channels] - self.recording.values[mine])[known]
            slope = jacobian[k, self.place[mine], :channels][known]
            weight = np.broadcast_to(self._weights, known.shape)[known]
            # Only these few rows of a segment reach the common system, however many samples it has.
            weighted = np.column_stack([slope, off]) * weight[:, None]
            small: Array = np.asarray(np.linalg.qr(weighted, mode="r"))
            block = np.zeros((len(small), size))
            block[:, [*columns[k], *shared]] = small[:, :-1]
            rows.append(block)
            right.append(-small[:, -1])
            squares, numbers = squares + float(np.sum((weight * off) ** 2)), numbers + len(off)
        trust = np.sqrt(squares / numbers) / TRUST / np.concatenate([np.ones(count * width), self._span])
        equations, wanted = self._equations(states, seen, jacobian, columns, shared)
        matrix, vector = np.concatenate([*rows, np.diag(trust)]), np.concatenate([*right, np.zeros(size)])
        from scipy.linalg.lapack import dgglse  # slow to import

        found: Array = np.asarray(dgglse(matrix, equations, vector, wanted)[3])
        return found[: count * width].reshape(count, width), found[count * width :]

    def _equations(
        self, states: Array, seen: Array, jacobian: Array, columns: Array, shared: Array
    ) -> tuple[Array, Array]:
        """The conditions on a step, matrix (equations, unknowns) and right-hand side: ends meet, the known stays."""
        count, width = states.shape
        matrix = np.zeros(((count - 1) * width, count * width + len(shared)))
        for k in range(count - 1):
            mine = slice(k * width, (k + 1) * width)
            matrix[mine, [*columns[k], *shared]] = jacobian[k, self.ends[k], -width:]
            matrix[mine, columns[k + 1]] = -np.eye(width)
        gaps = states[1:] - seen[np.arange(count - 1), self.ends, -width:]
        known = [k for k in range(width) if k not in self.sought]
        stays = np.eye(width, matrix.shape[1])[known]
        return np.concatenate([matrix, stays]), np.concatenate([gaps.ravel(), np.zeros(len(known))])

    def _unwound(self, states: Array, seen: Array) -> Array:
        """The states with whole turns added so that each begins near where the one before ends."""
        states = states.copy()
        for k, end in enumerate(self.ends):
            turns = np.round((seen[k, end, -states.shape[1] :: 2] - states[k + 1, ::2]) / (2 * np.pi))
            states[k + 1 :, ::2] += 2 * np.pi * turns
            seen[k + 1 :, :, -states.shape[1] :: 2] += 2 * np.pi * turns
        return states

    def _window(self, k: int) -> ForwardModel:
        """The machine from the begin of a segment on, with the samples that determine its state there."""
        mine = self.number == k
        times = self.short.measurement.first.times[self.place[mine]]
        values = np.full((len(times), len(self.short.measurement.first.channels)), np.nan)
        values[:, : len(self.recording.channels)] = self.recording.values[mine]
        window = replace(self.short.measurement.first, times=times, values=values)
        return replace(self.short, measurement=self.short.measurement.changed(lambda _: window))

    def _state_of(self, point: Array) -> Array:
        """The initial state at a point, (states,)."""
        scene = self.model.scene_at(point)
        return np.array([scene.value(path) for path in _state_paths(scene)], dtype=float)

    @property
    def _span(self) -> Array:
        return (self.model.upper - self.model.lower)[self.others]

    @property
    def _weights(self) -> Array:
        """Weight of each channel, (channels,)."""
        rows = self.model.rows
        return np.array([rows.weight[rows.channel == k][0] for k in range(len(self.recording.channels))])


def cut(model: ForwardModel) -> Segments:
    """A record in segments. Raises InputError where the machine's state is more than angles and rates of its bodies."""
    _check(model)
    recording = model.measurement.first
    times = recording.times / recording.stated.clock + recording.stated.delay
    wanted = np.arange(SEGMENT, times[-1], SEGMENT)
    picked = np.unique(np.searchsorted(times, wanted))
    picked = picked[(picked >= _SAMPLES) & (picked <= len(times) - _SAMPLES)]
    picked = picked[np.diff(picked, prepend=-_SAMPLES) >= _SAMPLES]
    begins = np.append(0.0, times[picked])
    number = np.searchsorted(begins[1:], times, side="right")
    instants, where = np.unique(
        np.round(np.concatenate([times - begins[number], np.diff(begins)]), 9), return_inverse=True
    )
    others = np.flatnonzero(~model.parameters.initial).tolist()
    short = _short(model, instants, others)
    return Segments(model, short, begins, number, where[: len(times)], where[len(times) :], others)


def _short(model: ForwardModel, instants: Array, others: list[int]) -> ForwardModel:
    """The machine with a state and the others as parameters, and a record of zeros: its residuals are the motion."""
    scene, recording = model.scene, model.measurement.first
    angles = recording.values[:, [channel.quantity == "angle" for channel in recording.channels]]
    limits = {"angle": np.pi + float(np.nanmax(np.abs(angles), initial=0.0)), "rate": _FASTEST}
    parameters = {}
    for path in _state_paths(scene):
        limit = limits[path.rpartition(".")[2]]
        parameters[f"{_PREFIX}{path.replace('.', '-')}"] = Parameter(path=path, lower=-limit, upper=limit)
    entries = list(model.parameters.entries.values())
    parameters |= {
        entries[k].key: entries[k].parameter.model_copy(update={"prior": None, "own": False}) for k in others
    }
    markers = {f"{_PREFIX}{body}": Attachment(body=body, point=(0.0, 0.0)) for body in scene.bodies}
    channels = [Channel(marker=m, quantity=q) for m in markers for q in ("angle", "rate")]
    everything = (*recording.channels, *channels)
    zeros = np.zeros((len(instants), len(everything)))
    stated = recording.stated.model_copy(update={"clock": 1.0, "delay": 0.0})
    still = Recording(instants, everything, zeros, recording.origin, np.full(len(everything), np.nan), stated)
    return replace(
        model,
        problem=model.problem.model_copy(update={"parameters": parameters, "loss": "squares"}),
        scene=scene.model_copy(update={"markers": {**scene.markers, **markers}}),
        measurement=model.measurement.changed(lambda _: still),
        memory=None,
        whole=model,
    )


def _state_paths(scene: Scene) -> list[str]:
    """The initial state, body by body."""
    return [f"initial.{body}.{quantity}" for body in scene.bodies for quantity in ("angle", "rate")]


def _check(model: ForwardModel) -> None:
    """Raise InputError, with the reason, where segments do not follow from their state or do not fit the record."""
    scene, instead = model.scene, "use progressive"
    paths = [*model.parameters.paths, *model.problem.ties]
    joints = list(scene.joints.values())
    reasons = {
        "takes one recording": len(model.measurement.recordings) > 1,
        "takes rigid bodies only": any(b.element != "rigid" or b.kind == "point-mass" for b in scene.bodies.values()),
        "takes open chains of revolute joints only": len(joints) != len(scene.bodies)
        or not all(isinstance(joint, Revolute) for joint in joints),
        "takes no functions of time": bool(scene.ground_points) or any(map(_driven, scene.loads.values())),
        "needs the rest length or angle of every spring": any(map(_rests_at_start, scene.loads.values())),
        "takes clock and delay as known": any(p in ("measurement.clock", "measurement.delay") for p in paths),
        "counts no turns between two bodies": any(channel.to for channel in model.measurement.first.channels),
        "takes no ties of an initial state": any(path.startswith("initial.") for path in model.problem.ties),
    }
    for reason, holds in reasons.items():
        if holds:
            raise InputError(f"method: multiple-shooting {reason}; {instead}")


def _driven(load: Load) -> bool:
    """Return whether a load depends on time."""
    match load:
        case Torque():
            return load.torque.number is None
        case Thrust():
            return load.force.number is None
        case Force() | DistributedForce():
            return load.scale.number is None
        case Spring() | TorsionSpring():
            return False
        case _:
            raise NotImplementedError(f"multiple-shooting: a load of kind {load.kind} is not known")


def _rests_at_start(load: object) -> bool:
    """Return whether a load is at rest in the initial pose, which is another one in every segment."""
    return (isinstance(load, Spring) and load.length is None) or (
        isinstance(load, TorsionSpring) and load.angle is None
    )
