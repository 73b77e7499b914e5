"""Optimal experiment design: the sensor, place, duration and rate that would sharpen the worst known parameter.

The sensitivities of every place to the parameters, at all times, come from one set of runs. With noise of a given size
they give the standard deviation of every parameter beforehand (Cramer-Rao bound; Atkinson, Donev, Tobias, Optimum
Experimental Designs, 2007), to first order about one set of values.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.identification.design.asked import ANGLE, POSITION, SENSORS, grid, noise_in, stated_noise, today_of
from shoal.identification.design.precision import Aim, Bundle, Precision
from shoal.identification.design.sensors import Sensor, columns_of, sensors_of
from shoal.identification.forward import ForwardModel
from shoal.identification.identify import identify
from shoal.identification.measure import measure
from shoal.identification.problem import Problem
from shoal.identification.recording.measurement import Measurement, Recording
from shoal.identification.recording.source import Channel, EngineSource
from shoal.identification.uncertainty.sensitivity import sensitivity
from shoal.identification.uncertainty.uncertain_inputs import taken_as_given
from shoal.json_values import plain
from shoal.scene import Scene
from shoal.trajectory import Array

ABOUT = ("answer", "start")
_DURATIONS = (0.25, 0.5, 1.0, 1.5, 2.0)
"""Durations that a plan compares, as multiples of the present one."""
_RATES = (0.25, 0.5, 1.0, 2.0)
"""Sampling rates that a plan compares, likewise."""
_COURSE = 40
_ENOUGH = 0.1
"""Relative difference of the sensitivities by two steps: who compares sensors wants no more digits."""


@dataclass(frozen=True, eq=False)
class Design:
    """Sensors, the best first, at the duration [s] and rate [1/s] of today.

    noise: standard deviations in SI units by what is measured, of the kinds that were weighed
    aim: what is to be sharpened; now: with the channels of the problem; second: each sensor beside the best one
    table: score by the best marker, (durations, rates)
    course: score of each sensor until `times` [s], (sensors, times)
    doubt: relative difference of two steps of the sensitivities
    given: what counts in the standard deviations beside the noise: fields and drives that are taken as known
    """

    problem: str
    aim: Aim
    values: dict[str, float]
    noise: dict[str, float]
    duration: float
    rate: float
    now: Precision
    ranked: list[tuple[Sensor, Precision]]
    second: list[tuple[Sensor, Precision]]
    durations: Array
    rates: Array
    table: Array
    times: Array
    course: Array
    doubt: float
    given: list[str]

    @property
    def message(self) -> str:
        """Reason why it cannot be trusted; empty where it can."""
        if not self.doubt <= _ENOUGH:
            return (
                f"sensitivities by two steps differ by {self.doubt:.0e}: the motion is chaotic, or rough by its solver"
            )
        if not np.isfinite(self.aim.score(self.ranked[0][1])):
            return "no sensor alone tells what is to be sharpened; name another `parameter`"
        return ""

    @property
    def ok(self) -> bool:
        """Return whether the best sensor determines the parameter, by sensitivities that can be believed."""
        return not self.message

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal design --json` prints; null where nothing is known."""

        def described(precision: Precision) -> dict[str, Any]:
            std = dict(zip(self.aim.names, precision.std.tolist(), strict=True))
            return {"std": std, "a": precision.a, "d": precision.d, "unknown": precision.unknown}

        def rows(found: list[tuple[Sensor, Precision]]) -> list[dict[str, Any]]:
            return [sensor.to_json() | described(precision) for sensor, precision in found]

        stated = ("message", "problem", "values", "duration", "rate")
        noise: dict[str, Any] = {"noise": self.noise.get(POSITION), "angle_noise": self.noise.get(ANGLE)}
        noise["sensor_noise"] = {kind: size for kind, size in self.noise.items() if kind in SENSORS}
        return plain(  # type: ignore[no-any-return]
            {"status": "ok" if self.ok else "failed", **{name: getattr(self, name) for name in stated}, **noise}
            | {"weakest": self.aim.weakest(self.now)[0], "parameter": self.aim.parameter, "now": described(self.now)}
            | {"ranked": rows(self.ranked), "second": rows(self.second), "durations": self.durations}
            | {"rates": self.rates, "table": self.table, "doubt": self.doubt}
            | {"given": self.given}
        )


