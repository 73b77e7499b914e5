"""What to measure: which marker, for how long and how often would sharpen the parameter that is known worst.

The sensitivities of every place to the parameters, at all times, come from one set of runs. With noise of a given size
they tell the standard deviation of every parameter beforehand (Cramer-Rao bound; Atkinson, Donev, Tobias, Optimum
Experimental Designs, 2007), to first order about one set of values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.identification.forward import ForwardModel
from shoal.identification.identify import identify
from shoal.identification.measurement import Measurement, Recording
from shoal.identification.problem import Problem
from shoal.identification.recording import Channel, Clocked, EngineSource
from shoal.identification.sensitivity import AGREED, sensitivity
from shoal.identification.uncertainty import RANK_TOLERANCE
from shoal.scene import Scene
from shoal.trajectory import Array, plain

_DURATIONS = (0.25, 0.5, 1.0, 1.5, 2.0)
_RATES = (0.25, 0.5, 1.0, 2.0)
_COURSE = 40
_MOST = 4000
"""Instants at which sensitivities are computed, at most."""
_SAME = 1e-3
"""Two places whose sensitivities differ by less tell the same."""


@dataclass(frozen=True)
class Precision:
    """What a measurement would tell: standard deviation of each parameter (of its logarithm where that is sought).

    std: inf where nothing is told, (parameters,); the others relative to the ranges between the bounds
    a: root of the mean variance; d: geometric mean over the axes of the ellipsoid; unknown: directions left open
    """

    std: Array
    a: float
    d: float
    unknown: int


@dataclass(frozen=True)
class Candidate:
    """Something that could be measured. body, point: where; quantity: position (x and y) or angle."""

    name: str
    body: str
    point: str | tuple[float, float]
    quantity: Literal["position", "angle"]

    @property
    def label(self) -> str:
        """For tables."""
        return f"{self.name}, {'x and y' if self.quantity == 'position' else 'angle'}"

    @property
    def channels(self) -> tuple[Channel, ...]:
        """As signals."""
        quantities: tuple[Any, ...] = ("x", "y") if self.quantity == "position" else ("angle",)
        return tuple(Channel(marker=self.name, quantity=quantity) for quantity in quantities)


@dataclass(frozen=True)
class Design:
    """Candidates, the best first, at the duration [s] and rate [1/s] of today, for given noise [m], [rad].

    span: ranges between the bounds; parameter: to be sharpened, None for the weakest, whichever that is
    now: with the channels of the problem; second: each candidate beside the best one
    table: score by the best marker, (durations, rates)
    course: score of each candidate until `times` [s], (candidates, times)
    doubt: relative difference of two steps of the sensitivities
    """

    problem: str
    names: tuple[str, ...]
    values: dict[str, float]
    noise: float
    angle_noise: float | None
    duration: float
    rate: float
    span: Array
    parameter: str | None
    now: Precision
    ranked: list[tuple[Candidate, Precision]]
    second: list[tuple[Candidate, Precision]]
    durations: Array
    rates: Array
    table: Array
    times: Array
    course: Array
    doubt: float

    def weakest(self, precision: Precision) -> tuple[str, float]:
        """The parameter that counts, and its standard deviation."""
        k = _counting(self.names, precision, self.span, self.parameter)
        return self.names[k], float(precision.std[k])

    def score(self, precision: Precision) -> float:
        """Standard deviation of the parameter that counts over its range: the smaller the better."""
        return _score(self.names, precision, self.span, self.parameter)

    @property
    def ok(self) -> bool:
        """Whether the best candidate tells the parameter, by sensitivities that can be believed."""
        return bool(np.isfinite(self.score(self.ranked[0][1])) and self.doubt <= AGREED)

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal design --json` prints; null where nothing is told."""

        def told(precision: Precision) -> dict[str, Any]:
            std = dict(zip(self.names, precision.std.tolist(), strict=True))
            return {"std": std, "a": precision.a, "d": precision.d, "unknown": precision.unknown}

        def rows(found: list[tuple[Candidate, Precision]]) -> list[dict[str, Any]]:
            return [
                {"marker": c.name, "body": c.body, "point": c.point, "quantity": c.quantity} | told(p) for c, p in found
            ]

        return plain(  # type: ignore[no-any-return]
            {
                "status": "ok" if self.ok else "failed",
                "problem": self.problem,
                "values": self.values,
                "noise": self.noise,
                "angle_noise": self.angle_noise,
                "duration": self.duration,
                "rate": self.rate,
                "weakest": self.weakest(self.now)[0],
                "parameter": self.parameter,
                "now": told(self.now),
                "ranked": rows(self.ranked),
                "second": rows(self.second),
                "durations": self.durations,
                "rates": self.rates,
                "table": self.table,
                "doubt": self.doubt,
            }
        )


