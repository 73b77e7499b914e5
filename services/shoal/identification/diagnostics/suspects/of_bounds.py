"""Bounds that exclude what the data want: a parameter that ends at one is freed of it."""

from __future__ import annotations

import numpy as np

from shoal.identification.conventions import DIFFERENCE
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import Parameter
from shoal.identification.recording.units import unit
from shoal.trajectory import Array

_WIDER = 3.0
"""Ranges of a parameter on either side; of one that is known by its order of magnitude, of its logarithm."""


def at_bound(model: ForwardModel, point: Array) -> list[int]:
    """Return which parameters of a point (parameters,) are at a bound."""
    near = np.minimum(point - model.lower, model.upper - point) < DIFFERENCE * (model.upper - model.lower)
    return [int(k) for k in np.flatnonzero(near)]


def without_bounds(model: ForwardModel, which: list[int]) -> ForwardModel:
    """Return the model with wider bounds of some parameters: of angles a turn; what is not negative remains so."""
    entries = list(model.parameters.entries.values())
    keys = {entries[k].key: bool(model.parameters.turning[k]) for k in which}
    sought = dict(model.problem.parameters)
    for key, turning in keys.items():
        sought[key] = _wider(sought[key], turning)
    return model.aside(problem=model.problem.model_copy(update={"parameters": sought}))


def _wider(one: Parameter, turning: bool) -> Parameter:
    lower, upper = one.lower, one.upper
    if turning:
        middle, half = 0.5 * (lower + upper), max(np.pi, 0.5 * (upper - lower))
        lower, upper = middle - half, middle + half
    elif one.logarithmic:
        factor = (upper / lower) ** _WIDER
        lower, upper = lower / factor, upper * factor
    else:
        span = _WIDER * (upper - lower)
        lower, upper = (max(0.0, lower - span) if lower >= 0.0 else lower - span), upper + span
    return one.model_copy(update={"lower": lower, "upper": upper})


def describe_bound(model: ForwardModel, point: Array, end: Array, k: int) -> tuple[float, float, str]:
    """Return the bound that a parameter stood at, its value without it, and both in words."""
    path = model.parameters.paths[k]
    low, high = (model.parameters.to_values(bounds)[k] for bounds in (model.lower, model.upper))
    bound = low if point[k] - model.lower[k] < model.upper[k] - point[k] else high
    value = float(model.parameters.to_values(end)[k])
    return float(bound), value, f"a value of {value:.4g} beyond {bound:.4g} {unit(path)}".rstrip()