def design(
    problem: Problem,
    *,
    at: Mapping[str, float] | None = None,
    values: Mapping[str, Any] | None = None,
    measurement: Measurement | None = None,
    noise: float | None = None,
    angle_noise: float | None = None,
    sensor_noise: Mapping[str, float] | None = None,
    duration: float | None = None,
    rate: float | None = None,
    parameter: str | None = None,
) -> Design:
    """Rank what could be measured in (the first recording of) a problem. Raises InputError.

    at: values of the parameters, else their starts; values: fields of the scene; measurement: whose duration and rate
    are today's, where `duration` [s] and `rate` [1/s] are not given; noise [m], angle_noise [rad]: standard deviations,
    else the problem's; sensor_noise: of acceleration [m/s^2], rate [rad/s], force [N], torque [N m] and strain: sensors
    whose noise is known are weighed; parameter: to sharpen, else whichever has the largest standard deviation for its
    range
    """
    source = next(iter(problem.sources.values()))
    sizes = stated_noise(problem, noise, angle_noise, sensor_noise)
    own = None if measurement is None or duration is not None or rate is not None else measurement.first.times
    duration, rate, first = today_of(source, measurement, duration, rate)
    stated = problem.load_scene(values)
    scene, sensors = sensors_of(stated, sizes)
    present = problem.channels_of(source)
    sensors = _possible(problem, scene, sensors, at)
    channels = (*present, *(channel for sensor in sensors for channel in sensor.channels))
    size = np.array([noise_in(channel, sizes) for channel in channels])
    model = _model(problem, scene, channels, size, grid(duration, rate, first))
    aim = _aim(model, parameter)
    point = _point(model, at)
    bundle, doubt, given = _bundle(model, point, aim, len(present), first is not None)
    now = bundle.precision(range(bundle.present), duration)
    if own is not None:
        # What was measured is known by its own instants, which may be uneven.
        measured = _model(problem, scene, present, size[: len(present)], own)
        now = _bundle(measured, point, aim, len(present), True)[0].precision(range(len(present)), duration, 1)

    def order(pair: tuple[Sensor, Precision]) -> tuple[float, int, float]:
        return aim.score(pair[1]), pair[1].unknown, pair[1].a

    columns = columns_of(bundle, sensors)
    ranked = _of_best_tilt(sorted(((c, bundle.precision(own, duration)) for c, own in columns.items()), key=order))
    best = columns[ranked[0][0]]
    others = [(c, bundle.precision([*best, *columns[c]], duration)) for c, _ in ranked[1:]]
    durations, steps = duration * np.array(_DURATIONS), [round(2 / factor) for factor in _RATES]
    course = np.linspace(0.0, 2 * duration, _COURSE + 1)[1:]
    return Design(
        problem=problem.name,
        aim=aim,
        values=model.parameters.by_name(point),
        noise=sizes,
        duration=duration,
        rate=rate,
        now=now,
        ranked=ranked,
        second=sorted(others, key=order),
        durations=durations,
        rates=rate * np.array(_RATES),
        table=np.array([[aim.score(bundle.precision(best, end, step)) for step in steps] for end in durations]),
        times=course,
        course=np.array([[aim.score(bundle.precision(columns[c], end)) for end in course] for c, _ in ranked]),
        doubt=doubt,
        given=given,
    )


def _bundle(model: ForwardModel, point: Array, aim: Aim, present: int, begins: bool) -> tuple[Bundle, float, list[str]]:
    """Sensitivities over the noise, the relative difference of two steps, and what is given. Raises InputError."""
    seen = sensitivity(model, point)
    if not np.all(np.isfinite(seen.residual)):
        reason = model.refusal or "it fails"
        raise InputError(f"{model.problem.name}: the motion about these values cannot be simulated: {reason}")
    assert model.rows.noise is not None
    over_noise = np.stack([seen.jacobian, seen.error], axis=1) / model.rows.noise
    recording = model.measurement.first
    channels = len(recording.channels)
    moved, given = _moved(model, point, len(seen.residual))
    return Bundle.of(recording.times, over_noise, moved, channels, aim.span, present, begins), seen.doubt, given


def _moved(model: ForwardModel, point: Array, rows: int) -> tuple[Array, list[str]]:
    """Change of the rows over the noise by uncertain inputs, (n, rows), and their description."""
    name, noise = next(iter(model.measurement.recordings)), model.rows.noise
    predicted = {name: model.observe(point[None], name)[0]}
    signals, fields = taken_as_given(model, point, predicted, np.full(rows, noise))
    found = [one for one in (*signals, fields) if one is not None]
    return np.concatenate([np.zeros((0, rows)), *(one.moved for one in found)]) / noise, [one.what for one in found]


