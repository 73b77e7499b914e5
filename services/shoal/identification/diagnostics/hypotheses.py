"""F-tests of nested models: whether the data contradict something that was taken as known.

A hypothesis frees something stated (a mass, a clock, the place of a pivot), reads the data otherwise (units, exchanged
columns) or leaves samples out (a recording, a stretch of a marker). The effect of what is freed on the residual, made
orthogonal to what the sought parameters follow, gives to first order the drop of chi-square if it is freed (score test:
Rao 1948); a fit with it freed gives the drop itself. Samples that are left out are as many freed numbers (Chow,
Econometrica 28, 1960). Without a fault the drop over its freedom is F-distributed. The noise is the one that the freed
model leaves: what explains a misfit only in part leaves a slow residual of few independent samples, so that no drop of
it is significant. One Jacobian serves all score tests, and all are tested together: many effects are alike, so that the
number of independent tests is the one that their correlations leave (Li and Ji, Heredity 95, 2005).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from shoal.identification.conventions import DIFFERENCE, DOUBT, ROUND_OFF
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.chances import above_f, chi_square_above
from shoal.identification.uncertainty.covariance import Block, Noise, blocks_of, correlate, estimate_noise
from shoal.identification.uncertainty.linearisation import followed
from shoal.identification.uncertainty.uncertain_inputs import Given
from shoal.trajectory import Array

Mask = npt.NDArray[np.bool_]

SAMPLES = ("recording", "stretch")
"""Kinds of hypotheses that leave samples out: the data contradict each other, and not what is stated."""


_MOST = 0.75
"""Of the mean square of a residual: a fit that lowers it by so much names what a misfit is mainly due to, although what
remains is not noise."""


@dataclass(frozen=True)
class Hypothesis:
    """A row of the table: something taken as known that may be wrong.

    name, kind: those of the suspect it may become; numbers: how many are freed with it, or are left out
    Another minimum is a row as well, of kind `minimum`, that frees nothing.
    drop: of chi-square, in units of the variance of the noise, correlated as it is
    chance: p-value of the drop, by F; corrected: for all rows of the table
    explained: share of the mean square of the residual that goes with it
    fitted: whether by a fit, else to first order
    """

    name: str
    kind: str
    numbers: int
    drop: float
    chance: float
    corrected: float
    explained: float
    fitted: bool = False

    @property
    def significant(self) -> bool:
        """Return whether the data contradict what was taken as known."""
        return self.corrected < DOUBT

    @property
    def explains(self) -> bool:
        """Return whether a fit shows that this is what the residual is due to.

        Any samples that are left out take their share of the residual with them: only the test decides about these.
        """
        return self.fitted and (self.significant or (self.explained >= _MOST and self.kind not in SAMPLES))


@dataclass(frozen=True, eq=False)
class ScoreTest:
    """Score test at an answer, by its rows.

    residual: (rows,), that of a finer mesh and a fuller theory where these are known; basis: orthonormal columns (rows,
    k) of what the sought parameters follow; blocks, noise: the series of the residuals; given: what is taken as known
    with an uncertainty of its own; stated: whether the size of the noise is stated
    rows: which rows have derivatives that can be believed, (rows,)
    """

    residual: Array
    basis: Array
    blocks: list[Block]
    noise: Sequence[Noise]
    given: Sequence[Given]
    stated: bool
    rows: Mask

    @classmethod
    def of(cls, model: ForwardModel, residual: Array, jacobian: Array) -> ScoreTest:
        """Return that at an answer whose model is without error, by its residual and Jacobian (rows, parameters)."""
        basis, blocks = followed(jacobian)[0], blocks_of(model, len(residual))
        noise, stated = estimate_noise(residual, basis, blocks), model.rows.noise is not None
        return cls(residual, basis, blocks, noise, [], stated, np.ones(len(residual), dtype=bool))

    def fit(
        self, after: Array, jacobian: Array, numbers: int, others: list[Block] | None = None
    ) -> tuple[float, float, float]:
        """Return the drop of chi-square by a fit, its p-value, and the share of the mean square.

        after: its residual (rows,), less what was taken out of `residual`; jacobian: (rows, parameters) there
        numbers: how many it frees; others: its blocks where it reads the data otherwise
        The memory of the noise counts along the difference of the residuals, or, of other data, along the residual.
        """
        noise = estimate_noise(after, followed(jacobian)[0], others or self.blocks)
        before = self.residual * self.rows
        after = after * (self.rows if others is None else np.sqrt(len(before) / len(after)))
        power, gain = float(before @ before), float(before @ before - after @ after)
        along = before - after if others is None else before
        if not gain > 0.0:
            return 0.0, 1.0, 0.0
        drop, chance = self._f_test(np.array([np.sqrt(gain)]), (along / np.linalg.norm(along))[None], noise, numbers)
        return drop, chance, gain / power

    def without(self, rows: Mask) -> tuple[float, float, float]:
        """Return what `left_out` does, to first order in the parameters."""
        basis = self.basis * ~rows[:, None]
        rest = np.where(rows, 0.0, self.residual)
        return self.left_out(rest - basis @ np.linalg.lstsq(basis, rest)[0], basis, rows)

    def left_out(self, after: Array, jacobian: Array, rows: Mask) -> tuple[float, float, float]:
        """Return the drop of chi-square by leaving rows out, its p-value, and the share of the mean square.

        after: residual of the fit to the rest, zero elsewhere, (rows,); jacobian: (rows, parameters) there
        rows: which are left out, (rows,). The mean square of what they add, over that of the rest, is F-distributed
        with as many samples as the memory of the noise leaves independent for a variance (Bartlett 1935).
        """
        after, before = after * self.rows, self.residual * self.rows
        kept = [block for one in self.blocks if len((block := _part(one, ~rows)).rows) and not block.known]
        noise = estimate_noise(after, followed(jacobian)[0], kept)
        counts = np.array([len(block.rows) for block in kept])
        power, gain = float(before @ before), float(before @ before - after @ after)
        number = int(np.sum(rows & self.rows))
        if not (gain > 0.0 and number and len(kept)):
            return 0.0, 1.0, 0.0
        variance = max(float(counts @ [one.variance for one in noise]) / counts.sum(), 1e-300)
        shares = np.array([(1.0 - one.rho**2) / (1.0 + one.rho**2) for one in noise])
        independent = float(counts @ shares)
        freedom = max(1.0, independent - jacobian.shape[1])
        drop, numbers = gain / variance, max(1.0, number * independent / counts.sum())
        return drop, above_f(numbers, freedom, drop / number), gain / power

    def score(self, effects: Array) -> tuple[float, float, float, Array]:
        """Return the drop of chi-square, its p-value, the share of the mean square, and the unit effect (rows,).

        effects: of the numbers that are freed together, (numbers, rows). A noise that is estimated holds the fault, if
        there is one: it is estimated again with the fault taken out.
        """
        size = np.linalg.norm(effects, axis=1)
        scaled = self._own(effects / np.where(size > 0.0, size, 1.0)[:, None])
        left, singular, _ = np.linalg.svd(scaled.T, full_matrices=False)
        own = left[:, singular > DIFFERENCE].T
        if not len(own):
            return 0.0, 1.0, 0.0, np.zeros(effects.shape[1])
        if self.stated:
            return self._test(own, self.noise)
        rest = self._own(self.residual)
        basis = np.column_stack([self.basis, own.T])
        return self._test(own, estimate_noise(rest - (rest @ own.T) @ own, basis, self.blocks))

    def _test(self, own: Array, noise: Sequence[Noise]) -> tuple[float, float, float, Array]:
        """The same of orthonormal effects beyond what the parameters follow, (numbers, rows), and a noise."""
        slope = own @ self._own(self.residual)
        drop, chance = self._f_test(slope, own, noise, len(own))
        power = float(np.sum(self._own(self.residual) ** 2))
        explained = min(1.0, float(slope @ slope) / max(power, 1e-300))
        along = slope @ own
        return drop, chance, explained, along / max(float(np.linalg.norm(along)), 1e-300)

    def _f_test(self, slope: Array, own: Array, noise: Sequence[Noise], numbers: int) -> tuple[float, float]:
        """Return the drop by slopes (n,) along orthonormal rows (n, rows) in a noise, and its p-value.

        The freedom of a sum of variances is that of Satterthwaite (1946).
        """
        shares = self._shares(own, noise)
        weights = np.linalg.lstsq(np.sum(shares, axis=0), slope)[0]
        drop = float(slope @ weights)
        parts = np.einsum("i,bij,j->b", weights, shares, weights)
        freedom = [*(seen.freedom for seen in noise), *(one.freedom for one in self.given)]
        total = max(float(np.sum(parts)), 1e-300)
        doubt = sum((part / total) ** 2 / free for part, free in zip(parts, freedom, strict=True))
        return drop, above_f(numbers, 1.0 / max(doubt, 1e-9), drop / numbers)

    def _own(self, effects: Array) -> Array:
        """Effects (..., rows) beyond what the sought parameters follow, zero where no derivative is believed."""
        kept = effects * self.rows
        return np.asarray(kept - kept @ self.basis @ self.basis.T)

    def _shares(self, own: Array, noise: Sequence[Noise]) -> Array:
        """Shares of the blocks of noise, and of what is given, in the covariance of the slopes, (shares, n, n)."""
        found = []
        for block, seen in zip(self.blocks, noise, strict=True):
            part = own[:, block.rows].T
            found.append(seen.variance * part.T @ correlate(block, seen.rho, part))
        for one in self.given:
            part = own @ one.moved.T
            found.append(part @ part.T)
        return np.array(found)


def _part(block: Block, kept: Mask) -> Block:
    """Return the rows of a block that are kept, (rows,)."""
    mine = kept[block.rows]
    positions = np.concatenate([[0.0], np.cumsum(block.gaps)])[mine]
    return replace(block, rows=block.rows[mine], gaps=np.diff(positions))


Effects = Mapping[tuple[str, str, int], Sequence[Array]]
"""By name, kind and how many numbers are freed: the effects (effects, rows) by each way to measure them."""


LeftOutRows = Mapping[tuple[str, str], Mask]
"""By name and kind: the rows (rows,) that are left out."""


def table(
    test: ScoreTest, effects: Effects, left_out: LeftOutRows = MappingProxyType({})
) -> tuple[list[Hypothesis], float]:
    """Return the hypotheses by their effects, the most significant first, and how many independent tests they are.

    left_out: samples that are. Of several ways to measure an effect the best counts.
    """
    scored, units = list[tuple[tuple[str, str, int], tuple[float, float, float]]](), list[Array]()
    for key, ways in effects.items():
        found = [test.score(way) for way in ways if np.all(np.isfinite(way))]
        found = [one for one in found if np.any(one[3])]
        if found:
            units += [unit for *_, unit in found]
            scored.append((key, min(found, key=lambda one: one[1])[:3]))
    scored += [((*key, int(np.sum(rows))), test.without(rows)) for key, rows in left_out.items()]
    tests = (independent(np.array(units)) if units else 1.0) + len(left_out)
    rows = [Hypothesis(*key, drop, p, min(1.0, tests * p), share) for key, (drop, p, share) in scored]
    return sorted(rows, key=lambda row: (row.chance, row.name)), tests


def independent(units: Array) -> float:
    """Effective number of independent tests along unit effects (tests, rows) (Li and Ji 2005)."""
    values = np.abs(np.linalg.eigvalsh(units @ units.T))
    values = np.where(values < ROUND_OFF * len(units), 0.0, values + ROUND_OFF)
    return float(np.sum((values >= 1.0) + (values - np.floor(values))))


@dataclass(frozen=True)
class Suspect:
    """Something taken as known, the value it was given, the fitted one, and the misfit (RMS) with either.

    change: the two values in words; unit: of the misfits, empty where channels of different units are taken together
    kind: `measurement`, `machine`, `data` (another reading of the recorded numbers) or `bounds` (of a sought parameter)
    numbers: how many were fitted beyond the sought parameters
    chance: p-value of what it explains, corrected for all hypotheses that were tested
    alike: other candidates of which a small fault has the same effect on these channels
    """

    name: str
    stated: float
    value: float
    before: float
    after: float
    change: str
    unit: str = ""
    kind: str = "measurement"
    numbers: int = 1
    chance: float = 1.0
    alike: tuple[str, ...] = ()

    @property
    def significant(self) -> bool:
        """Return whether the data contradict what was taken as known."""
        return self.chance < DOUBT

    @property
    def words(self) -> str:
        """Its name as a sentence has it."""
        return f"offset in {self.name}" if self.name.split()[0] in ("x", "y") and self.kind != "data" else self.name

    def __str__(self) -> str:
        """In words, as a message names it."""
        misfit = f"the misfit from {self.before:.2g} to {self.after:.2g} {self.unit}".rstrip()
        return f"the {self.words}: {self.change} would lower {misfit}"

    def cost(self, rows: int) -> float:
        """Squared misfit, penalised for further numbers, which fit by chance, by Schwarz's criterion over the rows."""
        return self.after**2 * penalty(self.numbers, rows)

    def equals(self, best: Suspect, rows: int) -> bool:
        """Return whether `rows` rows do not distinguish it from the best one, which has no more numbers: alike within
        chance.
        """
        alike = self.after**2 <= best.after**2 * max(1.0 + chi_square_above(1.0, DOUBT) / rows, 1.02)
        return alike and self.numbers <= best.numbers


def penalty(numbers: int, rows: int) -> float:
    """A factor on a mean square, for numbers beyond the first that were fitted to `rows` rows (Schwarz 1978)."""
    return float(rows ** ((numbers - 1) / rows))
