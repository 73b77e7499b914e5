"""Where a model does not fit: which of the things taken as known would explain it.

A wrong clock or an omitted mass is a fault that no fit of the parameters shows. Each candidate is freed in turn and the
residual is regressed on its effect, the parameters following (a score test: Rao 1948); the most promising are then
fitted together with the parameters. A misfit that is a good part of the signal may also come from another reading of
the numbers. Where nothing explains it, values of each candidate are tried over its whole range.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import Descent, descend_many
from shoal.identification.methods.least_squares import descend
from shoal.identification.starts import starting_points
from shoal.identification.suspects.candidate import Candidate, extended, with_parameters
from shoal.identification.suspects.of_data import Reading, misfit, of_data
from shoal.identification.suspects.of_machine import of_machine
from shoal.identification.suspects.of_measurement import of_measurement
from shoal.identification.suspects.suspect import Suspect, explains
from shoal.identification.units import of_channels
from shoal.trajectory import Array

_FITTED = 6
"""Candidates that are fitted, at most; so many readings, and candidates after a scan."""
_AFTER_SCAN = 3
_HOPELESS = 0.98
"""Of the present misfit: a promise of no less is not followed."""
_GROSS = 0.05
"""Of the signal: from this misfit on the numbers may have been read wrongly."""
_SHARES = np.array([1.0, 0.5, 0.2, 0.05, 0.0])
"""Of the change that the regression promises, from the best of which a fit starts."""
_SCAN = 11
_UNSEEN = 1e-6
_BETTER = 0.99
"""Of the misfit: a lower one with nothing changed is that of a better minimum."""
_PATIENCE = 10.0
_CONSTANT = 0.5
"""Of the signal: an explanation that leaves more is none, as a constant leaves hardly more."""
_FAR = 3.0
"""Times the misfit of the best: what leaves more is not listed."""


@dataclass(frozen=True)
class Findings:
    """The suspects, those that explain most first; better: a minimum of the model itself that fits better, if met."""

    suspects: list[Suspect] = field(default_factory=list)
    better: Descent | None = None


@dataclass(frozen=True)
class _Scored:
    """A candidate, where to fit it from, and the misfit over the present one that this promises."""

    candidate: Candidate
    promise: float
    starts: Array


def suspects(model: ForwardModel, point: Array, residual: Array, jacobian: Array, noise: float = 0.0) -> Findings:
    """What explains the residual at an answer, the best first. Runs are not counted.

    noise: what no explanation can go below [RMS]. Past the model's deadline it ends with what was found until then.
    """
    search = _Search(model, point, residual, jacobian, noise)
    with suppress(TimeIsUp):
        search.run()
    # Clock and gravity explain a free swing equally well: the order of equals is that of their names.
    told = (suspect for suspect in search.found if suspect.after < _CONSTANT * model.spread)
    found = sorted(told, key=lambda s: (float(f"{s.after:.2e}"), s.name))
    return Findings([suspect for suspect in found if suspect.after <= _FAR * found[0].after], search.better)


class _Search:
    """One search, whose finds stay when its time is up."""

    def __init__(self, model: ForwardModel, point: Array, residual: Array, jacobian: Array, noise: float) -> None:
        self.model = replace(model, memory=None, whole=None)
        self.point, self.residual, self.noise = point, residual, noise
        self.before = misfit(residual)
        left, singular, right = np.linalg.svd(jacobian, full_matrices=False)
        seen = singular > 1e-8 * max(float(singular[0]), 1e-300)
        self.basis = left[:, seen]
        self.inverse = (right[seen].T / singular[seen]) @ left[:, seen].T
        self.found: list[Suspect] = []
        self.ends: list[tuple[float, Array]] = []
        self.better: Descent | None = None

    def run(self) -> None:
        """Candidates near the answer, other readings, candidates far from it; then whether a better minimum was met."""
        sought = {entry.parameter.path for entry in self.model.parameters.entries.values()}
        sought |= set(self.model.problem.ties)
        candidates = [
            candidate
            for candidate in (*of_measurement(self.model), *of_machine(self.model))
            if candidate.parameter.path not in sought
        ]
        self._fit(self._scored(candidates), _FITTED)
        gross = _GROSS * self.model.spread
        if gross > 0.0 and min([self.before, *(suspect.after for suspect in self.found)]) > gross:
            self._read()
        # What lies near an answer that leaves little shows in the regression.
        if not self.found and self.before > gross:
            places = np.vstack([self.point, starting_points(self.model)[:3]])
            self._fit((self._scanned(c, places) for c in candidates if not c.inverse), _AFTER_SCAN)
        self._look_back()

    def _scored(self, candidates: list[Candidate]) -> Iterable[_Scored]:
        """The regression of the residual on the effect of each: one call for all that the model's own scene has."""
        own = [candidate for candidate in candidates if candidate.scene is None]
        groups = [own, *([candidate] for candidate in candidates if candidate.scene is not None)]
        for group in groups:
            stated = [c.vector(c.probe if c.inverse else c.stated) for c in group]
            points = np.tile(np.append(self.point, stated), (len(group), 1))
            for k, candidate in enumerate(group):
                points[k, len(self.point) + k] = candidate.vector(candidate.probe)
            for candidate, seen in zip(group, with_parameters(self.model, group).uncounted(points), strict=True):
                if np.all(np.isfinite(seen)) and (scored := self._score(candidate, seen - self.residual)):
                    yield scored

    def _score(self, candidate: Candidate, effect: Array) -> _Scored | None:
        own = effect - self.basis @ (self.basis.T @ effect)
        if np.linalg.norm(own) <= _UNSEEN * np.linalg.norm(effect):
            return None
        left = self.residual - self.basis @ (self.basis.T @ self.residual)
        amounts = [candidate.amount(candidate.at(-float(own @ left) / float(own @ own)))]
        promise = float(np.linalg.norm(left + amounts[0] * own)) / float(np.linalg.norm(self.residual))
        starts = []
        for share in _SHARES:
            amount = share * amounts[0]
            shifted = self.point - self.inverse @ (self.residual + amount * effect)
            shifted = np.clip(shifted if share else self.point, self.model.lower, self.model.upper)
            starts.append(extended(shifted, candidate, candidate.at(amount)))
        return _Scored(candidate, promise, np.array(starts))

    def _scanned(self, candidate: Candidate, places: Array) -> _Scored:
        """To be fitted from the best of a scan of its values, at each of the places (points, parameters)."""
        free = candidate.freed(self.model)
        values = np.linspace(free.lower[-1], free.upper[-1], _SCAN)
        points = np.column_stack([np.repeat(places, len(values), axis=0), np.tile(values, len(places))])
        residuals = free.uncounted(points)
        best = int(np.argmin(free.cost(residuals)))
        return _Scored(candidate, misfit(residuals[best]) / self.before, points[[best]])

    def _fit(self, scored: Iterable[_Scored], most: int) -> None:
        """Fit the most promising with the parameters, and keep those that explain the misfit."""
        promising = sorted((s for s in scored if s.promise < _HOPELESS), key=lambda s: s.promise)
        for entry in promising[:most]:
            free = entry.candidate.freed(self.model)
            starts = np.clip(entry.starts, free.lower, free.upper)
            start = starts[int(np.argmin(free.cost(free.uncounted(starts))))]
            end = descend(free, start, lambda *_: None)
            value, after = float(free.parameters.to_values(end.point)[-1]), misfit(end.residual)
            self.ends.append((after, end.point[:-1]))
            candidate = entry.candidate
            if explains(self.before, after, self.noise, len(self.residual)):
                self.found.append(
                    Suspect(
                        candidate.name,
                        candidate.stated,
                        value,
                        self.before,
                        after,
                        candidate.change(value),
                        of_channels(self.model.measurement),
                        candidate.kind,
                    )
                )

    def _read(self) -> None:
        """Fit the readings that begin best, each from its own starts; misfits count against the spread of the data."""
        begun: list[tuple[float, int, Reading, Array]] = []
        for reading in of_data(self.model):
            if reading.model.spread == 0.0:  # at rest every reading is the same
                continue
            starts = starting_points(reading.model)
            costs = reading.model.cost(reading.model.uncounted(starts))
            begun.append(
                (float(np.min(costs)) / reading.model.spread**2, len(begun), reading, starts[np.argsort(costs)])
            )
        for _, _, reading, starts in sorted(begun, key=lambda entry: entry[:2])[:_FITTED]:
            ends = descend_many(reading.model, starts[:3], patience=_PATIENCE)
            after = min(misfit(end.residual) for end in ends) * self.model.spread / reading.model.spread
            if explains(self.before, after, self.noise, len(self.residual)):
                self.found.append(_of_reading(reading, self.before, after, of_channels(self.model.measurement)))

    def _look_back(self) -> None:
        """Whether the refits met a better minimum: what was freed goes back to its stated value."""
        promising = [end for after, end in sorted(self.ends, key=lambda end: end[0])[:2] if after < self.before]
        if not promising:
            return
        ends = descend_many(self.model, np.array(promising), patience=_PATIENCE)
        best = min(ends, key=lambda end: end.fitness)
        if misfit(best.residual) < _BETTER * self.before:
            self.better = best


def _of_reading(reading: Reading, before: float, after: float, unit: str) -> Suspect:
    return Suspect(reading.name, 1.0, reading.value, before, after, reading.change, unit, "data")
