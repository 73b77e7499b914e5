"""A size that a person reads has a unit, or is a ratio where channels of different units are taken together."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.identification import Estimate, Problem, identify

TIP = [{"marker": "B", "quantity": "x"}, {"marker": "B", "quantity": "y"}]
TURN = {"marker": "B", "quantity": "angle"}


def estimate(channels: list[dict[str, str]]) -> Estimate:
    """An angle and, by its logarithm, a length of a double pendulum."""
    source: dict[str, Any] = {"kind": "engine", "engine": "gauss", "noise": 1e-3, "stop": 1.0, "count": 40}
    parameters = {
        "angle": {"path": "initial.OA.angle", "lower": -1.0, "upper": 1.0},
        "length": {"path": "bodies.AB.length", "lower": 0.5, "upper": 4.0, "scale": "log"},
    }
    stated = {"name": "one", "scene": "rigid-double-pendulum", "parameters": parameters, "channels": channels}
    return identify(Problem.parse({**stated, "source": source}, "one"), method="least-squares")


@pytest.mark.parametrize(
    ("channels", "size"),
    [(TIP, " m (RMS for each channel), "), ([TURN], " rad (RMS for each channel), "), ([*TIP, TURN], "times")],
)
@pytest.mark.by_day(1)
def test_size_of_the_residual_has_a_unit(channels: list[dict[str, str]], size: str) -> None:
    first = estimate(channels).residual_tests.sentences()[0]
    assert size in first
    assert ("(RMS" in first) is (len(channels) != 3)


def test_covariance_is_of_the_values_and_their_units() -> None:
    """Of a parameter that was sought by its logarithm too."""
    found = estimate(TIP)
    cube = found.to_xarray()
    assert cube["unit"].values.tolist() == ["rad", "m"]
    np.testing.assert_allclose(np.sqrt(np.diag(cube["covariance"])), cube["std"], rtol=1e-5)
    assert "units" not in cube["value"].attrs, "they have two units"