def design(
    problem: Problem,
    *,
    at: Mapping[str, float] | None = None,
    values: Mapping[str, Any] | None = None,
    measurement: Measurement | None = None,
    noise: float | None = None,
    angle_noise: float | None = None,
    duration: float | None = None,
    rate: float | None = None,
    parameter: str | None = None,
) -> Design:
    """Rank what could be measured in (the first recording of) a problem. Raises InputError.

    at: values of the parameters, else their starts; values: fields of the scene; measurement: whose duration and rate
    are today's, where `duration` [s] and `rate` [1/s] are not given; noise [m], angle_noise [rad]: standard deviations,
    else the problem's; parameter: to sharpen, else whichever has the largest standard deviation for its range
    """
    name, source = next(iter(problem.sources.items()))
    noise, angle_noise = _noise(problem, noise, angle_noise)
    duration, rate = _today(source, measurement, duration, rate)
    scene, candidates = _candidates(problem.load_scene(values))
    # Standard deviations are told in the parameters' own units, but for those that are stated to be logarithms.
    scales = {n: p.model_copy(update={"scale": "linear"}) for n, p in problem.parameters.items() if p.scale == "auto"}
    changes = {"loss": "squares", "recordings": {name: source} if problem.recordings else {}}
    changes["parameters"] = {**problem.parameters, **scales}
    chosen = problem.model_copy(update=changes)
    channels = (*problem.channels_of(source), *(channel for c in candidates for channel in c.channels))
    times = _grid(duration, rate)
    nothing = Recording(times, channels, np.zeros((len(times), len(channels))), "", np.full(len(channels), np.nan))
    stated = Clocked(**{field: getattr(source, field) for field in Clocked.model_fields})
    looked = Measurement({name: Recording(**{**vars(nothing), "stated": stated})})
    model = ForwardModel(chosen, scene, get_engine("gauss"), looked)
    point = _point(model, at)
    seen = sensitivity(model, point)
    if not np.all(np.isfinite(seen.residual)):
        raise InputError(
            f"{problem.name}: the motion about these values cannot be simulated: {model.refusal or 'it fails'}"
        )
    rows = len(times) * len(channels)
    size = np.array([_size(channel, noise, angle_noise) for channel in channels])
    table = seen.jacobian[:rows].reshape(len(times), len(channels), -1) / size[:, None]
    bundle = _Bundle(times, table, seen.jacobian[rows:], model.upper - model.lower, len(problem.channels_of(source)))
    return _ranked(
        problem, model, point, bundle, candidates, (noise, angle_noise, duration, rate), parameter, seen.doubt
    )


def has_data(problem: Problem) -> bool:
    """Whether a problem brings its own data."""
    return all(isinstance(source, EngineSource) or source.path for source in problem.sources.values())


def about_answer(
    problem: Problem,
    data: str | Mapping[str, str] | None = None,
    values: Mapping[str, Any] | None = None,
    **options: Any,
) -> Design:
    """A design about what the problem's data (or `data`) tell; options: of `design`.

    Raises InputError, ComputationError where the answer cannot be trusted.
    """
    found = identify(problem, data=data, values=values)
    if not found.verdict.trusted:
        raise ComputationError(
            f"{problem.name}: {found.verdict} ({found.message}); a design about the starts does without"
        )
    at = {name: value.value for name, value in found.parameters.items()}
    return design(problem, at=at, values=values, measurement=found.measurement, **options)


