"""A machine told in other units of length, mass and time moves the same, and its checks see the same faults."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.trajectory import Status, Trajectory

UNITS = {
    **dict.fromkeys(("length", "height", "width", "point", "position"), (1, 0, 0)),
    **dict.fromkeys(("step", "duration"), (0, 0, 1)),
    "density": (-3, 1, 0),
    "youngs_modulus": (-1, 1, -2),
    "mass": (0, 1, 0),
    "rate": (0, 0, -1),
    "gravity": (1, 0, -2),
    "stiffness": (0, 1, -2),
}
"""Powers of length, mass and time."""

RODS = """
name: rods
gravity: [0.0, -9.81]
bodies:
  crank: {kind: rod, length: 0.4, height: 0.02, width: 0.02, density: 2700.0}
  coupler: {kind: rod, length: 1.1, height: 0.02, width: 0.02, density: 2700.0, youngs_modulus: 2.0e+9,
            element: ancf-cable, elements: 2}
  rocker: {kind: rod, length: 0.7, height: 0.02, width: 0.02, density: 2700.0}
joints:
  O: {first: {body: ground, point: [0.0, 0.0]}, second: {body: crank}}
  A: {first: {body: crank, point: end}, second: {body: coupler}}
  B: {first: {body: coupler, point: end}, second: {body: rocker, point: end}}
  C: {first: {body: ground, point: [1.2, 0.1]}, second: {body: rocker}}
markers: {A: {body: crank, point: end}, B: {body: rocker, point: end}}
initial: {crank: {angle: 1.0, rate: 3.0}}
solver: {duration: 0.1, step: 1.0e-4, integrator: rk4}
"""

POINTS = """
name: points
gravity: [0.0, -9.81]
bodies:
  slide: {kind: point-mass, mass: 2.0}
  bob: {kind: point-mass, mass: 0.3}
joints:
  rail: {kind: slider, first: {body: ground, point: [0.0, 0.0]}, second: {body: slide}, rotation: free}
  rope: {kind: distance, first: {body: slide}, second: {body: bob}}
loads:
  spring: {kind: spring, first: {body: ground, point: [1.0, 0.0]}, second: {body: slide}, stiffness: 40.0}
markers: {slide: {body: slide}, bob: {body: bob}}
initial: {slide: {position: [0.0, 0.0]}, bob: {position: [0.3, -0.5]}}
solver: {duration: 1.0, step: 1.0e-3, integrator: rk4}
"""

PARALLELOGRAM = """
name: parallelogram
gravity: [0.0, -9.81]
bodies:
  left: {kind: rod, length: 0.4, height: 0.02, width: 0.02, density: 2700.0}
  coupler: {kind: rod, length: 1.1, height: 0.02, width: 0.02, density: 2700.0}
  right: {kind: rod, length: 0.4, height: 0.02, width: 0.02, density: 2700.0}
joints:
  O: {first: {body: ground, point: [0.0, 0.0]}, second: {body: left}}
  A: {first: {body: left, point: end}, second: {body: coupler}}
  B: {first: {body: coupler, point: end}, second: {body: right, point: end}}
  C: {first: {body: ground, point: [1.1, 0.0]}, second: {body: right}}
markers: {A: {body: left, point: end}}
initial: {left: {angle: 1.0, rate: 3.0}, right: {angle: 1.0, rate: 3.0}}
solver: {duration: 0.1}
"""

SCALES = [(1e-6, 1e-18, 1e-5), (1e-3, 1e-9, 1e-2), (1e3, 1e9, 30.0), (1e6, 1e12, 1e3)]
"""From a machine that a watchmaker could not see to one that spans a country."""


def told(node: Any, length: float, mass: float, time: float, field: str = "") -> Any:
    """The same description in units that are so many times smaller."""
    if isinstance(node, dict):
        return {key: told(value, length, mass, time, key) for key, value in node.items()}
    if isinstance(node, list):
        return [told(value, length, mass, time, field) for value in node]
    if isinstance(node, float) and field in UNITS:
        a, b, c = UNITS[field]
        return node * length**a * mass**b * time**c
    return node


def run(text: str, scale: tuple[float, float, float], **solver: Any) -> Trajectory:
    data = yaml.safe_load(text)
    data["solver"] |= solver
    scene = Scene.model_validate(told(data, *scale))
    return simulate(scene, scene.solver.duration * np.linspace(0.2, 1.0, 5))


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("text", [RODS, POINTS], ids=["rods", "points"])
def test_the_motion_does_not_depend_on_the_units(text: str, scale: tuple[float, float, float]) -> None:
    here, there = run(text, (1.0, 1.0, 1.0)), run(text, scale)
    assert here.ok, here.message
    assert there.ok, there.message
    np.testing.assert_allclose(there.points / scale[0], here.points, atol=1e-9)


@pytest.mark.parametrize("scale", [*SCALES, (1e7, 1e12, 1e3)])
@pytest.mark.parametrize("angle", [1.0, 0.0])
def test_stated_rates_that_agree_do_so_in_any_unit(angle: float, scale: tuple[float, float, float]) -> None:
    """Of both cranks; at angle 0 all bars are on one line, where the rates choose the branch as well."""
    text = PARALLELOGRAM.replace("angle: 1.0", f"angle: {angle}")
    here, there = run(text, (1.0, 1.0, 1.0)), run(text, scale)
    assert here.ok, here.message
    assert there.ok, there.message
    np.testing.assert_allclose(there.points / scale[0], here.points, atol=1e-9)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("text", [RODS, POINTS], ids=["rods", "points"])
def test_drift_is_seen_whatever_the_units(text: str, scale: tuple[float, float, float]) -> None:
    """Joints left to drift with steps that are too long."""
    loose = {"project": False, "integrator": "semi-implicit-euler", "energy_tolerance": 1e9, "step": 1e-4}
    here, there = run(text, (1.0, 1.0, 1.0), **loose), run(text, scale, **loose)
    assert here.status == there.status == (Status.DRIFTED,)
    assert here.constraint_drift[0] == pytest.approx(there.constraint_drift[0], rel=1e-3)
