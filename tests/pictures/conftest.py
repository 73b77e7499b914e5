"""Estimates, each fitted to data of another engine, and pages that the tests of pictures share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.identification import Estimate, Measurement, Problem, identify, load_problem, measure
from shoal.identification.conclude import Options
from shoal.pictures.answer import Answer
from shoal.pictures.report import report
from shoal.pictures.simulation import simulation
from shoal.pictures.study import study
from shoal.scene import Scene, load_scene
from shoal.selection import select

TOP = Scene.parse(
    {
        "name": "top",
        "dimensions": 3,
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {
            "top": {
                "kind": "rigid-body",
                "mass": 1.0,
                "inertia": [0.02, 0.02, 0.03],
                "centre_of_mass": [0.0, 0.0, 0.2],
            },
            "rod": {
                "kind": "rod",
                "length": 0.5,
                "height": 0.06,
                "width": 0.02,
                "density": 500.0,
                "rotary_inertia": True,
            },
        },
        "joints": {
            "foot": {"kind": "spherical", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "top"}},
            "hinge": {"first": {"body": "top", "point": [0, 0, 0.4]}, "second": {"body": "rod"}, "axis": [1, 0, 0]},
        },
        "markers": {"tip": {"body": "rod", "point": "end"}},
        "initial": {"top": {"spin": [0.0, 0.3, 20.0]}, "rod": {"rotation": [0.0, 0.0, 1.5707963267948966]}},
        "solver": {"integrator": "dop853", "relative_tolerance": 1e-9, "absolute_tolerance": 1e-10, "duration": 1.0},
    }
)
"""Of rigid bodies in space."""


@pytest.fixture(scope="session")
def estimates() -> dict[str, Estimate]:
    """Case 1 of the paper on two meshes."""
    problem = load_problem("paper-case-1")
    measurement = measure(problem, problem.load_scene())
    meshes = {"coarse": 2, "fine": 4}
    return {
        name: identify(
            problem,
            method="least-squares",
            measurement=measurement,
            values={"bodies.OA.elements": count, "bodies.AB.elements": 2 * count},
        )
        for name, count in meshes.items()
    }


@pytest.fixture(scope="session")
def flexible(estimates: dict[str, Estimate]) -> Answer:
    """The finer of them, as an answer."""
    return Answer(load_problem("paper-case-1"), estimates["fine"])


@pytest.fixture(scope="session")
def several() -> Answer:
    """Two recordings of five channels in all with noise, a gap, a slow clock and a camera askew, with a posterior."""
    angle = {"lower": -3.3, "upper": 3.3, "own": True}
    source: dict[str, Any] = {"kind": "engine", "engine": "casadi", "noise": 0.003}
    tip = [{"marker": "B", "quantity": "x"}, {"marker": "B", "quantity": "y"}]
    problem = Problem.parse(
        {
            "name": "several",
            "scene": "rigid-double-pendulum",
            "parameters": {
                "theta1": {"path": "initial.OA.angle", **angle},
                "theta2": {"path": "initial.AB.angle", **angle},
                "density": {"path": "bodies.AB.density", "lower": 200.0, "upper": 4000.0, "scale": "log"},
            },
            "channels": [*tip, {"marker": "A", "quantity": "angle"}],
            "recordings": {
                "high": {**source, "stop": 1.0, "count": 60},
                "low": {
                    **source,
                    "stop": 0.6,
                    "count": 50,
                    "clock": 0.5,
                    "tilt": 0.3,
                    "x": 0.5,
                    "channels": tip,
                    "values": {"initial.OA.angle": -0.7, "initial.AB.angle": -1.2},
                },
            },
            "noise": 0.003,
        },
        "several",
    )
    measured = measure(problem, problem.load_scene())
    high = measured.recordings["high"]
    values = high.values.copy()
    values[20:30, 0] = np.nan
    gappy = Measurement({**measured.recordings, "high": replace(high, values=values)}, measured.truth)
    return Answer(problem, identify(problem, method="least-squares", measurement=gappy, options=Options(sample=100)))


@pytest.fixture(scope="session")
def rejected(estimates: dict[str, Estimate]) -> Answer:
    """A model whose second rod is a tenth too short for the data."""
    problem = load_problem("paper-case-1")
    values = {"bodies.AB.length": 1.8}
    return Answer(problem, identify(problem, values=values, measurement=estimates["fine"].measurement))


@pytest.fixture(scope="session")
def pages(several: Answer, request: pytest.FixtureRequest) -> Callable[[str], str]:
    """Every kind of page there is, made when it is first asked for: a function of the kind."""

    @cache
    def page(kind: str) -> str:
        if kind == "estimate":
            return report(several)
        if kind == "rejected":
            return report(request.getfixturevalue("rejected"))
        if kind == "study":
            case, estimates = load_problem("paper-case-1"), request.getfixturevalue("estimates")
            return study({name: Answer(case, estimate) for name, estimate in estimates.items()})
        if kind == "space":
            return simulation(verified(get_engine("gauss"), TOP), TOP)
        scene = load_scene("flexible-double-pendulum")
        if kind == "simulation":
            return simulation(verified(get_engine("gauss"), scene), scene)
        selection = select(scene, 3e-2)
        return simulation(selection.trajectory, selection.chosen.scene, selection)

    return page
