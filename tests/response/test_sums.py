"""Probabilities of sums of heavy tails: random sums of lognormal variables against their convolution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest
from scipy import fft, optimize, stats
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.limits.choice import probability
from shoal.response.limits.exceedance import Exceedance
from shoal.response.limits.margins import Margins
from shoal.response.marginals import Normal
from shoal.response.runs import Answers
from shoal.trajectory import Array

CELLS = 2**14


@dataclass(frozen=True)
class Sum:
    """Of lognormal variables with these means and standard deviations of their logarithms, above a bound."""

    means: Array
    deviations: Array
    bound: float

    def exceedance(self) -> float:
        """By repeated convolution of probabilities on cells of equal width, whose middles are added."""
        edges = np.arange(1, CELLS + 1) * self.bound / (CELLS - 0.5 * (len(self.means) - 1))
        below: Array | None = None
        for mean, deviation in zip(self.means, self.deviations, strict=True):
            own = np.diff(stats.norm.cdf((np.log(edges) - mean) / deviation), prepend=0.0)
            if below is None:
                below = own
            else:
                both = fft.irfft(fft.rfft(below, 2 * CELLS) * fft.rfft(own, 2 * CELLS), 2 * CELLS)
                below = np.maximum(both[:CELLS], 0.0)
        assert below is not None
        # Middles of k cells whose numbers add up to i are at i + k / 2, the bound half a cell beyond the last one.
        return float(1 - below[: CELLS - len(self.means) + 1].sum())

    def asked(self, seed: int) -> Exceedance:
        """By `auto`, with values as the parameters and with their logarithms."""
        names = [f"x{k}" for k in range(len(self.means))]
        logarithmic = seed % 2 == 0

        def model(values: Mapping[str, Array]) -> Answers:
            x = np.stack([values[name] for name in names], axis=1)
            total = (x if logarithmic else np.exp(x)).sum(axis=1)
            return Answers(self.bound - total[:, None], np.ones(len(total), dtype=bool))

        known = [
            UncertainParameter(name, Normal(float(mean), float(deviation), logarithmic=logarithmic), {name: 1.0})
            for name, mean, deviation in zip(names, self.means, self.deviations, strict=True)
        ]
        return probability(Margins(model, Inputs(tuple(known)), 5000), "auto", seed)


def drawn(seed: int, most: int = 20) -> tuple[Sum, float]:
    """Four to so many variables, alike or not, and a bound that is passed with 1e-2 to 1e-6."""
    random = np.random.default_rng(seed)
    count, wanted = int(random.integers(4, most + 1)), 10 ** random.uniform(-6, -2)
    alike = random.random(2) < 0.5
    deviations = np.full(count, random.uniform(0.1, 1.2)) if alike[0] else random.uniform(0.1, 1.2, count)
    means = np.zeros(count) if alike[1] else random.normal(0, 0.5, count)
    expected = float(np.log(np.exp(means + deviations**2 / 2).sum()))

    def off(logarithm: float) -> float:
        return float(np.log(max(Sum(means, deviations, float(np.exp(logarithm))).exceedance(), 1e-14) / wanted))

    bound = optimize.brentq(off, expected, expected + 6, xtol=1e-2)
    found = Sum(means, deviations, float(np.exp(bound)))
    return found, found.exceedance()


def test_the_convolution_by_plain_sampling() -> None:
    """Two million values of each sum, and the closed form of a single variable."""
    alone = Sum(np.array([0.3]), np.array([0.8]), 5.0)
    assert alone.exceedance() == pytest.approx(float(stats.norm.sf((np.log(5.0) - 0.3) / 0.8)), rel=1e-3)
    for count in (2, 3):
        of = Sum(np.linspace(0.0, 0.4, count), np.linspace(0.6, 1.1, count), 12.0)
        values = np.exp(of.means + of.deviations * np.random.default_rng(count).standard_normal((2_000_000, count)))
        seen = float(np.mean(values.sum(axis=1) > of.bound))
        assert of.exceedance() == pytest.approx(seen, rel=4 / np.sqrt(seen * 2_000_000))


def test_the_convolution_of_many_variables_by_importance_sampling() -> None:
    """Sixteen that are alike, with normal variables moved to the design point, which is known."""
    count, deviation, bound = 16, 0.2, 20.0
    of = Sum(np.zeros(count), np.full(count, deviation), bound)
    moved = np.log(bound / count) / deviation
    z = np.random.default_rng(0).standard_normal((400_000, count)) + moved
    weights = np.exp(count * moved**2 / 2 - moved * z.sum(axis=1)) * (np.exp(deviation * z).sum(axis=1) > bound)
    error = float(weights.std() / np.sqrt(len(weights)))
    assert error < 0.01 * weights.mean()
    assert of.exceedance() == pytest.approx(float(weights.mean()), abs=4 * error)


@pytest.mark.parametrize("seed", [0, 1, 17])
@pytest.mark.by_day(1)
def test_a_sum_of_heavy_tails(seed: int) -> None:
    of, exact = drawn(seed, 10)
    found = of.asked(seed)
    assert not found.findings
    lower, upper = (float(end[-1]) for end in found.estimate.interval)
    assert lower <= exact <= upper
    assert found.estimate.probability == pytest.approx(exact, rel=0.1)


@pytest.mark.slow
def test_intervals_of_sums_hold_as_often_as_they_say() -> None:
    """At least 93 % of those that are not in doubt, and few of them are."""
    held = doubted = 0
    for seed in range(120):
        of, exact = drawn(100 + seed)
        found = of.asked(seed)
        lower, upper = (float(end[-1]) for end in found.estimate.interval)
        doubted += bool(found.findings)
        held += not found.findings and lower <= exact <= upper
    assert held >= 0.93 * (120 - doubted)
    assert doubted <= 12
