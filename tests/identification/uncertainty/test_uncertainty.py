"""Intervals: noise that remembers, stated noise, priors, and how often the truth is inside."""

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import differentiate as differences
from shoal.identification.uncertainty.covariance import Block, Noise, blocks_of, correlate, estimate_noise
from shoal.identification.uncertainty.linearisation import linearise, quantile, spread
from shoal_validation.coverage.__main__ import measure
from shoal_validation.coverage.cases import cases


def ar1(count: int, rho: float, seed: int) -> np.ndarray:
    draws = np.random.default_rng(seed).standard_normal(count)
    series = [draws[0]]
    for draw in draws[1:]:
        series.append(rho * series[-1] + np.sqrt(1 - rho**2) * draw)
    return np.array(series)


def test_correlation_in_two_passes_is_the_matrix() -> None:
    """The recursions against the dense matrix, on irregular times."""
    times = np.cumsum(np.random.default_rng(0).uniform(0.2, 3.0, 30))
    columns = np.random.default_rng(1).standard_normal((30, 2))
    dense = 0.8 ** np.abs(times[:, None] - times)
    assert np.allclose(correlate(Block(np.arange(30), np.diff(times)), 0.8, columns), dense @ columns)


def test_noise_is_found_behind_a_fit_that_follows_it() -> None:
    """Size and correlation are unbiased although ten smooth functions were fitted to the noise."""
    count, rho = 300, 0.8
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, count), 9))
    block = Block(np.arange(count), np.ones(count - 1))
    found = []
    for seed in range(40):
        noise = ar1(count, rho, seed)
        found.append(estimate_noise(noise - basis @ (basis.T @ noise), basis, [block])[0])
    assert np.mean([seen.rho for seen in found]) == pytest.approx(rho, abs=0.02)
    assert np.mean([seen.variance for seen in found]) == pytest.approx(1.0, abs=0.12)


@pytest.mark.slow
def test_mean_of_correlated_noise_has_the_uncertainty_it_scatters_with() -> None:
    count, rho = 400, 0.9
    block = Block(np.arange(count), np.ones(count - 1))
    means, stds, inside = [], [], 0
    for seed in range(200):
        noise = ar1(count, rho, seed)
        at = linearise(np.ones((count, 1)), noise - noise.mean(), np.ones(1), [block])
        known = spread(lambda p: float(p[0]), np.array([0.0]), at)
        means.append(noise.mean())
        stds.append(known.std)
        inside += abs(noise.mean()) <= known.half
    assert np.mean(stds) == pytest.approx(np.std(means), rel=0.15)
    assert 0.92 <= inside / 200 <= 0.985


def test_stated_noise_is_the_least_that_is_believed() -> None:
    jacobian, residual = np.ones((50, 1)), 1e-3 * ar1(50, 0.0, 3)
    free = linearise(jacobian, residual, np.ones(1), [Block(np.arange(50), np.ones(49))])
    stated = linearise(jacobian, residual, np.ones(1), [Block(np.arange(50), np.ones(49), stated=1.0)])
    assert stated.covariance[0, 0] == pytest.approx(1.0 / 50, rel=0.3)
    assert free.covariance[0, 0] < 1e-4 * stated.covariance[0, 0]


def test_student_quantile() -> None:
    """Known quantiles: ten degrees of freedom give 2.228, two equal shares of five give ten."""
    assert quantile(np.array([1.0]), (Noise(1.0, 0.0, 10.0),)) == pytest.approx(2.228, abs=1e-3)
    assert quantile(np.array([1.0, 1.0]), (Noise(1.0, 0.0, 5.0),) * 2) == pytest.approx(2.228, abs=1e-3)
    assert quantile(np.array([1.0]), (Noise(1.0, 0.0, np.inf),)) == pytest.approx(1.960, abs=1e-3)


def test_a_prior_is_information() -> None:
    """A mass that the swing of one rod does not show is known as well as its prior says."""
    data = {
        "name": "prior",
        "scene": "single-pendulum",
        "parameters": {
            "m": {
                "path": "bodies.OA.mass",
                "lower": 0.1,
                "upper": 10.0,
                "scale": "linear",
                "prior": {"mean": 1.0, "std": 0.02},
            },
        },
        "channels": [{"marker": "A", "quantity": "x", "column": "x"}],
        "noise": 1e-3,
        "source": {"kind": "file"},
    }
    problem = Problem.parse(data, "prior")
    times, point = np.linspace(0.01, 0.5, 50), np.array([1.0])
    noisy = np.cos(times)[:, None] + 1e-3 * np.random.default_rng(0).standard_normal((50, 1))
    measurement = Measurement.single(times, tuple(problem.channels), noisy, "", noise=1e-3)
    model = ForwardModel(problem, problem.load_scene(), get_engine("gauss"), measurement)
    residual, jacobian = differences(model, point)
    at = linearise(jacobian, residual, model.sizes(point), blocks_of(model, len(residual)))
    known = spread(lambda p: float(p[0]), point, at)
    assert known.fixed
    assert known.std == pytest.approx(0.02, rel=0.02)
    assert known.half == pytest.approx(1.96 * known.std, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("case", cases(), ids=lambda case: case.name)
def test_intervals_contain_the_truth_as_often_as_they_say(case) -> None:  # type: ignore[no-untyped-def]
    """200 refits of data by scipy: 92 to 98 % of the 95 % intervals; the plain ones of correlated noise are no such."""
    counts = measure(case, 200)
    for count in counts:
        assert 0.92 <= count.covered <= 0.985, count
    if case.rho:
        assert min(count.naive for count in counts) < 0.6


@pytest.mark.parametrize("count", [4, 8, 16, 60])
@pytest.mark.by_day(2)
def test_a_stated_noise_is_taken_at_its_word_by_few_samples(count: int) -> None:
    """Intervals of a straight line, as wide as its closed form says but for what little memory chance shows."""
    times, seeds = np.linspace(-1.0, 1.0, count), 200
    lines = np.column_stack([np.ones(count), times])
    exact = 1.96 * np.sqrt(np.diag(np.linalg.inv(lines.T @ lines)))
    off = []
    for seed in range(seeds):
        noise = np.random.default_rng(seed).standard_normal(count)
        shift = np.linalg.lstsq(lines, noise)[0]
        at = linearise(lines, noise - lines @ shift, np.ones(2), [Block(np.arange(count), np.ones(count - 1), 1.0)])
        half = np.array([spread(lambda p, k=k: float(p[k]), shift, at).half for k in range(2)])  # type: ignore[misc]
        assert np.all(half > 0.999 * exact)
        off.append(shift / half)
    assert np.mean(np.abs(off) <= 1.0) >= 0.94
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(0.5, abs=0.08)


def test_residuals_that_chance_does_not_make_of_a_stated_noise_tell_their_own() -> None:
    count = 40
    noise = np.random.default_rng(1).standard_normal(count)
    block = Block(np.arange(count), np.ones(count - 1), 0.5)
    found = estimate_noise(noise, np.zeros((count, 1)), [block])[0]
    assert found.variance == pytest.approx(np.mean(noise**2), rel=0.1)
    assert found.freedom < count
