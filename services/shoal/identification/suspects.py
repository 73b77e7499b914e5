"""Where a model does not fit: which property of the measurement, taken as known, would explain it.

A wrong clock or scale is a fault that no fit of the machine shows. Each property is freed in turn and the residual is
regressed on its effect; the most promising properties are then fitted together with the parameters. Where none of them
explains the misfit, values of each are tried over its whole range.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import descend
from shoal.identification.problem import RESERVED, Parameter
from shoal.identification.starts import starting_points
from shoal.identification.units import of_channels, unit
from shoal.trajectory import Array

SEVERAL = 2.0
"""Times smaller: a misfit that falls by this factor is explained."""
_CONFIRMED = 3
"""Suspects that are fitted, at most."""
_SCAN = 13
_FACTORS = 2.0
"""Clock, scale and gravity are looked for within this factor."""
_STEP = 1e-4


@dataclass(frozen=True)
class Suspect:
    """A property of the measurement: its value taken as known, the fitted one, and the misfit (RMS) with either.

    unit: of the misfits, empty where channels of different units are taken together
    """

    name: str
    stated: float
    value: float
    before: float
    after: float
    unit: str = ""

    @property
    def explains(self) -> bool:
        """Whether freeing it lowers the misfit severalfold."""
        return self.after * SEVERAL <= self.before

    @property
    def words(self) -> str:
        """Its name as a sentence has it."""
        return f"offset in {self.name}" if self.name in ("x", "y") else self.name

    def __str__(self) -> str:
        """In words, as a message names it."""
        changes = f"a value of {self.value:.4g} instead of {self.stated:g} {unit(self.name)}".rstrip()
        if self.name in ("clock", "scale", "gravity"):
            changes = f"a factor of {self.value / self.stated:.4g}"
        misfit = f"the misfit from {self.before:.2g} to {self.after:.2g} {self.unit}".rstrip()
        return f"the {self.words}: {changes} would lower {misfit}"


@dataclass(frozen=True)
class _Freed:
    """A model with one more parameter at the end: the answer with what was taken as known, where to fit from, and
    the misfit over the present one that this promises.
    """

    name: str
    model: ForwardModel
    start: Array
    begin: Array
    promise: float = 1.0


def suspects(model: ForwardModel, point: Array, residual: Array, jacobian: Array) -> list[Suspect]:
    """The properties that explain the residual at an answer, the best first. Runs are not counted."""
    before = float(np.sqrt(np.mean(residual**2)))
    freed = list(_freed(model, point))
    near = [replace(free, promise=_gain(free.model, free.start, residual, jacobian)) for free in freed]
    found = _confirmed([free for free in near if free.promise < 1.0], before)
    if not found:
        # A wrong clock can lead the fit so far astray that nothing near the answer points to it.
        poses = starting_points(model)
        found = _confirmed([_scan(free, np.vstack([point, poses]), before) for free in freed], before)
    # Clock and gravity explain a free swing equally well: the order of equals is that of their names.
    return sorted(found, key=lambda s: (float(f"{s.after:.1e}"), s.name))


def _confirmed(freed: list[_Freed], before: float) -> list[Suspect]:
    """Those of the most promising that explain the misfit when they are fitted with the parameters."""
    promising = sorted(freed, key=lambda free: free.promise)
    found = (_fitted(free, before) for free in promising[:_CONFIRMED])
    return [suspect for suspect in found if suspect.explains]


def _freed(model: ForwardModel, point: Array) -> Iterator[_Freed]:
    """Models with one more parameter at the end, with the point extended by what was taken as known."""
    sought = {entry.parameter.path for entry in model.parameters.entries.values()} | set(model.problem.ties)
    for name, path, stated, parameter in _candidates(model):
        if path in sought:
            continue
        key = f"suspect-{name}"
        problem = model.problem.model_copy(update={"parameters": {**model.problem.parameters, key: parameter}})
        free = replace(model, problem=problem, memory=None, whole=None)
        start = np.append(point, np.log(stated) if parameter.logarithmic else stated)
        yield _Freed(name, free, start, start)


def _candidates(model: ForwardModel) -> Iterator[tuple[str, str, float, Parameter]]:
    """Name, path, stated value, and the parameter that frees it."""
    first = model.measurement.first
    channels = [c for recording in model.measurement.recordings.values() for c in recording.channels]
    positions = any(channel.is_position for channel in channels)
    reach = float(np.nanmax(np.abs(np.nan_to_num(first.values)))) + 1e-9
    end, begin = model.measurement.end, min(float(r.times[0]) for r in model.measurement.recordings.values())
    ratios = ("clock", "scale") if positions else ("clock",)
    for name in ratios:
        stated = float(getattr(first.stated, name))
        free = Parameter(path=f"{RESERVED}.{name}", lower=stated / _FACTORS, upper=stated * _FACTORS, scale="log")
        yield name, f"{RESERVED}.{name}", stated, free
    shifts = {"tilt": np.pi / 2} | ({"x": reach, "y": reach} if positions else {})
    for name, width in shifts.items():
        stated = float(getattr(first.stated, name))
        free = Parameter(path=f"{RESERVED}.{name}", lower=stated - width, upper=stated + width)
        yield name, f"{RESERVED}.{name}", stated, free
    stated = first.stated.delay
    lower = stated - begin / first.stated.clock
    free = Parameter(path=f"{RESERVED}.delay", lower=lower - 1e-12, upper=stated + 0.2 * end)
    yield "delay", f"{RESERVED}.delay", stated, free
    size = model.scene.gravity[1]
    if size != 0.0 and model.scene.gravity[0] == 0.0:
        lower, upper = sorted((size / _FACTORS, size * _FACTORS))
        yield "gravity", "gravity.1", size, Parameter(path="gravity.1", lower=lower, upper=upper)


def _gain(free: ForwardModel, start: Array, residual: Array, jacobian: Array) -> float:
    """Misfit over the present one that the best small change of the last parameter promises, others following."""
    step = np.zeros(len(start))
    step[-1] = _STEP * max(abs(start[-1]), 1e-2 * (free.upper - free.lower)[-1])
    moved = free.uncounted((start + step)[None])[0]
    if not np.all(np.isfinite(moved)):
        return 1.0
    effect = (moved - residual) / step[-1]
    basis, singular, _ = np.linalg.svd(jacobian, full_matrices=False)
    basis = basis[:, singular > 1e-8 * max(singular[0], 1e-300)]
    own = effect - basis @ (basis.T @ effect)
    if np.linalg.norm(own) < 1e-6 * np.linalg.norm(effect):
        return 1.0
    explained = float(own @ residual) ** 2 / float(own @ own)
    return float(np.sqrt(max(0.0, 1.0 - explained / float(residual @ residual))))


def _scan(freed: _Freed, places: Array, before: float) -> _Freed:
    """To be fitted from the best of a scan of its values, at each of the places (points, parameters)."""
    free, start = freed.model, freed.start
    values = np.concatenate([[start[-1]], np.linspace(free.lower[-1], free.upper[-1], _SCAN)[1:-1]])
    points = np.column_stack([np.repeat(places, len(values), axis=0), np.tile(values, len(places))])
    points = np.clip(points, free.lower, free.upper)
    residuals = free.uncounted(points)
    best = int(np.argmin(free.cost(residuals)))
    return replace(freed, begin=points[best], promise=float(np.sqrt(np.mean(residuals[best] ** 2))) / before)


def _fitted(freed: _Freed, before: float) -> Suspect:
    """Fit it with the parameters."""
    free = freed.model
    best = descend(free, freed.begin, lambda *_: None)
    value, stated = (float(free.parameters.to_values(end)[-1]) for end in (best.point, freed.start))
    after = float(np.sqrt(np.mean(best.residual**2))) if np.isfinite(best.fitness) else np.inf
    return Suspect(freed.name, stated, value, before, after, of_channels(freed.model.measurement))
