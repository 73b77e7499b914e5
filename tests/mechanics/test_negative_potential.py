"""Constant forces and torques by `elastic` laws, whose potential may be negative: closed forms, and what is wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Status

TIMES = np.linspace(0.0, 1.0, 5)[1:]


def _thrown(dimensions: int, start: float, force: float, **solver: Any) -> Scene:
    """A mass of 2 kg, pushed along x by a constant force [N] of a spring, from rest at `start` [m]."""
    at = [0.0] * (dimensions - 1)
    return Scene.parse({
        "name": "thrown", "dimensions": dimensions, "gravity": [0.0, *at],
        "bodies": {"m": {"kind": "point-mass", "mass": 2.0}}, "joints": {},
        "loads": {"s": {"kind": "spring", "first": {"body": "ground", "point": [-10.0, *at]}, "second": {"body": "m"},
                        "stiffness": 0.0, "length": 10.0, "elastic": str(-force)}},
        "markers": {"m": {"body": "m"}}, "initial": {"m": {"position": [start, *at]}},
        "solver": {"duration": 1.0, **solver},
    })  # fmt: skip


THROWS = [
    ("dop853", 0.29, 20.0),
    ("dop853", 0.0, 20.0),
    ("dop853", 0.0, -7.0),
    ("leapfrog", 0.29, 20.0),
    ("energy-momentum", 0.0, 20.0),
    ("radau5", 0.29, 20.0),
]


@pytest.mark.parametrize(
    ("integrator", "start", "force", "dimensions"),
    [
        *[(*throw, 2) for throw in THROWS],
        # Implicit time loops in space take long to compile.
        *[(*throw, 3) for throw in THROWS[:4]],
        *[pytest.param(*throw, 3, marks=pytest.mark.slow) for throw in THROWS[4:]],
    ],
)
def test_a_constant_force_throws_a_mass(integrator: str, start: float, force: float, dimensions: int) -> None:
    run = simulate(_thrown(dimensions, start, force, integrator=integrator), TIMES)
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("m")[:, 0], start + force * TIMES**2 / (2 * 2.0), atol=1e-8)
    assert run.energy_drift[0] < 1e-8


@pytest.mark.parametrize("dimensions", [2, 3])
def test_lanes_are_thrown_from_where_they_are(dimensions: int) -> None:
    starts = np.linspace(-0.3, 0.3, 9)
    run = simulate(_thrown(dimensions, 0.0, 20.0), TIMES, {"initial.m.position.0": starts})
    assert run.ok, run.message
    np.testing.assert_allclose(run.points[:, 0, 0], starts + 5.0 * TIMES[:, None] ** 2, atol=1e-8)


def test_a_constant_torque_turns_an_arm() -> None:
    scene = load_scene("single-pendulum").with_values({"gravity": [0.0, 0.0], "initial.OA.angle": 0.2})
    spring = {"kind": "torsion-spring", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "OA"}}
    scene = Scene.parse(scene.model_dump() | {"loads": {"lift": spring | {"angle": 0.0, "elastic": "-12"}}})
    run = simulate(scene, TIMES)
    assert run.ok, run.message
    np.testing.assert_allclose(run.angles[:, 0, 0], 0.2 + 12.0 * TIMES**2 / 2, atol=1e-6)


def test_a_soft_rod_that_a_constant_force_draws_stays_within_its_reach() -> None:
    """The energy of the spring falls by as much as those of the rod and the motion rise: their sum is none."""
    rod = {"kind": "rod", "length": 1.0, "height": 0.1, "width": 0.1, "density": 1e-3, "youngs_modulus": 1e3}
    ground = {"body": "ground", "point": [0.0, 0.0]}
    scene = Scene.parse({
        "name": "drawn", "gravity": [0.0, 0.0],
        "bodies": {"rod": {**rod, "element": "ancf-cable", "elements": 1}, "m": {"kind": "point-mass", "mass": 1.0}},
        "joints": {"O": {"kind": "weld", "first": ground, "second": {"body": "rod"}},
                   "A": {"first": {"body": "rod", "point": "end"}, "second": {"body": "m"}}},
        "loads": {"s": {"kind": "spring", "first": ground, "second": {"body": "m"}, "stiffness": 0.0, "length": 1.0,
                        "elastic": "-4"}},
        "markers": {"m": {"body": "m"}}, "solver": {"duration": 1.0, "integrator": "dop853"},
    })  # fmt: skip
    run = simulate(scene, TIMES)
    assert run.ok, run.message
    wanted = 1.0 + 0.4 * (1.0 - np.cos(np.sqrt(10.0) * TIMES))
    np.testing.assert_allclose(run.marker("m")[:, 0], wanted, atol=1e-4)


@pytest.mark.by_day(1)
@pytest.mark.parametrize("dimensions", [2, 3])
def test_energy_that_is_wrong_is_seen_where_the_potential_is_negative(dimensions: int) -> None:
    """A force that throws, and rises and falls along the way within a few steps that are far too long."""
    scene = _thrown(dimensions, 0.1, 0.0, integrator="leapfrog", step=0.015)
    scene = scene.with_values({"loads.s.elastic": "-20 - 400*sin(60*t)"})
    assert simulate(scene, TIMES).status == (Status.ENERGY,)
    assert simulate(scene.with_values({"solver.step": 1e-4}), TIMES).ok
