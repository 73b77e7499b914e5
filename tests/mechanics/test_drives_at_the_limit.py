"""Drives at the edge of what can be stated: at rest at first, through uneven rows, and lengths that vanish."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.mechanics import fitting
from shoal.mechanics.functions import value
from shoal.mechanics.verdict import REACH
from shoal.scene import Function, Scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}


def hung(length: Any, **start: Any) -> Scene:
    distance = {"kind": "distance", "first": GROUND, "second": {"body": "a"}, "length": length}
    start = {"position": [0.0, -0.2], **start}
    bodies, markers = {"a": {"kind": "point-mass", "mass": 1.0}}, {"a": {"body": "a"}}
    scene = {"bodies": bodies, "markers": markers, "joints": {"d": distance}, "initial": {"a": start}}
    return Scene.parse({"name": "hung", **scene, "solver": {"samples": 4}})


def test_rates_of_zero_agree_with_a_drive_that_rests_at_first() -> None:
    run = get_engine("gauss").simulate(hung("0.2 + 0.0754*ramp((t - 0.516673)/0.3)", velocity=[0.0, 0.0]))
    assert run.ok
    np.testing.assert_allclose(run.marker("a")[-1], [0.0, -0.2754], atol=1e-9)


@pytest.mark.parametrize("length", ["0.2 - 0.3*t", "0.2*cos(3*t)"])
def test_a_length_that_vanishes_is_refused(length: str) -> None:
    with pytest.raises(InputError, match=r"joints\.d: a length must stay above 0 m"):
        get_engine("gauss").simulate(hung(length))


def test_a_spline_through_uneven_rows_drives_an_angle() -> None:
    times = [-0.1, 0.6904064214977103, 0.7687934731841602, 0.7870630585543315, 0.9703, 1.4735, 1.5477]
    angles = [-7.9619, -8.2206, -7.9157, -7.5583, -8.1444, -8.1819, -7.6933]
    table = Function.model_validate({"table": list(zip(times, angles, strict=True))})
    fitted = fitting.fit(table.through("cos"), 1.5, table.knots)
    for t in np.linspace(0.0, 1.5, 40):
        assert value(fitted, t) == pytest.approx(np.cos(CubicSpline(times, angles)(t)), abs=1e-12)


def test_a_wrong_angle_is_told_where_the_marker_rests() -> None:
    """A wheel on a torsion spring, seen at its pin: the angle is cos(w t), w = sqrt(k / J)."""
    spring = {"kind": "torsion-spring", "first": GROUND, "second": {"body": "w"}, "stiffness": 100.0, "angle": 0.0}
    wheel = {
        "name": "wheel",
        "bodies": {"w": {"kind": "rigid-body", "mass": 2.0, "inertia": 0.3}},
        "joints": {"O": {"first": GROUND, "second": {"body": "w"}}},
        "loads": {"s": spring},
        "markers": {"c": {"body": "w"}},
        "initial": {"w": {"angle": 1.0}},
        "solver": {"duration": 3.0, "samples": 30, "integrator": "energy-momentum", "step": 0.02},
    }
    run = verified(get_engine("gauss"), Scene.parse(wheel))
    off = float(np.max(np.abs(run.angle("c") - np.cos(np.sqrt(100.0 / 0.3) * run.times))))
    assert off > 0.3
    assert not run.ok
    assert "rad" in run.message
    assert run.model["verification"]["angle_error"] > 0.2


def test_a_drive_that_asks_for_more_than_a_linkage_can_reach_is_named() -> None:
    """A four-bar of 0.5, 0.6 and 0.4 m on 1 m: its crank stops where the other two rods lie in one line."""
    lengths = {"a": 0.5, "b": 0.6, "c": 0.4}
    bodies = {
        name: {"kind": "rod", "length": length, "height": 0.02, "width": 0.02, "density": 7800.0}
        for name, length in lengths.items()
    }
    ends = {name: {"body": name, "point": "end"} for name in lengths}
    joints = {
        "A": {"first": GROUND, "second": {"body": "a"}},
        "B": {"first": ends["a"], "second": {"body": "b"}},
        "C": {"first": ends["b"], "second": ends["c"]},
        "D": {"first": {"body": "ground", "point": [1.0, 0.0]}, "second": {"body": "c"}},
        "m": {"kind": "driven-angle", "first": GROUND, "second": {"body": "a"}, "angle": "1 + 2*t"},
    }
    start = {"a": {"angle": 1.0}, "c": {"angle": 1.9, "guess": ["angle"]}}
    scene = {"name": "four-bar", "gravity": [0.0, 0.0], "bodies": bodies, "joints": joints, "initial": start}
    run = get_engine("gauss").simulate(Scene.parse({**scene, "markers": {"B": ends["b"]}}))
    assert not run.ok
    assert run.advice[0].endswith(REACH)
