"""The door to the kernels: derivatives against differences, energies against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.scene import Scene, load_scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}


def _spinning_arm() -> Scene:
    """A rod with a motor, a spring, a force that turns with it and a damped torsion spring, on a flexible rod."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 2000.0, "youngs_modulus": 1e8}
    end = {"body": "bar", "point": "end"}
    return Scene.parse(
        {
            "name": "arm",
            "bodies": {"rod": rod | {"element": "ancf-cable", "elements": 2}, "bar": rod | {"element": "rigid"}},
            "joints": {
                "O": {"first": GROUND, "second": {"body": "rod"}},
                "A": {"first": {"body": "rod", "point": "end"}, "second": {"body": "bar"}},
            },
            "loads": {
                "motor": {"kind": "torque", "at": {"body": "bar"}, "torque": 0.7, "reaction": {"body": "rod"}},
                "thrust": {"kind": "force", "at": end, "force": [0.3, 1.0], "follows": True},
                "spring": {"kind": "spring", "first": {"body": "ground", "point": [0.0, 1.0]}, "second": end,
                           "stiffness": 20.0, "length": 0.5},
                "twist": {"kind": "torsion-spring", "first": {"body": "rod", "point": "end"},
                          "second": {"body": "bar"}, "stiffness": 3.0, "damping": 0.2},
            },
            "markers": {"end": end},
            "initial": {"rod": {"angle": 0.3}, "bar": {"angle": -0.4}},
        }
    )  # fmt: skip


@pytest.fixture(scope="module")
def arm() -> tuple[Evaluator, Any]:
    evaluator = Evaluator.of(_spinning_arm())
    q = evaluator.model.q0[:, 0]
    return evaluator, q + 0.01 * np.cos(np.arange(len(q)))


def _difference(function: Any, at: Any, step: float = 1e-6) -> Any:
    return np.array([(function(at + step * e) - function(at - step * e)) / (2 * step) for e in np.eye(len(at))]).T


def test_stiffness_is_the_derivative_of_the_force_with_loads_that_turn(arm: tuple[Evaluator, Any]) -> None:
    evaluator, q = arm
    found = evaluator.stiffness(q).toarray()
    expected = -_difference(lambda x: evaluator.at(x).force, q)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(found).max())
    assert np.abs(found - found.T).max() > 0.1  # the thrust has no potential
    assert np.isnan(evaluator.at(q).applied)


def test_damping_is_the_derivative_of_the_force_in_the_rates(arm: tuple[Evaluator, Any]) -> None:
    evaluator, q = arm
    found = evaluator.damping(q).toarray()
    expected = -_difference(lambda v: evaluator.at(q, v).force, 0.1 * np.sin(np.arange(len(q))))
    np.testing.assert_allclose(found, expected, atol=1e-7)
    assert np.abs(found).max() > 0.1


def test_jacobian_rates_and_curvature_of_the_constraints() -> None:
    evaluator = Evaluator.of(load_scene("parallelogram"))
    q = evaluator.model.q0[:, 0] + 0.02
    look = evaluator.at(q)
    jacobian = look.jacobian.toarray()
    np.testing.assert_allclose(jacobian, _difference(lambda x: evaluator.at(x).gap, q), atol=1e-9)
    lagrange = np.arange(1.0, 1.0 + len(look.gap))
    curvature = evaluator.stiffness(q, multipliers=lagrange).toarray()
    expected = _difference(lambda x: evaluator.at(x).jacobian.T @ lagrange, q)
    np.testing.assert_allclose(curvature, expected, atol=1e-8)
    v = np.cos(np.arange(len(q)))
    turning = _difference(lambda x: evaluator.at(x).jacobian @ v, q) @ v
    np.testing.assert_allclose(evaluator.at(q, v).bias, turning, atol=1e-8)


def test_energies_of_a_spinning_stretched_rod() -> None:
    length, height, width, density, young = 2.0, 0.01, 0.03, 1000.0, 1e7
    scene = Scene.parse(
        {
            "name": "rod",
            "bodies": {"rod": {"kind": "rod", "length": length, "height": height, "width": width, "density": density,
                               "youngs_modulus": young, "element": "ancf-cable", "elements": 3}},
            "joints": {"O": {"first": GROUND, "second": {"body": "rod"}}},
            "markers": {"end": {"body": "rod", "point": "end"}},
        }
    )  # fmt: skip
    evaluator = Evaluator.of(scene)
    stretched = 1.01 * evaluator.model.q0[:, 0]
    look = evaluator.at(stretched)
    mass = density * height * width * length
    assert look.strain == pytest.approx(young * height * width * 0.01**2 / 2 * length, rel=1e-12)
    assert evaluator.strain_energies(stretched) == {"rod": pytest.approx(look.strain)}
    assert look.gravity == pytest.approx(0.0, abs=1e-12)
    # Rates of a rotation: every vector (x, y) moves with 3 (-y, x); the rod lies along x, its first node is fixed.
    v = np.zeros_like(stretched)
    v[1::2] = 3.0 * stretched[0::2]
    assert evaluator.at(stretched, v).kinetic == pytest.approx(mass * (1.01 * length) ** 2 / 3 * 9 / 2, rel=1e-12)
