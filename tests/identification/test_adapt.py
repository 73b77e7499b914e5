"""Coarse models for the search and the needed one at the end, against data of Exudyn's fine mesh."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.identification import Measurement, Verdict, identify, load_problem, measure


@pytest.mark.slow
def test_search_goes_by_a_coarse_model_and_ends_on_the_needed_one() -> None:
    problem = load_problem("paper-case-1")
    data = measure(problem, problem.load_scene())
    stated, chosen = (identify(problem, measurement=data, tolerance=tolerance) for tolerance in (None, 1e-3))
    coarse, fine = chosen.model["selection"]
    assert chosen.verdict is Verdict.IDENTIFIED
    assert coarse["error"] > fine["error"] <= 1e-3
    assert coarse["evaluations"] > fine["evaluations"]
    assert chosen.evaluations == coarse["evaluations"] + fine["evaluations"]
    errors = [max(abs(e.parameters[n].value - true) for n, true in e.truth.items()) for e in (stated, chosen)]
    assert errors[1] < np.radians(0.02)
    assert errors[1] < errors[0]


def test_a_mesh_error_above_the_noise_is_named() -> None:
    problem = load_problem("paper-case-1").model_copy(update={"noise": 1e-3})
    data = measure(problem, problem.load_scene())
    coarse = {"bodies.OA.elements": 3, "bodies.AB.elements": 5}
    estimate = identify(problem, values=coarse, measurement=data)
    (limit,) = [one for one in estimate.findings if one.code == "mesh-error"]
    assert limit.numbers["noise"] == pytest.approx(0.001)
    assert limit.numbers["error"] > limit.numbers["noise"]
    assert limit.numbers["tolerance"] == pytest.approx(0.001 / 3)


def test_models_are_chosen_for_the_native_engine_only() -> None:
    with pytest.raises(InputError, match="tolerance: models are chosen for engine gauss only"):
        identify(load_problem("paper-case-1"), engine="casadi", tolerance=1e-3)


@pytest.mark.slow
def test_stated_noise_decides_what_a_fit_is() -> None:
    """Noise as large as the motion itself is no reason to reject a model that explains the rest."""
    problem = load_problem("paper-case-1-same-mesh")
    data = measure(problem, problem.load_scene())
    one = data.first
    shaken = one.values + np.random.default_rng(0).normal(0, 0.3, one.values.shape)
    noisy, stated = (Measurement.single(one.times, one.channels, shaken, "shaken", noise=size) for size in (None, 0.3))
    loud = identify(problem, measurement=stated)
    assert loud.verdict is not Verdict.REJECTED
    assert not identify(problem, measurement=noisy).verdict.trusted
