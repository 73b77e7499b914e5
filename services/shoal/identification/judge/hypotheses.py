"""Score tests of nested models (Rao 1948): whether the data contradict something that was taken as known.

Each hypothesis frees something stated: a mass, a clock, the place of a pivot. Its effect on the residual, made
orthogonal to what the sought parameters follow, gives to first order the drop of chi-square if it is freed. Without a
fault the drop over its freedom is F-distributed. One Jacobian serves all hypotheses, and they are tested together: many
of them act alike, so that the number of independent tests is the one that the correlations of their effects leave
(Li and Ji, Heredity 95, 2005).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shoal.identification.spread.chances import above_f
from shoal.identification.spread.covariance import Block, Noise, correlate, estimate_noise
from shoal.identification.spread.given import Given
from shoal.trajectory import Array

SIGNIFICANT = 5e-4
"""P-value over all hypotheses below which the data contradict one: of 2000 right models one is rejected."""

_ROUND_OFF = 1e-9
"""Of the largest eigenvalue of correlations: a smaller one counts as none."""


@dataclass(frozen=True)
class Hypothesis:
    """A row of the table: something taken as known that may be wrong.

    name, kind: those of the suspect it may become; numbers: how many are freed with it
    drop: of chi-square to first order, in units of the variance of the noise, correlated as it is
    chance: p-value of the drop, by F; corrected: for all rows of the table
    explained: share of the mean square of the residual that goes with it, to first order
    """

    name: str
    kind: str
    numbers: int
    drop: float
    chance: float
    corrected: float
    explained: float

    @property
    def significant(self) -> bool:
        """Return whether the data contradict what was taken as known."""
        return self.corrected < SIGNIFICANT


@dataclass(frozen=True, eq=False)
class ScoreTest:
    """What a score test at an answer needs, of its rows.

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
    rows: Array

    def score(self, effects: Array) -> tuple[float, float, float, Array]:
        """Return the drop of chi-square, its p-value, the share of the mean square, and the unit effect (rows,).

        effects: of the numbers that are freed together, (numbers, rows). A noise that is estimated holds the fault, if
        there is one. Where the first p-value is small, it is estimated again with the fault taken out.
        """
        size = np.linalg.norm(effects, axis=1)
        scaled = self._own(effects / np.where(size > 0.0, size, 1.0)[:, None])
        left, singular, _ = np.linalg.svd(scaled.T, full_matrices=False)
        own = left[:, singular > _UNSEEN].T
        if not len(own):
            return 0.0, 1.0, 0.0, np.zeros(effects.shape[1])
        first = self._test(own, self.noise)
        if first[1] > _AGAIN or self.stated:
            return first
        rest = self._own(self.residual)
        basis = np.column_stack([self.basis, own.T])
        return self._test(own, estimate_noise(rest - (rest @ own.T) @ own, basis, self.blocks))

    def _test(self, own: Array, noise: Sequence[Noise]) -> tuple[float, float, float, Array]:
        """The same of orthonormal effects beyond what the parameters follow, (numbers, rows), and a noise."""
        slope = own @ self._own(self.residual)
        shares = self._shares(own, noise)
        weights = np.linalg.lstsq(np.sum(shares, axis=0), slope)[0]
        drop, count = float(slope @ weights), len(own)
        power = float(np.sum(self._own(self.residual) ** 2))
        explained = min(1.0, float(slope @ slope) / max(power, 1e-300))
        parts = np.einsum("i,bij,j->b", weights, shares, weights)
        freedom = [*(seen.freedom for seen in noise), *(one.freedom for one in self.given)]
        total = max(float(np.sum(parts)), 1e-300)
        doubt = sum((part / total) ** 2 / free for part, free in zip(parts, freedom, strict=True))
        along = slope @ own
        chance = above_f(count, 1.0 / max(doubt, 1e-9), drop / count)
        return drop, chance, explained, along / max(float(np.linalg.norm(along)), 1e-300)

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


_AGAIN = 0.01
"""P-value from which down a noise is estimated again."""
_UNSEEN = 1e-6
"""Of an effect: what remains of one that the sought parameters follow wholly, to the accuracy of differences."""

Effects = Mapping[tuple[str, str, int], Sequence[Array]]
"""By name, kind and how many numbers are freed: the effects (effects, rows) by each way to measure them."""


def table(test: ScoreTest, effects: Effects) -> list[Hypothesis]:
    """The hypotheses by their effects, the most significant first. Of several ways to measure one the best counts."""
    scored, units = list[tuple[tuple[str, str, int], tuple[float, float, float]]](), list[Array]()
    for key, ways in effects.items():
        found = [test.score(way) for way in ways if np.all(np.isfinite(way))]
        found = [one for one in found if np.any(one[3])]
        if found:
            units += [unit for *_, unit in found]
            scored.append((key, min(found, key=lambda one: one[1])[:3]))
    tests = independent(np.array(units)) if units else 0.0
    rows = [Hypothesis(*key, drop, p, min(1.0, tests * p), share) for key, (drop, p, share) in scored]
    return sorted(rows, key=lambda row: (row.chance, row.name))


def independent(units: Array) -> float:
    """How many independent tests those along unit effects (tests, rows) are worth (Li and Ji 2005)."""
    values = np.abs(np.linalg.eigvalsh(units @ units.T))
    values = np.where(values < _ROUND_OFF * len(units), 0.0, values + _ROUND_OFF)
    return float(np.sum((values >= 1.0) + (values - np.floor(values))))
