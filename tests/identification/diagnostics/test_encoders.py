"""Two encoders of a double pendulum whose motion is scipy's: read the wrong way round, exchanged, with outliers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shoal.identification import Estimate, Verdict, identify, load_problem
from shoal.trajectory import Array
from shoal_validation.problems.double_pendulum import lagrange

PROBLEM = """
name: encoders
scene: rigid-double-pendulum
parameters:
  first: {path: initial.OA.angle, lower: -3.2, upper: 3.2}
  second: {path: initial.AB.angle, lower: -3.2, upper: 3.2}
channels:
  - {marker: A, quantity: angle, column: shoulder, unit: rad}
  - {marker: B, to: A, quantity: angle, column: elbow, unit: rad}
source: {kind: file, path: run.csv}
"""
TRUE = {"first": 0.8, "second": 0.3}
NOISE = 2e-3
TIMES = np.linspace(0.0, 1.0, 101)


def recorded() -> Array:
    """Angles [rad] at the ground and between the rods, (samples, 2), with noise."""
    elbow, tip = lagrange((TRUE["first"], TRUE["second"]), TIMES)
    first, second = (np.unwrap(np.arctan2(rod[:, 1], rod[:, 0])) for rod in (elbow, tip - elbow))
    noise = NOISE * np.random.default_rng(3).standard_normal((len(TIMES), 2))
    return np.asarray(np.column_stack([first, second - first]) + noise)


def answer(folder: Path, table: Array, columns: str = "t,shoulder,elbow", more: str = "") -> Estimate:
    (folder / "encoders.yaml").write_text(PROBLEM + more)
    np.savetxt(folder / "run.csv", np.column_stack([TIMES, table]), delimiter=",", header=columns, comments="")
    return identify(load_problem(str(folder / "encoders.yaml")))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("columns", "signs", "told"),
    [
        ("t,shoulder,elbow", [1, -1], "the sign of the angle of B against A: turned, it would lower the misfit"),
        ("t,elbow,shoulder", [1, 1], "the columns of angle of A and angle of B against A: exchanged, they would"),
    ],
)
def test_a_wrong_sense_and_exchanged_columns_are_named(
    columns: str, signs: list[int], told: str, tmp_path: Path
) -> None:
    estimate = answer(tmp_path, recorded() * signs, columns)
    assert estimate.verdict is Verdict.REJECTED
    assert told in estimate.message
    assert "seek it as a parameter" not in estimate.advice[0]


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["", f"noise: {NOISE}\n"])
def test_outliers_that_a_robust_loss_sets_aside_refute_no_model(noise: str, tmp_path: Path) -> None:
    table = recorded()
    table[5::17, 1] += 1.5
    estimate = answer(tmp_path, table, more=f"loss: huber\n{noise}")
    assert estimate.verdict is Verdict.IDENTIFIED, estimate.message
    assert "systematic-residual" not in estimate.codes
    for name, true in TRUE.items():
        found = estimate.parameters[name]
        assert found.lower < true < found.upper
    assert answer(tmp_path, table, more=noise).verdict is Verdict.REJECTED


@pytest.mark.slow
def test_a_robust_loss_accepts_no_wrong_model(tmp_path: Path) -> None:
    table = recorded()
    table[:, 1] += 0.05 * np.sin(9 * TIMES)
    assert answer(tmp_path, table, more=f"loss: huber\nnoise: {NOISE}\n").verdict is Verdict.REJECTED
