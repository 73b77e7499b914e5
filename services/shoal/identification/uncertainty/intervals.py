"""Confidence intervals of parameters and quantities at an answer: by its linearisation, with the model's own error."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shoal.identification.conventions import DIFFERENCE, LEVEL
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import RESERVED
from shoal.identification.recording.units import unit
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import Linearisation, Spread, linearise, spread
from shoal.identification.uncertainty.model_error import Corrections
from shoal.scene import expression
from shoal.trajectory import Array


@dataclass(frozen=True)
class Value:
    """An estimated number: its standard deviation, and a 95 % interval (Student's t) with the model's own error in it.

    correction: what a mesh twice as fine with shorter steps would add to the value, of rigid machines the steps alone,
    None if not computed; it is not added, but is in the interval
    theory: what shear and rotary inertia would add where slender beams neglect them; likewise
    unit: of all of them, empty where there is none or none is known
    fixed: whether the data limit it at all; an estimate has neither deviation nor interval of others
    """

    value: float
    std: float
    lower: float
    upper: float
    identifiable: bool
    correction: float | None = None
    at_bound: bool = False
    unit: str = ""
    theory: float | None = None
    fixed: bool = True

    def reported(self) -> Value:
        """Return it as reported: linear theory gives no interval along open directions, nor at a bound."""
        return replace(self, std=np.nan, lower=np.nan, upper=np.nan) if self.at_bound or not self.fixed else self

    def exponential(self) -> Value:
        """The value of a parameter that was sought by its logarithm."""
        value = float(np.exp(self.value))
        correction = None if self.correction is None else value * self.correction
        with np.errstate(over="ignore"):
            lower, upper = float(np.exp(self.lower)), float(np.exp(self.upper))
        theory = None if self.theory is None else value * self.theory
        return replace(
            self, value=value, std=value * self.std, lower=lower, upper=upper, correction=correction, theory=theory
        )


_FEWEST = 3
"""More numbers than parameters that have to be measured for what the fit leaves to tell the noise."""


def parameters(model: ForwardModel, point: Array, at: Linearisation, correction: Corrections) -> dict[str, Value]:
    """Return the value of every parameter by its name, in its own units."""
    found = {}
    for k, name in enumerate(model.names):
        about = spread(lambda p, k=k: float(p[k]), point, at)  # type: ignore[misc]
        span = model.upper[k] - model.lower[k]
        at_bound = bool(min(point[k] - model.lower[k], model.upper[k] - point[k]) < DIFFERENCE * span)
        shift = correction.of(lambda p, k=k: float(p[k]), point)  # type: ignore[misc]
        determined = about.fixed and not at_bound and about.std < span and not few(model)
        known = _value(float(point[k]), about, determined, shift, at_bound)
        known = known.exponential() if model.parameters.logarithmic[k] else known
        found[name] = replace(known, unit=unit(model.parameters.paths[k]), fixed=about.fixed and not few(model))
    return possible(model, found)


def quantities(
    model: ForwardModel, point: Array, at: Linearisation, correction: Corrections, curved: list[int]
) -> dict[str, Value]:
    """Return the value of every quantity by its name; none that depends on parameters `curved` is identifiable."""
    found, entries = {}, list(model.parameters.entries.values())
    doubtful = {entries[k].key for k in curved}
    for name, text in model.problem.quantities.items():
        for recording in model.measurement.recordings if _own(model, text) else [None]:

            def value_at(p: Array, text: str = text, recording: str | None = recording) -> float:
                named = model.parameters.named(p[None], recording)
                return expression.evaluate(text, {key: float(x[0]) for key, x in named.items()})

            about = spread(value_at, point, at)
            shift = correction.of(value_at, point)
            determined = about.fixed and not doubtful & set(expression.names(text))
            known = replace(_value(value_at(point), about, determined, shift, False), fixed=about.fixed)
            found[f"{recording}.{name}" if recording else name] = known
    return found


def spanning(ends: list[dict[str, Value]]) -> dict[str, Value]:
    """The values of the first, with intervals that span those at all ends of its valley."""
    first = ends[0]
    lower = {name: min(end[name].lower for end in ends) for name in first}
    upper = {name: max(end[name].upper for end in ends) for name in first}
    return {name: replace(value, lower=lower[name], upper=upper[name]) for name, value in first.items()}


@dataclass(frozen=True, eq=False)
class Refit:
    """A fit with something freed that was taken as known: model, point, residuals and Jacobian there."""

    model: ForwardModel
    point: Array
    residual: Array
    jacobian: Array

    def values(self) -> dict[str, Value]:
        """Values of all parameters, freed numbers included."""
        return parameters(self.model, self.point, self._at, Corrections(None, None))

    def quantities(self) -> dict[str, Value]:
        """Values of all quantities."""
        return quantities(self.model, self.point, self._at, Corrections(None, None), [])

    @cached_property
    def _at(self) -> Linearisation:
        blocks = blocks_of(self.model, len(self.residual))
        return linearise(self.jacobian, self.residual, self.model.sizes(self.point), blocks)


def with_refits(model: ForwardModel, values: dict[str, Value], refits: list[Refit]) -> dict[str, Value]:
    """Values whose intervals span those of refits too; what a refit leaves open is not identifiable.

    Neither is a parameter that the data determine no better than the bounds do.
    """
    ends = [values, *(refit.values() for refit in refits)]
    determined = {name: all(end[name].identifiable for end in ends) for name in values}
    fixed = {name: all(end[name].fixed for end in ends) for name in values}
    found = {n: replace(value, identifiable=determined[n], fixed=fixed[n]) for n, value in spanning(ends).items()}
    return {
        n: replace(x, identifiable=x.identifiable and _narrower(model, k, x)) for k, (n, x) in enumerate(found.items())
    }


def _narrower(model: ForwardModel, k: int, known: Value) -> bool:
    """Return whether the interval of a parameter is narrower than that of a number anywhere between its bounds."""
    ends = np.array([known.lower, known.upper])
    if model.parameters.logarithmic[k]:
        ends = np.log(np.maximum(ends, 1e-300))
    return bool(ends[1] - ends[0] < LEVEL * (model.upper[k] - model.lower[k]))


def covariance(model: ForwardModel, point: Array, at: Linearisation) -> Array:
    """Covariance of the values, (parameters, parameters): d exp(p) = exp(p) dp for logarithmic ones."""
    slope = np.where(model.parameters.logarithmic, model.parameters.to_values(point), 1.0)
    return np.asarray(slope[:, None] * at.covariance * slope)


def few(model: ForwardModel) -> bool:
    """Return whether so little was measured that its noise, which is not stated, cannot be estimated: then no
    interval can.
    """
    return model.rows.noise is None and len(model.rows.time) < len(model.names) + _FEWEST


def possible(model: ForwardModel, values: dict[str, Value]) -> dict[str, Value]:
    """Parameters; those whose intervals reach values that cannot be, such as a mass below zero, are not known."""
    point = model.parameters.to_vector(np.array([values[name].value for name in model.names]))
    determined = {name: _possible(model, k, point, values[name]) for k, name in enumerate(model.names)}
    return {
        name: replace(value, identifiable=value.identifiable and determined[name]) for name, value in values.items()
    }


def _possible(model: ForwardModel, k: int, point: Array, known: Value) -> bool:
    path = model.parameters.paths[k]
    head, _, name = path.partition(".")
    if head == RESERVED:
        return known.lower > 0.0 or name not in ("clock", "scale")
    return not path or all(_accepted(model, k, point, end) for end in (known.lower, known.upper))


def _accepted(model: ForwardModel, k: int, point: Array, end: float) -> bool:
    """Return whether a parameter may have a value, beside those of the scene, or else with its ties at the answer."""
    if model.accepts(model.parameters.paths[k], end):
        return True
    if not model.problem.ties or (model.parameters.logarithmic[k] and end <= 0.0):
        return False
    values = model.parameters.to_values(point)
    values[k] = end
    recording = list(model.parameters.entries.values())[k].recording
    return model.can_be(model.parameters.to_vector(values), recording)


def _own(model: ForwardModel, text: str) -> bool:
    """Return whether an expression has a value for each recording."""
    keys = {entry.key for entry in model.parameters.entries.values() if entry.recording is not None}
    return bool(expression.names(text) & keys)


def _value(
    value: float, about: Spread, identifiable: bool, shift: tuple[float | None, float | None], at_bound: bool
) -> Value:
    mesh, theory = shift
    half = about.half + abs(mesh or 0.0) + abs(theory or 0.0)
    return Value(value, about.std, value - half, value + half, bool(identifiable), mesh, at_bound, theory=theory)
