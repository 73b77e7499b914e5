"""Other places that fit: mirror images that the channels cannot tell apart, and places in the answer's own valley."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk
from shoal.engines import get_engine
from shoal.identification import Problem, Verdict, identify
from shoal.identification.diagnostics.minima.mirrors import images
from shoal.identification.diagnostics.minima.rivals import connected
from shoal.identification.diagnostics.minima.turns import nearest_turns
from shoal.identification.forward import ForwardModel
from shoal.identification.measure import measure
from shoal.identification.problem import Parameter

GRAVITIES = [(0.0, -9.81), (0.0, 9.81), (-9.81, 0.0), (9.81, 0.0)]


def problem(
    scene: str, parameters: dict[str, Any], channels: list[str], truth: dict[str, float], **more: Any
) -> Problem:
    tip = "A" if scene == "single-pendulum" else "B"
    measured = [{"marker": tip, "quantity": quantity, "noise": 1e-3} for quantity in channels]
    source = {"kind": "engine", "engine": "gauss", "stop": 1.2, "count": 60, "noise": 1e-3, "seed": 5, "values": truth}
    stated = {"name": "one", "scene": scene, "parameters": parameters, "channels": measured, "source": source}
    return Problem.parse({**stated, **more}, "one")


def drawn(rng: np.random.Generator) -> tuple[Problem, bool]:
    """A pendulum with random gravity, bounds and channels, and whether its mirror image is a solution too.

    Reflected about the axis of gravity a machine moves as before; what is measured along the axis stays, and only that.
    """
    scene, bodies = [("single-pendulum", ["OA"]), ("rigid-double-pendulum", ["OA", "AB"])][rng.integers(2)]
    gravity = GRAVITIES[rng.integers(4)]
    along = "x" if gravity[0] else "y"
    channels = [[along], [along], ["y" if along == "x" else "x"], ["x", "y"], ["angle", along]][rng.integers(5)]
    angles = {body: float(rng.uniform(-2.5, 2.5)) for body in bodies}
    wide = rng.random() < 0.6
    bounds = {body: (-3.3, 3.3) if wide else (angle - 0.6, angle + 0.5) for body, angle in angles.items()}
    parameters = {b: {"path": f"initial.{b}.angle", "lower": low, "upper": high} for b, (low, high) in bounds.items()}
    image = {body: (np.pi if along == "y" else 0.0) - angle for body, angle in angles.items()}
    turns = 2 * np.pi * np.arange(-1, 2)
    inside = all(np.any((bounds[b][0] <= a + turns) & (a + turns <= bounds[b][1])) for b, a in image.items())
    other = any(abs(np.sin((image[b] - angles[b]) / 2)) > 0.01 for b in bodies)
    truth = {f"initial.{body}.angle": angle for body, angle in angles.items()}
    found = problem(scene, parameters, channels, truth, values={"gravity": list(gravity)})
    return found, channels == [along] and inside and other


@pytest.mark.parametrize("seed", [*range(6), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(6, 206))])
@pytest.mark.by_day(2)
def test_mirror_images_are_ambiguous_where_the_bounds_hold_both(seed: int) -> None:
    rng = np.random.default_rng(seed)
    stated, mirrored = drawn(rng)
    found = identify(stated, method="least-squares" if len(stated.parameters) == 1 else None)
    if mirrored and found.verdict is Verdict.IDENTIFIED:
        # Nearly along the axis both are in one interval, which says all that is known.
        (value,) = found.parameters.values()
        axis = np.pi / 2 if stated.channels[0].quantity == "y" else 0.0
        offset = (value.value - axis + np.pi / 2) % np.pi - np.pi / 2
        assert value.lower <= value.value - 2 * offset <= value.upper
        return
    assert found.verdict is (Verdict.AMBIGUOUS if mirrored else Verdict.IDENTIFIED), found.message
    if mirrored:
        assert "mirror images" in found.message


def model(stated: Problem) -> ForwardModel:
    return ForwardModel(stated, stated.load_scene(), get_engine("gauss"), measure(stated, stated.load_scene()))


ANGLE = {"path": "initial.OA.angle", "lower": -3.0, "upper": 3.0}


def test_images_respect_the_bounds() -> None:
    narrow = {"path": "initial.AB.angle", "lower": -1.0, "upper": 1.0}
    seen = model(problem("rigid-double-pendulum", {"one": ANGLE, "two": narrow}, ["y"], {}))
    found = images(seen, np.array([0.8, 0.4]))
    assert len(found)
    assert np.all((found >= seen.lower) & (found <= seen.upper))
    assert any(np.allclose(point, (np.pi - 0.8, -0.4)) for point in found)


def test_a_curved_valley_is_one_place_and_a_mirror_image_another() -> None:
    """A free swing tells clock and gravity only together: g goes with the square of the clock."""
    parameters = {
        "angle": ANGLE,
        "clock": {"path": "measurement.clock", "lower": 0.5, "upper": 2.0},
        "g": {"path": "gravity.1", "lower": -25.0, "upper": -3.0},
    }
    truth = {"initial.OA.angle": 0.6}
    seen = model(problem("single-pendulum", parameters, ["y"], truth))
    there = seen.parameters.to_vector(np.array([0.6, 1.0, -9.81]))
    limit = 1.2 * float(seen.cost(seen.uncounted(there[None]))[0])
    beside = seen.parameters.to_vector(np.array([0.6, 1.4, -9.81 * 1.4**2]))
    assert connected(seen, there, beside, limit)
    image = seen.parameters.to_vector(np.array([np.pi - 0.6, 1.0, -9.81]))
    assert not connected(seen, there, image, limit)


@pytest.mark.parametrize(("centre", "start", "upper"), [(0.35, 0.3, 1.5), (0.8, 1.0, 1.5), (0.35, 0.3, 0.5)])
@pytest.mark.by_day(1)
def test_two_centres_of_mass_swing_alike(centre: float, start: float, upper: float, tmp_path: Path) -> None:
    """A pendulum of inertia I about its centre of mass, at a, has the angles of one at I / (m a) (Huygens)."""
    inertia, ends = 0.25, sorted([centre, 0.25 / centre])

    def slope(_: float, state: Sequence[float]) -> list[float]:
        return [state[1], -9.81 * centre * np.cos(state[0]) / (inertia + centre**2)]

    times = np.linspace(0.0, 3.0, 61)
    swing = solve_ivp(slope, (0.0, 3.0), [-0.5, 0.0], t_eval=times, rtol=1e-10, atol=1e-12).y[0]
    angle = swing + 0.05 * np.random.default_rng(3).standard_normal(61)
    table = tmp_path / "swing.csv"
    np.savetxt(table, np.column_stack([times, angle]), delimiter=",", header="t,angle", comments="")
    seen = {
        "name": "centre",
        "scene": "single-pendulum",
        "values": {"bodies.OA.inertia": inertia, "initial.OA.angle": -0.5},
        "parameters": {"a": {"path": "bodies.OA.centre_of_mass.0", "lower": 0.1, "upper": upper, "start": start}},
        "channels": [{"marker": "A", "quantity": "angle", "column": "angle"}],
        "noise": 0.05,
        "source": {"kind": "file", "path": str(table)},
    }
    found = identify(Problem.parse(seen, "centre"))
    if upper < ends[1]:
        assert found.verdict is Verdict.IDENTIFIED
        return
    assert found.verdict is Verdict.AMBIGUOUS
    told = sorted([found.parameters["a"].value, found.minima[0]["a"]])
    np.testing.assert_allclose(told, ends, rtol=0.03)


def test_a_swing_that_was_recorded_a_period_later_looks_alike() -> None:
    """The period is 4 K(sin(amplitude / 2)) sqrt(length / g)."""
    delay = {"path": "measurement.delay", "lower": 0.0, "upper": 3.0, "start": 0.2}
    truth = {"initial.OA.angle": -0.9}
    late = problem("single-pendulum", {"d": delay}, ["x", "y"], truth, values=truth)
    late = late.model_copy(update={"source": late.source.model_copy(update={"stop": 4.0, "delay": 0.3})})
    found = identify(late)
    assert found.verdict is Verdict.AMBIGUOUS
    assert "recorded in different ways" in found.message
    period = 4 * np.sqrt(1 / 9.81) * ellipk(np.sin((np.pi / 2 - 0.9) / 2) ** 2)
    np.testing.assert_allclose(abs(found.minima[0]["d"] - found.parameters["d"].value), period, rtol=1e-3)


OSCILLATOR = {
    "name": "oscillator",
    "gravity": [0.0, 0.0],
    "bodies": {"m": {"kind": "point-mass", "mass": 0.5}},
    "joints": {"rail": {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "m"}}},
    "loads": {
        "k": {
            "kind": "spring",
            "first": {"body": "ground", "point": [-0.3, 0.0]},
            "second": {"body": "m"},
            "stiffness": 2000.0,
            "length": 0.3,
        }
    },
    "markers": {"m": {"body": "m"}},
    "initial": {"m": {"position": [0.01, 0.0], "velocity": [0.0, 0.0]}},
    "solver": {"duration": 1.0, "samples": 100},
}


def oscillator(folder: Path, frequency: float, lower: float, upper: float, start: float, damping: float) -> Problem:
    """A mass of 0.5 kg on a spring, x = exp(-d t) 0.01 (cos w t + d / w sin w t), sampled at 40 Hz; bounds in Hz."""

    def stiffness(hertz: float) -> float:
        return 0.5 * (2 * np.pi * hertz) ** 2

    times = np.arange(0, 1, 1 / 40)
    w = np.sqrt((2 * np.pi * frequency) ** 2 - damping**2)
    x = 0.01 * np.exp(-damping * times) * (np.cos(w * times) + damping / w * np.sin(w * times))
    x += 1e-4 * np.random.default_rng(3).standard_normal(len(times))
    np.savetxt(folder / "x.csv", np.column_stack([times, x]), delimiter=",", header="t,x", comments="")
    (folder / "oscillator.yaml").write_text(json.dumps(OSCILLATOR))
    bounds = {"lower": stiffness(lower), "upper": stiffness(upper), "start": stiffness(start)}
    parameters = {"k": {"path": "loads.k.stiffness", **bounds}}
    if damping:
        parameters["c"] = {"path": "loads.k.damping", "lower": 1e-3, "upper": 50.0}
    stated = {
        "name": "alias",
        "scene": str(folder / "oscillator.yaml"),
        "parameters": parameters,
        "channels": [{"marker": "m", "quantity": "x", "column": "x"}],
        "noise": 1e-4,
        "source": {"kind": "file", "path": str(folder / "x.csv")},
    }
    return Problem.parse(stated, "alias")


@pytest.mark.parametrize("start", [9.0, pytest.param(28.0, marks=pytest.mark.slow)])
def test_a_stiffness_whose_frequency_the_samples_show_alike_is_ambiguous(start: float, tmp_path: Path) -> None:
    """cos(2 pi f t) is the same at multiples of 1 / 40 s for f = 10, 30 and 50 Hz."""
    found = identify(oscillator(tmp_path, 30.0, 5.0, 55.0, start, 0.0))
    assert found.verdict is Verdict.AMBIGUOUS
    assert "3 parameter sets" in found.message
    assert "the same at every sample" in found.message
    assert "sample more often" in found.advice[0]
    alike = [found.parameters["k"].value, *(other["k"] for other in found.minima if other["fitness"] < 4e-8)]
    frequencies = np.sqrt(np.array(sorted(alike)) / 0.5) / (2 * np.pi)
    np.testing.assert_allclose(frequencies, [10.0, 30.0, 50.0], rtol=1e-3)


def test_a_stiffness_that_fits_better_at_another_frequency_is_the_answer(tmp_path: Path) -> None:
    """Damping shifts the phase at the start by c / (2 m w), which tells 30 Hz from 10 Hz by more than the noise."""
    found = identify(oscillator(tmp_path, 30.0, 3.0, 45.0, 9.0, 4.0))
    assert found.verdict is Verdict.IDENTIFIED, found.message
    known = found.parameters["k"]
    assert known.value == pytest.approx(0.5 * (2 * np.pi * 30.0) ** 2, abs=4 * known.std)
    assert known.std < 1e-3 * known.value


@pytest.mark.slow
def test_bounds_that_hold_no_alias_leave_a_stiffness_identified(tmp_path: Path) -> None:
    found = identify(oscillator(tmp_path, 30.0, 21.0, 39.0, 28.0, 0.0))
    assert found.verdict is Verdict.IDENTIFIED, found.message


def test_an_angle_is_told_by_the_turn_nearest_to_its_start() -> None:
    """Bounds of several turns hold several angles for one pose."""
    for start in (0.0, 7.0, -5.5):
        angle = {"path": "initial.OA.angle", "lower": -10.0, "upper": 10.0, "start": start}
        found = identify(problem("single-pendulum", {"a": angle}, ["x", "y"], {"initial.OA.angle": 0.6}))
        nearest = 0.6 + 2 * np.pi * np.round((start - 0.6) / (2 * np.pi))
        assert found.verdict is Verdict.IDENTIFIED
        assert found.parameters["a"].value == pytest.approx(nearest, abs=0.01)
        assert found.parameters["a"].lower < nearest < found.parameters["a"].upper
    seen = model(problem("single-pendulum", {"a": {**angle, "lower": 2.0, "start": 3.0}}, ["x", "y"], {}))
    np.testing.assert_allclose(nearest_turns(seen, np.array([0.6 + 2 * np.pi])), 0.6 + 2 * np.pi)


@pytest.mark.parametrize(
    ("path", "lower", "scale", "logarithmic"),
    [
        ("bodies.OA.density", 1.0, "auto", True),
        ("bodies.OA.density", 1.0, "linear", False),
        ("joints.O.friction", 0.0, "auto", False),
        ("initial.OA.angle", 0.1, "auto", False),
        ("bodies.OA.centre_of_mass.0", 0.1, "auto", False),
        ("bodies.OA.centre_of_mass.0", 0.1, "log", True),
        ("measurement.clock", 0.5, "auto", True),
        ("measurement.delay", 0.5, "auto", False),
    ],
)
def test_positive_quantities_are_sought_by_their_logarithm(
    path: str, lower: float, scale: Any, logarithmic: bool
) -> None:
    assert Parameter(path=path, lower=lower, upper=10.0, scale=scale).logarithmic is logarithmic


def test_an_interval_that_reaches_what_cannot_be_is_not_known() -> None:
    """Friction of which the record tells only that it is small."""
    parameters = {"angle": ANGLE, "k": {"path": "joints.O.friction", "lower": 0.0, "upper": 10.0}}
    found = identify(problem("single-pendulum", parameters, ["x", "y"], {"initial.OA.angle": 0.6}))
    k = found.parameters["k"]
    assert k.lower < 0.0 < k.upper
    assert not k.identifiable
    assert found.parameters["angle"].identifiable