def _aim(model: ForwardModel, parameter: str | None) -> Aim:
    """Return the aim of a design. Raises InputError."""
    if parameter is not None and parameter not in model.names:
        raise InputError(f"parameter: no parameter {parameter!r}; there are {', '.join(model.names)}")
    return Aim(model.names, model.upper - model.lower, parameter)


def _of_best_tilt(found: list[tuple[Sensor, Precision]]) -> list[tuple[Sensor, Precision]]:
    """Without accelerometers of one axis that determine less than another in their place; the best come first."""
    first = dict[object, Sensor]()
    for sensor, _ in found:
        first.setdefault(sensor.name if sensor.quantity == "one-axis" else sensor, sensor)
    kept = {*first.values()}
    return [(sensor, precision) for sensor, precision in found if sensor in kept]


def _possible(problem: Problem, scene: Scene, sensors: list[Sensor], at: Mapping[str, float] | None) -> list[Sensor]:
    """Without load cells in joints whose force is not unique."""
    beyond = set[str]()
    for name, sensor in {sensor.name: sensor for sensor in sensors if sensor.in_joint}.items():
        model = _model(problem, scene, sensor.channels, np.ones(len(sensor.channels)), np.array([0.0, 1e-3]))
        if not np.all(np.isfinite(model.observe(_point(model, at)[None]))):
            beyond.add(name)
    return [sensor for sensor in sensors if not (sensor.in_joint and sensor.name in beyond)]


def _model(problem: Problem, scene: Scene, channels: tuple[Channel, ...], noise: Array, times: Array) -> ForwardModel:
    """Return the model of the first recording with other channels, noise and times, nothing measured yet."""
    name, source = next(iter(problem.sources.items()))
    # Standard deviations are given in the parameters' own units, but for those that are stated to be logarithms.
    scales = {n: p.model_copy(update={"scale": "linear"}) for n, p in problem.parameters.items() if p.scale == "auto"}
    changes = {"loss": "squares", "recordings": {name: source} if problem.recordings else {}}
    changes["parameters"] = {**problem.parameters, **scales}
    zeros = np.zeros((len(times), len(channels)))
    nothing = Measurement({name: Recording(times, channels, zeros, "", noise, source.as_stated())})
    return ForwardModel(problem.model_copy(update=changes), scene, get_engine("gauss"), nothing)


def has_data(problem: Problem) -> bool:
    """Return whether a problem brings its own data."""
    return all(isinstance(source, EngineSource) or source.path for source in problem.sources.values())


def about_answer(
    problem: Problem,
    data: str | Mapping[str, str] | None = None,
    values: Mapping[str, Any] | None = None,
    **options: Any,
) -> Design:
    """A design about what the problem's data (or `data`) give; options: of `design`.

    Raises InputError, ComputationError where the answer cannot be trusted.
    """
    sources = list(problem.sources.values())
    computed = any(isinstance(source, EngineSource) for source in sources)
    measurement = None if computed else measure(problem, problem.load_scene(), data)
    # What is asked for is looked at first, as an identification may take long.
    stated_noise(problem, *(options.get(name) for name in ("noise", "angle_noise", "sensor_noise")))
    times = grid(*today_of(sources[0], measurement, options.get("duration"), options.get("rate")))
    channels = problem.channels_of(sources[0])
    _aim(_model(problem, problem.load_scene(values), channels, np.ones(len(channels)), times), options.get("parameter"))
    found = identify(problem, data=data, values=values, measurement=measurement)
    if not found.verdict.trusted:
        raise ComputationError(
            f"{problem.name}: {found.verdict} ({found.message}); a design about the starts does without"
        )
    at = {name: value.value for name, value in found.parameters.items()}
    return design(problem, at=at, values=values, measurement=found.measurement, **options)


def about_start(
    problem: Problem,
    data: str | Mapping[str, str] | None = None,
    values: Mapping[str, Any] | None = None,
    **options: Any,
) -> Design:
    """A design about the starts of the parameters; the sample times are those of the data, if there are any.

    options: of `design`. Raises InputError.
    """
    computed = any(isinstance(source, EngineSource) for source in problem.sources.values())
    asked = options.get("duration") is None or options.get("rate") is None
    read = asked and not computed and (data is not None or has_data(problem))
    measurement = measure(problem, problem.load_scene(), data) if read else None
    return design(problem, values=values, measurement=measurement, **options)


def _point(model: ForwardModel, at: Mapping[str, float] | None) -> Array:
    if at is None:
        return model.parameters.start
    missing = [name for name in model.names if name not in at]
    if missing:
        raise InputError(f"at: no value for {missing[0]}; there are {', '.join(at)}")
    return model.parameters.to_vector(np.array([at[name] for name in model.names]))
