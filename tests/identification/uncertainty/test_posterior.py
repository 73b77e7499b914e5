"""Draws from the posterior against least squares in closed form, and against integrals over a grid."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from shoal.cli import main
from shoal.engines import get_engine
from shoal.identification import Estimate, Measurement, Problem, identify
from shoal.identification.conclude import Options
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import descend
from shoal.identification.uncertainty import posterior as drawing
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import linearise
from shoal.mechanics.findings import NOT_FINITE
from shoal.trajectory import Array

NOISE, GRAVITY = 0.05, -9.81
TIMES = np.arange(1, 41) / 40.0
FALL = """
name: fall
bodies: {P: {kind: point-mass, mass: 1.0}}
joints: {}
markers: {P: {body: P}}
initial: {P: {position: [0.0, 0.0], velocity: [1.0, 0.5]}}
solver: {integrator: rk4, step: 0.025}
"""


def alternating(shape: tuple[int, ...], size: float) -> Array:
    """Noise that is not larger than stated, and whose neighbours are not correlated upwards."""
    sizes = np.random.default_rng(7).uniform(0.4, 1.3, shape)
    signs = np.where(np.arange(shape[0]) % 2, 1.0, -1.0).reshape(-1, *[1] * (len(shape) - 1))
    return np.asarray(size * signs * sizes)


@pytest.fixture
def fall(tmp_path: Path) -> str:
    path = tmp_path / "fall.yaml"
    path.write_text(FALL)
    return str(path)


def thrown(fall: str, noise: float | None = NOISE) -> tuple[Problem, Measurement]:
    """Height of a thrown mass: linear in where it starts, how fast, and gravity."""
    parameters = {
        "height": {"path": "initial.P.position.1", "lower": -2.0, "upper": 2.0},
        "speed": {"path": "initial.P.velocity.1", "lower": -5.0, "upper": 5.0},
        "gravity": {"path": "gravity.1", "lower": -20.0, "upper": 0.0},
    }
    channels = [{"marker": "P", "quantity": "y", "column": "y"}]
    stated = {"name": "thrown", "scene": fall, "parameters": parameters, "channels": channels}
    problem = Problem.parse({**stated, "source": {"kind": "file"}, "noise": noise}, "thrown")
    values = (0.1 + 0.5 * TIMES + GRAVITY * TIMES**2 / 2)[:, None] + alternating((len(TIMES), 1), 0.9 * NOISE)
    return problem, Measurement.single(TIMES, tuple(problem.channels), values, "closed form", noise=noise)


def least_squares(measurement: Measurement) -> tuple[Array, Array, float]:
    """Solution, (X'X)^-1, and the variance of the residual."""
    design = np.column_stack([np.ones_like(TIMES), TIMES, TIMES**2 / 2])
    values = measurement.first.values[:, 0]
    inverse = np.linalg.inv(design.T @ design)
    solution = inverse @ design.T @ values
    return solution, inverse, float(np.sum((values - design @ solution) ** 2)) / (len(TIMES) - 3)


def sampled(problem: Problem, measurement: Measurement, wanted: int = 2000, **how: object) -> Estimate:
    options = Options(sample=wanted)
    return identify(problem, method="least-squares", measurement=measurement, options=options, **how)  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_linear_model_with_stated_noise_has_the_posterior_of_its_closed_form(fall: str) -> None:
    problem, measurement = thrown(fall)
    mean, inverse, _ = least_squares(measurement)
    covariance = NOISE**2 * inverse
    estimate = sampled(problem, measurement)
    found = estimate.posterior
    assert found is not None
    assert found.converged
    stds = np.sqrt(np.diag(covariance))
    for name, expected, std in zip(found.names, mean, stds, strict=True):
        one = found.marginals[name]
        assert one.mean == pytest.approx(expected, abs=0.1 * std)
        assert one.sd == pytest.approx(std, rel=0.07)
        assert one.lower == pytest.approx(expected - 1.96 * std, abs=0.2 * std)
        assert one.upper == pytest.approx(expected + 1.96 * std, abs=0.2 * std)
        interval = estimate.parameters[name]
        assert (one.lower, one.upper) == pytest.approx((interval.lower, interval.upper), abs=0.3 * std)
    assert found.correlations == pytest.approx(covariance / np.outer(stds, stds), abs=0.02)


def test_noise_that_is_not_stated_is_integrated_out(fall: str) -> None:
    """Student's t of the degrees of freedom that are named is wider than the normal distribution by v / (v - 2)."""
    problem, measurement = thrown(fall, None)
    mean, inverse, variance = least_squares(measurement)
    found = sampled(problem, measurement).posterior
    assert found is not None
    freedom = float(found.noise.split("with ")[1].split()[0])
    assert 3 < freedom < len(TIMES) - 3
    stds = np.sqrt(variance * np.diag(inverse) * freedom / (freedom - 2))
    for name, expected, std in zip(found.names, mean, stds, strict=True):
        assert found.marginals[name].mean == pytest.approx(expected, abs=0.1 * std)
        assert found.marginals[name].sd == pytest.approx(std, rel=0.15)


def product(fall: str) -> tuple[Problem, Measurement]:
    """Speeds a and a b of a thrown mass under much noise: the posterior is bent like a banana."""
    parameters = {"a": {"lower": 0.1, "upper": 6.0, "scale": "linear"}, "b": {"lower": -4.0, "upper": 8.0}}
    channels = [{"marker": "P", "quantity": q, "column": q} for q in ("x", "y")]
    problem = Problem.parse(
        {
            "name": "product",
            "scene": fall,
            "parameters": parameters,
            "ties": {"initial.P.velocity.0": "a", "initial.P.velocity.1": "a*b"},
            "channels": channels,
            "source": {"kind": "file"},
            "noise": 1.0,
        },
        "product",
    )
    values = np.column_stack([TIMES, 1.5 * TIMES + GRAVITY * TIMES**2 / 2]) + alternating((len(TIMES), 2), 0.9)
    return problem, Measurement.single(TIMES, tuple(problem.channels), values, "closed form", noise=1.0)


@pytest.mark.slow
def test_a_bent_posterior_is_that_of_an_integral_over_a_grid(fall: str) -> None:
    problem, measurement = product(fall)
    found = sampled(problem, measurement, wanted=1500).posterior
    assert found is not None
    assert found.converged
    a, b = np.linspace(0.1, 6.0, 1201), np.linspace(-4.0, 8.0, 1201)
    x, y = measurement.first.values.T
    y = y - GRAVITY * TIMES**2 / 2
    square, first, second = float(TIMES @ TIMES), float(TIMES @ x), float(TIMES @ y)
    # Sums of squares of x - a t and y - a b t, but for a constant.
    rise = square * (a[:, None] ** 2 * (1 + b**2)) - 2 * a[:, None] * (first + b * second)
    weight = np.exp(-(rise - rise.min()) / 2)
    for name, values, density in (("a", a, weight.sum(axis=1)), ("b", b, weight.sum(axis=0))):
        cumulated = np.cumsum(density) / np.sum(density)
        lower, median, upper = np.interp([0.025, 0.5, 0.975], cumulated, values)
        one = found.marginals[name]
        told = np.array([one.lower, one.median, one.upper])
        chance = np.array([0.025, 0.5, 0.975])
        height = np.interp([lower, median, upper], values, density / np.sum(density)) / (values[1] - values[0])
        scatter = np.sqrt(chance * (1 - chance) / 1500) / height
        assert np.all(np.abs(told - [lower, median, upper]) < 3 * scatter + 1e-3 * (upper - lower))


@pytest.mark.slow
def test_the_same_seed_gives_the_same_draws(fall: str) -> None:
    problem, measurement = thrown(fall)
    one, again, other = (sampled(problem, measurement, 300, seed=seed).posterior for seed in (1, 1, 2))
    assert one is not None
    assert again is not None
    assert other is not None
    assert np.array_equal(one.draws, again.draws)
    assert not np.array_equal(one.draws[:, :10], other.draws[:, :10])
    assert one.to_json()["seed"] == 1


def test_draws_that_were_stopped_do_not_call_themselves_converged(fall: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "_MOST", 1000)
    estimate = sampled(*thrown(fall), wanted=100_000)
    found = estimate.posterior
    assert found is not None
    assert not found.converged
    assert found.to_json()["status"] == "not converged"
    assert "posterior-not-converged" in estimate.codes


@pytest.mark.slow
def test_what_cannot_be_simulated_is_impossible_and_counted(fall: str) -> None:
    """Half of the space fails: no draw is there."""
    problem, measurement = thrown(fall)
    engine = get_engine("gauss")

    class Fails:
        name, capabilities = engine.name, engine.capabilities

        def simulate(self, scene, times=None):  # type: ignore[no-untyped-def]
            return engine.simulate(scene, times)

        def simulate_many(self, scene, values, times=None):  # type: ignore[no-untyped-def]
            found = engine.simulate_many(scene, values, times)
            bad = values["initial.P.velocity.1"] > limit if "initial.P.velocity.1" in values else np.zeros(1, bool)
            return replace(found, lane_findings=[[NOT_FINITE.found("made to")] if one else [] for one in bad])

    solution = least_squares(measurement)[0]
    limit = np.inf
    model = ForwardModel(problem, problem.load_scene(), Fails(), measurement)  # type: ignore[arg-type]
    end = descend(model, solution, lambda *_: None)
    blocks = blocks_of(model, len(end.residual))
    at = linearise(end.jacobian, end.residual, model.sizes(end.point), blocks)
    limit = float(solution[1]) + 1e-9
    found = drawing.posterior(model, end.point, at, blocks, float(end.residual @ end.residual), wanted=200)
    assert found.failed > 0
    assert np.all(found.flat[:, 1] <= limit)


@pytest.mark.slow
def test_the_command_prints_the_draws_worth_and_writes_what_arviz_reads(fall: str, tmp_path: Path) -> None:
    problem, measurement = thrown(fall)
    stated, table, kept = tmp_path / "thrown.yaml", tmp_path / "thrown.csv", tmp_path / "draws.nc"
    table.write_text("t,y\n" + "\n".join(f"{t},{y}" for t, (y,) in zip(TIMES, measurement.first.values, strict=True)))
    source = {"kind": "file", "path": str(table), "time": "t"}
    whole = problem.model_dump(mode="json", exclude_defaults=True) | {"source": source}
    stated.write_text(json.dumps(whole))
    asked = ["identify", str(stated), "--sample", "300", "--method", "least-squares"]
    done = CliRunner().invoke(main, [*asked, "--json", "--out", str(kept)], catch_exceptions=False)
    told = json.loads(done.stdout)["posterior"]
    assert told["status"] == "converged"
    with xr.open_dataset(kept, engine="scipy") as draws:
        assert set(draws.sizes) == {"chain", "draw"}
        assert draws.sizes["chain"] * draws.sizes["draw"] == told["draws"]
        assert list(np.unique(draws["ensemble"])) == [0, 1, 2, 3]
        for name, one in told["parameters"].items():
            assert one["interval"] == pytest.approx(np.quantile(draws[name], [0.025, 0.975]))
    done = CliRunner().invoke(main, asked, catch_exceptions=False)
    assert "posterior, normal:" in done.output
    assert "R-hat" in done.output


def test_a_file_of_draws_is_refused_where_none_are_drawn(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["identify", "paper-case-1", "--out", str(tmp_path / "draws.nc")])
    assert done.exit_code == 2
    assert ".nc holds draws from the posterior; add --sample" in done.output


def test_without_a_minimum_nothing_is_drawn(fall: str) -> None:
    problem, measurement = thrown(fall, None)
    short = measurement.changed(lambda one: replace(one, times=one.times[:4], values=one.values[:4]))
    estimate = sampled(problem, short)
    assert estimate.verdict == "failed"
    assert estimate.posterior is None
    assert "no-posterior" in estimate.codes


def test_without_the_sampler_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "find_spec", lambda _: None)
    done = CliRunner().invoke(main, ["identify", "paper-case-1", "--sample"])
    assert isinstance(done.exception, BaseException)
    assert "extra 'sample'" in f"{done.output}{done.exception}"