@dataclass(frozen=True)
class _Bundle:
    """Sensitivities over the noise, (times, channels, parameters): `present` channels of today, then candidates."""

    times: Array
    table: Array
    prior: Array
    span: Array
    present: int

    def precision(self, columns: Sequence[int], end: float, every: int = 2) -> Precision:
        """By some of the channels until a time [s], every so many instants."""
        # The grid is twice as fine as today's sampling.
        keep = (self.times <= end * (1 + 1e-9))[every - 1 :: every]
        rows = self.table[every - 1 :: every][keep][:, list(columns)].reshape(-1, len(self.span))
        return precision(np.concatenate([rows, self.prior]), self.span)


def precision(jacobian: Array, span: Array) -> Precision:
    """What rows of sensitivities over the noise tell, (rows, parameters), for ranges `span` (parameters,)."""
    count = len(span)
    rows = np.concatenate([jacobian * span, np.zeros((count, count))])
    _, singular, right = np.linalg.svd(np.linalg.qr(rows, mode="r"))
    known = singular > RANK_TOLERANCE * singular[0] if singular[0] > 0 else np.zeros(count, dtype=bool)
    inverse = np.where(known, 1.0 / np.where(known, singular, 1.0), 0.0)
    relative = np.sqrt(np.sum((right.T * inverse) ** 2, axis=1))
    hidden = np.linalg.norm(right[~known], axis=0) > 1e-3
    relative = np.where(hidden, np.inf, relative)
    d = float(np.exp(np.mean(np.log(inverse)))) if np.all(known) else np.inf
    return Precision(relative * span, float(np.sqrt(np.mean(relative**2))), d, int(np.sum(~known)))


def _ranked(
    problem: Problem,
    model: ForwardModel,
    point: Array,
    bundle: _Bundle,
    candidates: list[Candidate],
    asked: tuple[float, float | None, float, float],
    parameter: str | None,
    doubt: float,
) -> Design:
    noise, angle_noise, duration, rate = asked
    now = bundle.precision(range(bundle.present), duration)
    if parameter is not None and parameter not in model.names:
        raise InputError(f"parameter: no parameter {parameter!r}; there are {', '.join(model.names)}")

    def score(found: Precision) -> float:
        return _score(model.names, found, bundle.span, parameter)

    def order(pair: tuple[Candidate, Precision]) -> tuple[float, int, float]:
        return score(pair[1]), pair[1].unknown, pair[1].a

    columns = _columns(bundle, candidates, angle_noise is not None)
    ranked = sorted(((c, bundle.precision(own, duration)) for c, own in columns.items()), key=order)
    best = columns[ranked[0][0]]
    others = ((c, bundle.precision([*best, *own], duration)) for c, own in columns.items() if own != best)
    durations, steps = duration * np.array(_DURATIONS), [round(2 / factor) for factor in _RATES]
    times = np.linspace(0.0, 2 * duration, _COURSE + 1)[1:]
    return Design(
        problem.name,
        model.names,
        dict(zip(model.names, model.parameters.to_values(point).tolist(), strict=True)),
        noise,
        angle_noise,
        duration,
        rate,
        bundle.span,
        parameter,
        now,
        ranked,
        sorted(others, key=order),
        durations,
        rate * np.array(_RATES),
        np.array([[score(bundle.precision(best, end, step)) for step in steps] for end in durations]),
        times,
        np.array([[score(bundle.precision(columns[c], end)) for end in times] for c, _ in ranked]),
        doubt,
    )


def _columns(bundle: _Bundle, candidates: list[Candidate], angles: bool) -> dict[Candidate, list[int]]:
    """The channels of each candidate, without those that tell nothing or the same as one before."""
    found: dict[Candidate, list[int]] = {}
    place = bundle.present
    for candidate in candidates:
        own = list(range(place, place + len(candidate.channels)))
        place = own[-1] + 1
        mine = bundle.table[:, own] * bundle.span
        size = float(np.linalg.norm(mine))
        same = [k for k in found.values() if len(k) == len(own)]
        repeated = any(np.linalg.norm(bundle.table[:, k] * bundle.span - mine) < _SAME * size for k in same)
        if size > 0 and not repeated and (angles or candidate.quantity == "position"):
            found[candidate] = own
    if not found:
        raise InputError("parameters: no marker and no end of a body moves with any of them")
    return found


