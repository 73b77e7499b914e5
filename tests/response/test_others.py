"""What other tools say of uncertain parameters: SALib's problems, OpenTURNS' distributions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from SALib import util
from scipy import stats
from shoal.errors import InputError
from shoal.response.inputs import Inputs
from shoal.response.read import parameters, to_salib
from shoal.scene import load_scene

MASS, ANGLE = "bodies.OA.mass", "initial.OA.angle"
X = np.array([0.001, 0.2, 0.5, 0.9, 0.999])
FORMS: dict[str, tuple[list[float], Any]] = {
    "unif": ([1.0, 2.0], stats.uniform(1, 1)),
    "norm": ([2.0, 0.1], stats.norm(2, 0.1)),
    "lognorm": ([0.5, 0.2], stats.lognorm(0.2, scale=np.exp(0.5))),
    "logunif": ([1.0, 4.0], stats.loguniform(1, 4)),
    "triang": ([1.0, 3.0, 0.25], stats.triang(0.25, 1, 2)),
    "truncnorm": ([1.0, 3.0, 2.0, 0.5], stats.truncnorm(-2, 2, 2, 0.5)),
}


@pytest.mark.parametrize("kind", FORMS)
def test_problems_of_salib(kind: str) -> None:
    """Quantiles as SALib's documentation defines them, and back."""
    bounds, exact = FORMS[kind]
    problem = {"num_vars": 1, "names": [MASS], "bounds": [bounds], "dists": [kind]}
    inputs = Inputs(parameters(problem, load_scene("single-pendulum")))
    marginal = inputs.parameters[0].marginal
    assert marginal.value(marginal.quantile(X)) == pytest.approx(exact.ppf(X))
    if kind == "logunif":
        with pytest.raises(InputError, match="SALib has no distribution"):
            to_salib(inputs)
    else:
        again = to_salib(inputs)
        assert again["bounds"][0] == pytest.approx(bounds)
        assert {**again, "bounds": problem["bounds"]} == problem


def test_problems_agree_with_salib() -> None:
    """Samples that SALib scales from the unit cube are the quantiles here."""
    names = [f"x{k}" for k in range(len(FORMS))]
    problem = {"num_vars": len(FORMS), "names": names, "dists": list(FORMS)}
    problem["bounds"] = [bounds for bounds, _ in FORMS.values()]
    unit = np.random.default_rng(0).random((50, len(FORMS)))
    scaled = util.scale_samples(unit.copy(), problem)
    for k, (bounds, exact) in enumerate(FORMS.values()):
        assert scaled[:, k] == pytest.approx(exact.ppf(unit[:, k])), bounds


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ({"num_vars": 2}, "differ in length"),
        ({"dists": ["gumbel"]}, "there are unif"),
        ({"bounds": [[1.0, 2.0, 3.0]]}, "needs 2 bounds"),
        ({"bounds": [[2.0, 1.0]]}, "no width"),
        ({"groups": ["g"]}, "groups"),
    ],
)
def test_wrong_problems_are_named(change: dict[str, Any], names: str) -> None:
    problem = {"num_vars": 1, "names": [MASS], "bounds": [[1.0, 2.0]], "dists": ["unif"], **change}
    with pytest.raises(InputError, match=names):
        parameters(problem, load_scene("single-pendulum"))


class Gumbel:
    """A distribution that answers as OpenTURNS' do."""

    dimension = 1

    def getDimension(self) -> int:
        return self.dimension

    def computeQuantile(self, x: float) -> list[float]:
        return [float(stats.gumbel_r(2.0, 0.1).ppf(x))]

    def getMean(self) -> list[float]:
        return [float(stats.gumbel_r(2.0, 0.1).mean())]

    def getStandardDeviation(self) -> list[float]:
        return [float(stats.gumbel_r(2.0, 0.1).std())]


def test_distributions_of_openturns() -> None:
    scene = load_scene("single-pendulum")
    (one,) = parameters({MASS: Gumbel()}, scene)
    assert one.marginal.random
    assert one.marginal.value(one.marginal.quantile(X)) == pytest.approx(stats.gumbel_r(2.0, 0.1).ppf(X))
    both = Gumbel()
    both.dimension = 2
    with pytest.raises(InputError, match="one variable"):
        parameters({MASS: both}, scene)


def test_the_real_openturns() -> None:
    openturns = pytest.importorskip("openturns")
    (one,) = parameters({MASS: openturns.Gumbel(0.1, 2.0)}, load_scene("single-pendulum"))
    assert one.marginal.value(one.marginal.quantile(X)) == pytest.approx(stats.gumbel_r(2.0, 0.1).ppf(X))
