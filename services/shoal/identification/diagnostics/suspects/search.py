"""Search for fault hypotheses: which of the things taken as known would explain a misfit.

A wrong clock or an omitted mass is a fault that no fit of the parameters shows. Each candidate is freed in turn and the
residual is regressed on its effect, the parameters following; the most promising are then fitted together with the
parameters, until one leaves no more than noise. A misfit that is a good part of the signal may also come from another
reading of the numbers. Where nothing explains it, values of each candidate are tried over its whole range, and samples
that contradict the rest are looked for. All that is scored or fitted is a row of the table of hypotheses, and one
F-test decides about all of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from shoal.identification.conventions import DIFFERENCE, GROSS, MOSTLY, SEVERAL
from shoal.identification.deadline import TimeIsUp
from shoal.identification.diagnostics.hypotheses import SAMPLES, Effects, Hypothesis, ScoreTest, Suspect, penalty, table
from shoal.identification.diagnostics.suspects.candidate import FaultHypothesis, Together, groups_of
from shoal.identification.diagnostics.suspects.of_bounds import at_bound, describe_bound, without_bounds
from shoal.identification.diagnostics.suspects.of_machine import of_machine
from shoal.identification.diagnostics.suspects.of_recordings import Reading, misfit, of_data, of_measurement
from shoal.identification.diagnostics.suspects.of_samples import LeftOut, recordings, stretches
from shoal.identification.diagnostics.suspects.other_mechanisms import bending, shaken
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import DESCENTS, FEW, Descent, descend_many
from shoal.identification.methods.outcome import lowers
from shoal.identification.methods.starts import starting_points
from shoal.identification.recording.units import of_channels
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.intervals import Refit
from shoal.identification.uncertainty.linearisation import followed
from shoal.trajectory import Array

_DEAR = 2
"""Fitted at most of a kind that takes long to simulate; its scores are those of many values, and can be trusted."""
_READ = 6
"""Readings that are fitted, at most."""
_HOPELESS = 0.98
"""Of the present misfit: a promise of no less is not followed."""
_SHARES = np.array([1.0, 0.5, 0.2, 0.05, 0.0])
"""Of the change that the regression promises, from the best of which a fit starts."""
_SCAN = 11
"""Values over the bounds of a candidate: a tenth of the range apart."""
_ALIKE = 0.999
"""Cosine of two effects beyond what the parameters follow: from here on small faults are not distinguished."""
_PATIENCE = 10.0
"""As PATIENCE, of a descent beside the search: a side question is given up earlier."""
_WHOLLY = 1.1
"""Times the noise: what leaves no more explains a misfit wholly."""


@dataclass(frozen=True)
class FaultSearch:
    """The suspects, those that explain most first, and by name and kind the fits of those that free numbers.

    better: a minimum of the model itself that fits better, if met; cut: whether time was up before all were tried
    hypotheses: the score tests, the most significant first; effects: by which they were scored
    """

    suspects: list[Suspect] = field(default_factory=list)
    refits: dict[tuple[str, str], Refit] = field(default_factory=dict)
    better: Descent | None = None
    cut: bool = False
    hypotheses: list[Hypothesis] = field(default_factory=list)
    effects: Effects = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Scored:
    """A candidate of a group, where to fit it from, and the misfit over the present one that this promises.

    effect: the unit vector of its effect beyond what the parameters follow, (rows,); empty after a scan
    """

    together: Together
    number: int
    promise: float
    starts: Array
    effect: Array

    @property
    def candidate(self) -> FaultHypothesis:
        return self.together.group[self.number]


def suspects(
    model: ForwardModel,
    point: Array,
    residual: Array,
    jacobian: Array,
    noise: float = 0.0,
    *,
    test: ScoreTest | None = None,
    misfit: bool = True,
) -> FaultSearch:
    """Return what explains the residual at an answer, the best first. Runs are not counted.

    noise: what no explanation can go below [RMS]; test: of the hypotheses, that of a model without error by default
    misfit: whether the residual is more than noise; else only what a score test finds is fitted
    Past the model's deadline it ends with what was found until then.
    """
    search = _FaultSearch(model, point, residual, jacobian, noise, test or ScoreTest.of(model, residual, jacobian))
    cut = True
    with suppress(TimeIsUp):
        search.run(misfit)
        cut = False
    rows = len(residual)
    # Clock and gravity explain a free swing equally well: the order of equals is that of their names.
    reported = (suspect for suspect in search.found if suspect.after < MOSTLY * model.rows.signal)
    found = sorted(reported, key=lambda s: (float(f"{s.cost(rows):.2e}"), s.name))
    listed = [suspect for suspect in found if suspect.cost(rows) <= SEVERAL**2 * found[0].cost(rows)]
    refits = {(s.name, s.kind): search.refits[s.name, s.kind] for s in listed if (s.name, s.kind) in search.refits}
    named = [replace(s, alike=search.alike(s.name)) for s in listed]
    return FaultSearch(named, refits, search.better, cut, search.hypotheses, search.measured)


class _FaultSearch:
    """One search, whose finds stay when its time is up."""

    def __init__(
        self, model: ForwardModel, point: Array, residual: Array, jacobian: Array, noise: float, test: ScoreTest
    ) -> None:
        self.model = model.aside()
        self.point, self.residual, self.noise, self.test = point, residual, noise, test
        self.before = misfit(residual)
        self.scored: list[Hypothesis] = []
        self.fits: dict[tuple[str, str], tuple[Suspect, Hypothesis]] = {}
        self.tests = 1.0
        self.basis, self.inverse = followed(jacobian)
        self.refits: dict[tuple[str, str], Refit] = {}
        self.effects: dict[str, Array] = {}
        self.measured: dict[tuple[str, str, int], list[Array]] = {}
        self.ends: list[tuple[float, Array]] = []
        self.unfinished: list[tuple[float, FaultHypothesis, Array]] = []
        self.better: Descent | None = None

    @property
    def hypotheses(self) -> list[Hypothesis]:
        """The table: of each hypothesis its fit if there was one, else its score test; the most significant first."""
        rows = [row for row in self.scored if (row.name, row.kind) not in self.fits]
        return sorted([*rows, *(row for _, row in self.fits.values())], key=lambda row: (row.chance, row.name))

    def run(self, misfit: bool) -> None:
        """Test all candidates; where one is significant, or there is a misfit, fit what promises to explain it.

        Candidates near the answer, other readings, those that take long, those far from it; then whether a better
        minimum was met.
        """
        simple, whole = [*of_measurement(self.model), *of_machine(self.model)], [*recordings(self.model)]
        scored = self._promising(simple)
        self.scored, self.tests = table(self.test, self.measured, {(one.name, one.kind): one.rows for one in whole})
        significant = {(row.name, row.kind) for row in self.scored if row.significant}
        if not misfit and all(kind in SAMPLES for _, kind in significant):
            return
        self._free_bounds()
        if self._explained:
            return
        self._try([s for s in scored if s.promise < _HOPELESS or (s.candidate.name, s.candidate.kind) in significant])
        gross = GROSS * self.model.rows.signal
        if self.before > gross > 0.0:
            self._read()
        if self.model.scene.dimensions == 2 and not self._explained:
            for dear in ([*shaken(self.model)], [*bending(self.model)]):
                self.tests += sum(len(candidate.probes) for candidate in dear)
                better = [s for s in self._promising(dear) if s.promise * self.before < self._least]
                self._fit(self._near(better)[:_DEAR])
        # What lies near an answer that leaves little shows in the regression.
        if self._least > gross and not self._explained:
            places = np.vstack([self.point, starting_points(self.model)[:FEW]])
            scans = [s for group in self._groups(simple) for s in self._scanned(group, places)]
            self._fit(sorted(scans, key=lambda s: s.promise)[:FEW])
        if not self._explained:
            self._follow()
        self._leave_out([one for one in whole if (one.name, one.kind) in significant])
        freed = [suspect.after for suspect in self.found if suspect.kind not in SAMPLES]
        if min([self.before, *freed]) > _WHOLLY * self.noise:
            self._leave_out(stretches(self.model, self.point))
        self._look_back()

    def _groups(self, candidates: list[FaultHypothesis]) -> list[Together]:
        """The candidates that are not sought themselves, those of one machine together."""
        sought = {*self.model.parameters.paths, *self.model.problem.ties}
        return [Together(self.model, group) for group in groups_of(c for c in candidates if not c.paths & sought)]

    def _try(self, scored: list[_Scored]) -> None:
        """Fit the most promising, then the next ones, until one explains the misfit wholly."""
        # A small fault does what its derivative says, a large one may do better.
        scored = scored if self.before > GROSS * self.model.rows.signal else self._near(scored)
        for k in range(0, len(scored), DESCENTS):
            self._fit(scored[k : k + DESCENTS])
            if self._explained:
                break

    def _promising(self, candidates: list[FaultHypothesis]) -> list[_Scored]:
        """Those that promise something, the best first."""
        return sorted((s for group in self._groups(candidates) for s in self._scored(group)), key=lambda s: s.promise)

    def _near(self, scored: list[_Scored]) -> list[_Scored]:
        """Those that promise little less than the best."""
        return [s for s in scored if s.promise < SEVERAL * scored[0].promise]

    def alike(self, name: str) -> tuple[str, ...]:
        """Candidates whose small faults have the same effect as that of one by name."""
        mine = self.effects.get(name)
        if mine is None:
            return ()
        same = (other for other, effect in self.effects.items() if abs(float(mine @ effect)) > _ALIKE)
        return tuple(other for other in same if other != name)

    @property
    def found(self) -> list[Suspect]:
        """The fits that explain the residual."""
        return [suspect for suspect, row in self.fits.values() if row.explains]

    @property
    def _least(self) -> float:
        """The misfit of the best explanation."""
        return min([self.before, *(suspect.after for suspect in self.found)])

    @property
    def _explained(self) -> bool:
        """Return whether the best explanation leaves no more than noise, of what was so large that another would
        not.
        """
        return self._least <= _WHOLLY * self.noise and self.before > SEVERAL * self.noise

    def _scored(self, together: Together) -> list[_Scored]:
        """The regressions of the residual on the effects of candidates of one machine, by one call."""
        owners, points = list[int](), list[Array]()
        for k, candidate in enumerate(together.group):
            for probe in candidate.probes.reshape(-1, len(candidate.parameters)):
                owners.append(k)
                points.append(np.append(self.point, candidate.vector(probe)))
        seen = together.residuals(owners, points) - self.residual
        found = []
        for k, candidate in enumerate(together.group):
            effects = seen[np.array(owners) == k].reshape(*candidate.probes.shape[:2], -1)
            self.measured[candidate.name, candidate.kind, len(candidate.parameters)] = list(effects)
            ways = [self._score(together, k, way, effect) for way, effect in enumerate(effects)]
            known = [way for way in ways if way is not None]
            if known:
                found.append(best := min(known, key=lambda s: s.promise))
                self.effects[candidate.name] = best.effect
        return found

    def _score(self, together: Together, number: int, way: int, effects: Array) -> _Scored | None:
        """Score one way to measure a candidate's effects, (effects, rows)."""
        if not np.all(np.isfinite(effects)):
            return None
        candidate = together.group[number]
        own = effects - effects @ self.basis @ self.basis.T
        if np.linalg.norm(own) <= DIFFERENCE * np.linalg.norm(effects):
            return None
        left = self.residual - self.basis @ (self.basis.T @ self.residual)
        wanted = np.asarray(np.linalg.lstsq(own.T, -left)[0], dtype=float)
        amounts = candidate.amounts(way, candidate.at(way, wanted))
        smaller = float(np.linalg.norm(left + amounts @ own)) / float(np.linalg.norm(self.residual))
        starts = []
        for share in _SHARES if candidate.law != "inverse" else (1.0,):
            amount = share * amounts
            shifted = self.point - self.inverse @ (self.residual + amount @ effects)
            shifted = np.clip(shifted if share else self.point, self.model.lower, self.model.upper)
            starts.append(np.append(shifted, candidate.vector(candidate.at(way, amount))))
        promise = smaller * float(np.sqrt(penalty(len(candidate.parameters), len(left))))
        along = amounts @ own
        return _Scored(together, number, promise, np.array(starts), along / max(float(np.linalg.norm(along)), 1e-300))

    def _scanned(self, together: Together, places: Array) -> list[_Scored]:
        """To be fitted from the best of a scan of their values, at each of the places (points, parameters)."""
        found = []
        for k, candidate in enumerate(together.group):
            if len(candidate.parameters) > 1:
                continue
            free = candidate.freed(self.model)
            values = np.linspace(free.lower[-1], free.upper[-1], _SCAN)
            points = np.column_stack([np.repeat(places, len(values), axis=0), np.tile(values, len(places))])
            residuals = free.uncounted(points)
            best = int(np.argmin(free.cost(residuals)))
            promise = misfit(residuals[best]) / self.before
            found.append(_Scored(together, k, promise, points[[best]], np.empty(0)))
        return found

    def _fit(self, scored: list[_Scored]) -> None:
        """Fit candidates with the parameters, and keep those that explain the misfit."""
        for together in dict.fromkeys(entry.together for entry in scored):
            mine = [entry for entry in scored if entry.together is together]
            numbers = [entry.number for entry in mine]
            tried = [(entry.number, start) for entry in mine for start in entry.starts]
            costs = self.model.cost(together.residuals(*zip(*tried, strict=True)))
            ends, starts = np.cumsum([len(entry.starts) for entry in mine]), []
            for entry, end in zip(mine, ends, strict=True):
                starts.append(entry.starts[int(np.argmin(costs[end - len(entry.starts) : end]))])
            for k, end in zip(numbers, together.fit(numbers, starts), strict=True):
                self._keep(together.group[k], end)

    def _free_bounds(self) -> None:
        """Fit without the bounds that the answer stands at: no further number is freed, and nothing else is blamed."""
        which = at_bound(self.model, self.point)
        if not which:
            return
        wider = without_bounds(self.model, which)
        starts = np.vstack([self.point, starting_points(wider)[:FEW]])
        end = min(descend_many(wider, starts, patience=_PATIENCE), key=lambda one: one.fitness)
        for k in [k for k in which if not self.model.lower[k] <= end.point[k] <= self.model.upper[k]]:
            bound, value, change = describe_bound(self.model, self.point, end.point, k)
            self._test(f"bound of {self.model.names[k]}", "bounds", 0, bound, value, change, end)

    def _follow(self) -> None:
        """Descend on where a fit was the best but for what it had still to go."""
        begun = sorted(self.unfinished, key=lambda entry: entry[0])
        for _, candidate, point in [entry for entry in begun if entry[0] <= SEVERAL * self._least][:FEW]:
            self._keep(candidate, *descend_many(candidate.freed(self.model), point[None]))

    def _keep(self, candidate: FaultHypothesis, end: Descent) -> None:
        """Note where a fit ended, and the suspect that it makes if it explains the misfit."""
        known, after = len(self.point), misfit(end.residual)
        free = candidate.freed(self.model)
        values = free.parameters.to_values(end.point)[known:]
        self.ends.append((after, end.point[:known]))
        if not end.converged:
            self.unfinished.append((after, candidate, end.point))
        value, change = candidate.described(values)
        stated = 0.0 if candidate.describe else candidate.stated[0]
        if self._test(candidate.name, candidate.kind, len(values), stated, value, change, end):
            self.refits[candidate.name, candidate.kind] = Refit(free, end.point, end.residual, end.jacobian)

    def _test(
        self,
        name: str,
        kind: str,
        numbers: int,
        stated: float,
        value: float,
        change: str,
        end: Descent,
        read: ForwardModel | None = None,
    ) -> bool:
        """Make a fit a row of the table; return whether it is the best of its name and explains the residual.

        numbers: that it frees, 0 for another reading or a bound; read: the model where it reads the data otherwise
        """
        share = 1.0 if read is None else self.model.rows.signal / read.rows.signal
        residual, jacobian, others = share * end.residual, share * end.jacobian, None
        known = self.fits.get((name, kind))
        if not misfit(residual) < (np.inf if known is None else known[0].after):
            return False
        if read is None:
            residual = residual - (self.residual - self.test.residual)
        else:
            others = blocks_of(read, len(residual))
        tested = self.test.fit(residual, jacobian, max(numbers, 1), others)
        return self._note(
            name, kind, numbers, tested, self.tests, (stated, value, change), misfit(share * end.residual)
        )

    def _note(
        self,
        name: str,
        kind: str,
        numbers: int,
        tested: tuple[float, float, float],
        tests: float,
        change: tuple[float, float, str],
        after: float,
    ) -> bool:
        """Return whether a fit explains the misfit; its row enters the table.

        tested: drop, p-value and share; tests: number of hypotheses looked at; change: stated and other value, words
        """
        drop, chance, explained = tested
        row = Hypothesis(name, kind, numbers, drop, chance, min(1.0, tests * chance), explained, fitted=True)
        stated, value, words = change
        unit = of_channels(self.model.measurement)
        suspect = Suspect(name, stated, value, self.before, after, words, unit, kind, numbers, row.corrected)
        self.fits[name, kind] = suspect, row
        return row.explains

    def _leave_out(self, samples: Iterable[LeftOut]) -> None:
        """Fit the rest of the samples, from where all were fitted and from its own starts."""
        for one in samples:
            starts = np.vstack([one.place(self.model, self.point), starting_points(one.model)[:FEW]])
            end = min(descend_many(one.model, starts, patience=_PATIENCE), key=lambda end: end.fitness)
            if not np.all(np.isfinite(end.residual)):
                continue
            # Rows count as they do beside those that are left out.
            kept = ~one.rows[: len(self.model.rows.weight)]
            weight = np.ones(len(end.residual))
            weight[: int(np.sum(kept))] = self.model.rows.weight[kept] / one.model.rows.weight
            residual = np.zeros(len(self.residual))
            jacobian = np.zeros((len(residual), len(one.model.names)))
            residual[~one.rows], jacobian[~one.rows] = weight * end.residual, weight[:, None] * end.jacobian
            left, count = misfit(residual[~one.rows]), int(np.sum(one.rows))
            change = 0.0, left, f"left out, {'it' if one.kind == 'recording' else 'they'}"
            residual[~one.rows] -= (self.residual - self.test.residual)[~one.rows]
            tested = self.test.left_out(residual, jacobian, one.rows)
            self._note(one.name, one.kind, count, tested, self.tests * one.windows, change, left)

    def _read(self) -> None:
        """Fit the readings that begin best, each from its own starts; misfits count against the spread of the data."""
        begun: list[tuple[float, int, Reading, Array]] = []
        for reading in of_data(self.model):
            if reading.model.rows.signal == 0.0:  # at rest every reading is the same
                continue
            starts = starting_points(reading.model)
            costs = reading.model.cost(reading.model.uncounted(starts))
            begun.append(
                (float(np.min(costs)) / reading.model.rows.signal**2, len(begun), reading, starts[np.argsort(costs)])
            )
        self.tests += len(begun)
        for _, _, reading, starts in sorted(begun, key=lambda entry: entry[:2])[:_READ]:
            ends = descend_many(reading.model, starts[:FEW], patience=_PATIENCE)
            end = min(ends, key=lambda one: misfit(one.residual))
            self._test(reading.name, "data", 0, 1.0, reading.value, reading.change, end, reading.model)

    def _look_back(self) -> None:
        """Return whether the refits met a better minimum: what was freed goes back to its stated value."""
        promising = [end for after, end in sorted(self.ends, key=lambda end: end[0])[:2] if after < self.before]
        if not promising:
            return
        ends = descend_many(self.model, np.array(promising), patience=_PATIENCE)
        best = min(ends, key=lambda end: end.fitness)
        if lowers(self.model, misfit(best.residual) ** 2, self.before**2):
            self.better = best