def _candidates(scene: Scene) -> tuple[Scene, list[Candidate]]:
    """The scene with markers at all its bodies' named points, and what they could show; existing markers first."""
    places: dict[str, tuple[str, Any]] = {name: (m.body, m.point) for name, m in scene.markers.items()}
    for body_name, body in scene.bodies.items():
        for point in body.points:
            if point != "centre":
                places.setdefault(f"{body_name}-{point}", (body_name, point))
    data = scene.model_dump(mode="json")
    data["markers"] = {name: {"body": body, "point": point} for name, (body, point) in places.items()}
    quantities: tuple[Literal["position", "angle"], ...] = ("position", "angle")
    found = [Candidate(name, *place, quantity) for quantity in quantities for name, place in places.items()]
    return Scene.parse(data, scene.name), found


def _noise(problem: Problem, noise: float | None, angle_noise: float | None) -> tuple[float, float | None]:
    """Standard deviations of positions [m] and angles [rad], as given, else as the problem states them."""
    source = next(iter(problem.sources.values()))
    for channel in problem.channels_of(source):
        stated = channel.noise or problem.noise
        if channel.is_position:
            noise = noise or stated
        elif channel.quantity == "angle":
            angle_noise = angle_noise or stated
    for what, size in (("noise", noise), ("angle_noise", angle_noise)):
        if size is not None and not (np.isfinite(size) and size > 0):
            raise InputError(f"{what}: {size:g} is no standard deviation; it is positive")
    if noise is None:
        raise InputError(f"noise: {problem.name} states none for positions; give their standard deviation in m")
    if angle_noise is None and any(not channel.is_position for channel in problem.channels_of(source)):
        raise InputError(
            f"angle_noise: {problem.name} states none for its angles; give their standard deviation in rad"
        )
    return noise, angle_noise


def _size(channel: Channel, noise: float, angle_noise: float | None) -> float:
    """Standard deviation of a channel; a rate without its own is as noisy as an angle, per second."""
    return channel.noise or (noise if channel.is_position else angle_noise or 1.0)


def _today(
    source: Any, measurement: Measurement | None, duration: float | None, rate: float | None
) -> tuple[float, float]:
    """Duration [s] and samples per second, as given, else of the measurement, else as the source says."""
    if measurement is not None:
        times = measurement.first.times
        found = (float(times[-1]), len(times) / float(times[-1]))
    elif isinstance(source, EngineSource):
        found = (source.stop, source.count / source.stop)
    else:
        found = (source.duration or 0.0, (source.rate or 0.0) / source.every)
    duration, rate = found[0] if duration is None else duration, found[1] if rate is None else rate
    for what, size, unit in (("duration", duration, "s"), ("rate", rate, "samples per second")):
        if not (np.isfinite(size) and size > 0):
            raise InputError(f"{what}: needed, and positive [{unit}]; without a recording it cannot be guessed")
    return duration, rate


def _grid(duration: float, rate: float) -> Array:
    """Instants until twice the duration at twice the rate. Raises InputError."""
    count = round(4 * duration * rate)
    if not 8 <= count <= _MOST:
        raise InputError(
            f"rate: {rate:g} samples per second over {duration:g} s; at most {_MOST // 4} in all, and at least 2"
        )
    return np.arange(1, count + 1) / (2 * rate)


def _point(model: ForwardModel, at: Mapping[str, float] | None) -> Array:
    if at is None:
        return model.parameters.start
    missing = [name for name in model.names if name not in at]
    if missing:
        raise InputError(f"at: no value for {missing[0]}; there are {', '.join(at)}")
    return model.parameters.to_vector(np.array([at[name] for name in model.names]))


def _counting(names: Sequence[str], found: Precision, span: Array, parameter: str | None) -> int:
    return int(np.argmax(found.std / span)) if parameter is None else names.index(parameter)


def _score(names: Sequence[str], found: Precision, span: Array, parameter: str | None) -> float:
    k = _counting(names, found, span, parameter)
    return float(found.std[k] / span[k])
