"""Backlash of gears and couplings against closed forms: parabolas of a sum between impacts of Newton's law."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
AXLE = {"body": "ground", "point": [0.0, 0.0]}


def struck(
    factors: Any, inertia: Any, push: Any, rates: Any, wide: float, kept: float, end: float
) -> tuple[list[float], Any, Any]:
    """Return times of impacts, displacements and rates of coordinates whose sum of factors is free by a width.

    Their forces are constant, so that the sum is a parabola between the impacts.
    """
    x, v, t, times = np.zeros(len(factors)), np.array(rates), 0.0, list[float]()
    a = np.array(push) / inertia
    response = np.array(factors) / inertia
    while True:
        roots = [
            float(root.real)
            for side in (-0.5, 0.5)
            for root in np.roots([0.5 * (factors @ a), factors @ v, factors @ x - side * wide])
            if abs(root.imag) < 1e-12 and root.real > 1e-9
        ]
        step = min([*roots, end - t])
        x, v, t = x + v * step + 0.5 * a * step**2, v + a * step, t + step
        if t >= end:
            return times, x, v
        times.append(t)
        v = v - response * (1.0 + kept) * (factors @ v) / (factors @ response)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_gears_strike_both_sides_of_their_teeth(seed: int, dimensions: int) -> None:
    """Two gears and their carrier on one axle, each with a torque, which the teeth tie together."""
    if dimensions == 3 and seed > 0:
        pytest.skip("one is enough")
    rng = np.random.default_rng(seed)
    names = ["one", "two", "carrier"]
    inertia, rates, push = rng.uniform(0.01, 0.1, 3), rng.uniform(-1.0, 1.0, 3), rng.uniform(-0.05, 0.05, 3)
    ratio, wide, kept = ["-20/31", "2", "-1/3", "5/2"][seed], 0.02, rng.uniform(0.7, 1.0)
    number = float(eval(ratio))
    factors = np.array([-number, 1.0, -(1.0 - number)])
    carrier = {} if dimensions == 3 else {"carrier": {"body": "carrier"}}  # in space the ground carries them
    if dimensions == 3:
        factors[2] = 0.0
    about = ({}, {"axis": [0.0, 0.0, 1.0]})[dimensions - 2]
    moments = [float(one) if dimensions == 2 else [float(one)] * 3 for one in inertia]
    joints: dict[str, Any] = {name: {"first": AXLE, "second": {"body": name}, **about} for name in names}
    joints["mesh"] = {"kind": "gear", "first": {"body": "one"}, "second": {"body": "two"}, "ratio": ratio, **carrier,
                      "backlash": wide, "restitution": kept}  # fmt: skip
    loads = {name: {"kind": "torque", "at": {"body": name}, "torque": float(push[k])} for k, name in enumerate(names)}
    bodies = {
        name: {"kind": "rigid-body", "mass": 1.0, "inertia": one} for name, one in zip(names, moments, strict=True)
    }
    spin = {name: {"rate": float(rate)} for name, rate in zip(names, rates, strict=True)}
    scene = Scene.parse({"name": "gears", "dimensions": dimensions, "gravity": [0.0] * dimensions, "bodies": bodies,
                         "joints": joints, "loads": loads, "initial": spin,
                         "markers": {name: {"body": name} for name in names},
                         "solver": {"duration": 0.5, "relative_tolerance": 1e-12}})  # fmt: skip
    found = simulate(scene, np.array([0.5]))
    assert found.ok, found.message
    times, x, v = struck(factors, inertia, push, rates, wide, kept, 0.5)
    assert 1 <= len(times) < 60
    assert [event["time"] for event in found.model["events"]] == pytest.approx(times, abs=1e-9)
    assert found.model["events"][0]["joint"] == "mesh"
    if dimensions == 2:
        np.testing.assert_allclose(found.angles[0, :, 0], x, atol=1e-9)
        assert found.rates is not None
        np.testing.assert_allclose(found.rates[0, :, 0], v, atol=1e-8)


def test_a_coupling_with_backlash_ties_coordinates_within_it() -> None:
    factors, inertia, rates = np.array([1.0, -2.0]), np.array([1.0, 3.0]), np.array([0.4, -0.3])
    bodies = {name: {"kind": "point-mass", "mass": float(mass)} for name, mass in zip("ab", inertia, strict=True)}
    terms = [{"at": {"body": "a"}, "axis": "x"}, {"at": {"body": "b"}, "axis": "y", "factor": -2.0}]
    joint = {"kind": "coupling", "backlash": 0.1, "restitution": 0.8, "terms": terms}
    scene = Scene.parse({"name": "coupled", "gravity": [0.0, 0.0], "bodies": bodies, "joints": {"both": joint},
                         "markers": {name: {"body": name} for name in bodies},
                         "initial": {"a": {"position": [1.0, 2.0], "velocity": [0.4, 0.0]},
                                     "b": {"position": [3.0, 4.0], "velocity": [0.0, -0.3]}},
                         "solver": {"duration": 1.0}})  # fmt: skip
    found = simulate(scene, np.array([1.0]))
    assert found.ok, found.message
    times, x, _ = struck(factors, inertia, [0.0, 0.0], rates, 0.1, 0.8, 1.0)
    assert len(times) == 5
    assert [event["time"] for event in found.model["events"]] == pytest.approx(times, abs=1e-10)
    np.testing.assert_allclose([found.points[0, 0, 0, 0] - 1.0, found.points[0, 1, 1, 0] - 4.0], x, atol=1e-10)


def geared(**more: Any) -> dict[str, Any]:
    bodies = {name: {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "centre_of_mass": [0.1, 0.0]} for name in "ab"}
    joints: dict[str, Any] = {name: {"first": AXLE, "second": {"body": name}} for name in "ab"}
    joints["mesh"] = {"kind": "gear", "first": {"body": "a"}, "second": {"body": "b"}, "ratio": -2.0, "backlash": 0.02,
                      "restitution": 0.5, **more}  # fmt: skip
    return {"name": "geared", "gravity": [0.0, -9.81], "bodies": bodies, "joints": joints,
            "markers": {name: {"body": name, "point": [0.1, 0.0]} for name in "ab"},
            "initial": {"a": {"angle": -1.0, "rate": 1.0}}, "solver": {"duration": 1.0}}  # fmt: skip


def test_gears_rest_on_a_flank_and_start_with_the_rates_of_the_mesh() -> None:
    """At rest the angles differ by half of the backlash, and the moments of the weights are as 2 to 1 or in balance."""
    scene = Scene.parse(geared())
    found = simulate(scene, np.array([0.0, 1.0]))
    assert found.ok, found.message
    assert found.rates is not None
    assert found.rates[0, :, 0] == pytest.approx([1.0, -2.0], abs=1e-12)
    assert abs(found.angles[1, 1, 0] + 2.0 * (found.angles[1, 0, 0] + 1.0)) <= 0.01 + 1e-9
    rest = statics(scene)
    one, other = rest.angles
    assert other + 2.0 * (one + 1.0) == pytest.approx(-0.01, abs=1e-12)
    push = {"joints.mesh.backlash": 9.81 * 0.1 * np.cos(other)}
    assert rest.contacts == pytest.approx(push, abs=1e-10)
    assert 2.0 * np.cos(other) == pytest.approx(np.cos(one), abs=1e-10)


def test_lanes_of_backlash_move_as_alone() -> None:
    scene, times = Scene.parse(geared()), np.linspace(0.0, 1.0, 5)
    values = {"joints.mesh.backlash": np.array([0.01, 0.05, 0.2]), "joints.mesh.restitution": np.array([0.2, 0.5, 0.8])}
    together = get_engine("gauss").simulate_many(scene, values, times)
    assert together.ok
    for lane in range(3):
        alone = simulate(scene.with_values({path: float(each[lane]) for path, each in values.items()}), times)
        np.testing.assert_allclose(together.points[..., lane], alone.points[..., 0], atol=1e-7)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"backlash": -1.0}, "joints.mesh.backlash: Input should be greater than 0"),
        ({"backlash": None}, "joints.mesh: restitution: is of a joint with backlash; state `backlash` as well"),
    ],
)
def test_backlash_that_is_none_is_refused(given: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        Scene.parse(geared(**given))


def test_a_driven_coupling_has_no_backlash() -> None:
    joint = {"kind": "coupling", "value": "0.1*t", "backlash": 0.1, "terms": [{"at": {"body": "a"}, "axis": "x"}]}
    with pytest.raises(InputError, match="value: with backlash the sum is free about its value at the start"):
        Scene.parse({"name": "c", "bodies": {"a": {"kind": "point-mass", "mass": 1.0}}, "joints": {"c": joint},
                     "initial": {"a": {"position": [0.0, 0.0]}}, "markers": {"P": {"body": "a"}}})  # fmt: skip
