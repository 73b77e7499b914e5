"""Other starts that show the same: whole turns between samples, mirror images in space, by closed forms and scipy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from shoal.engines import get_engine
from shoal.identification import Estimate, Problem, Verdict, identify
from shoal.identification.diagnostics.minima.aliases import more_turns
from shoal.identification.diagnostics.minima.mirrors import mirror_images
from shoal.identification.diagnostics.minima.other_starts import mirrored, turned
from shoal.identification.diagnostics.minima.rivals import apart
from shoal.identification.diagnostics.minima.search import followed
from shoal.identification.diagnostics.minima.turns import nearest_turns
from shoal.identification.forward import ForwardModel
from shoal.identification.measure import measure
from shoal.identification.methods.lanes import descend_many
from shoal.identification.methods.outcome import Outcome
from shoal.trajectory import Array

NOISE = 5e-4
Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
OBLIQUE = np.array([1.0, 2.0, 2.0]) / 3
TURN = 2 * np.pi * 10
"""The rate [rad/s] of a turn from each sample to the next, at 10 Hz."""
TIMES = np.linspace(0.0, 2.0, 21)


def rotor(axis: Array | None = None, friction: float = 0.0) -> dict[str, Any]:
    """A wheel on a hinge, in space about an axis, else in the plane: its marker is 0.1 m away along x at angle zero."""
    plane = axis is None
    hinge = {"kind": "revolute", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "w"}}
    return {
        "name": "rotor",
        "dimensions": 2 if plane else 3,
        "gravity": [0, 0],
        "bodies": {"w": {"kind": "rigid-body", "mass": 2.0, "inertia": 0.02}},
        "joints": {"h": {**hinge, "friction": friction, **({} if axis is None else {"axis": axis.tolist()})}},
        "markers": {"m": {"body": "w", "point": [0.1, 0]}},
        "initial": {"w": {"rate": 20.0} if plane else {"rotation": [0, 0, 0], "spin": [0, 0, 0]}},
        "solver": {"duration": 2.0},
    }


def problem(
    folder: Path,
    scene: dict[str, Any],
    parameters: dict[str, Any],
    seen: dict[tuple[str, str], Array],
    ties: dict[str, str] | None = None,
    times: Array = TIMES,
) -> Problem:
    """Of places by marker and axis, to which noise is added."""
    (folder / "scene.yaml").write_text(json.dumps(scene))
    rng = np.random.default_rng(3)
    table = [times, *(values + NOISE * rng.standard_normal(len(times)) for values in seen.values())]
    names = ",".join(["t", *("".join(key) for key in seen)])
    np.savetxt(folder / "run.csv", np.column_stack(table), delimiter=",", header=names, comments="")
    channels = [{"marker": m, "quantity": axis, "column": f"{m}{axis}"} for m, axis in seen]
    source = {"kind": "file", "path": str(folder / "run.csv")}
    stated = {"name": "one", "scene": str(folder / "scene.yaml"), "parameters": parameters, "channels": channels}
    return Problem.parse({**stated, "ties": ties or {}, "noise": NOISE, "source": source}, "one")


def modelled(stated: Problem) -> ForwardModel:
    return ForwardModel(stated, stated.load_scene(), get_engine("gauss"), measure(stated, stated.load_scene()))


def places(marker: str, at: Array, axes: str = "xyz") -> dict[tuple[str, str], Array]:
    """Channels of places (samples, 3)."""
    return {(marker, axis): at[:, "xyz".index(axis)] for axis in axes}


def about(axis: Array, angles: Array, point: Array) -> Array:
    """A point turned about an axis by angles, (samples, 3)."""
    return np.asarray(Rotation.from_rotvec(np.outer(angles, axis)).apply(point))


def as_good(found: Estimate, name: str) -> list[float]:
    """The values of a parameter at the answer and at the minima that fit alike."""
    alike = [other[name] for other in found.minima if other["fitness"] < 1.2 * found.fitness]
    return sorted([found.parameters[name].value, *alike])


@pytest.mark.parametrize("upper", [pytest.param(110.0, marks=pytest.mark.slow), 60.0])
def test_whole_turns_between_samples_are_told_of_a_hinge_in_space(upper: float, tmp_path: Path) -> None:
    """95 - 2 pi 10 = 32.17 rad/s looks alike."""
    spin = {"s": {"path": "initial.w.spin.2", "lower": 0.0, "upper": upper, "start": 30.0}}
    seen = places("m", about(Z, 95.0 * TIMES, np.array([0.1, 0.0, 0.0])))
    found = identify(problem(tmp_path, rotor(Z), spin, seen), method="least-squares")
    true = np.array([95.0 - TURN, 95.0])
    np.testing.assert_allclose(as_good(found, "s"), true[true < upper], atol=0.02)
    assert found.verdict is (Verdict.IDENTIFIED if upper < 95.0 else Verdict.AMBIGUOUS), found.message
    assert ("the same at every sample" in found.message) is (upper > 95.0)


def test_whole_turns_between_samples_are_told_of_a_free_body(tmp_path: Path) -> None:
    """A body that spins about a principal axis goes on doing so."""
    scene = {
        "name": "free",
        "dimensions": 3,
        "gravity": [0, 0, 0],
        "bodies": {"b": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.02, 0.02, 0.03]}},
        "joints": {},
        "markers": {"p": {"body": "b", "point": [0.1, 0, 0]}, "q": {"body": "b", "point": [0, 0, 0.1]}},
        "initial": {"b": {"position": [0, 0, 0], "velocity": [0, 0, 0], "rotation": [0, 0, 0], "spin": [0, 0, 0]}},
        "solver": {"duration": 2.0},
    }
    spins = {f"s{k}": {"path": f"initial.b.spin.{k}", "lower": -90.0, "upper": 60.0} for k in range(3)}
    seen = {
        **places("p", about(Z, 40.0 * TIMES, np.array([0.1, 0.0, 0.0]))),
        **places("q", np.tile(0.1 * Z, (len(TIMES), 1))),
    }
    free = modelled(problem(tmp_path, scene, spins, seen))
    (end,) = descend_many(free, np.array([[0.0, 0.0, 40.0 - 2 * TURN]]))
    begun = Outcome(end.point, end.fitness, end.rows, end.message)
    found = followed(free, begun, mirror_images(free, begun), "a mirror image")
    alike = [point for point, fitness in [(found.point, found.fitness), *found.minima] if fitness < 1.2 * end.fitness]
    assert np.min(np.abs(np.array(alike)[:, 2] - 40.0)) < 0.02


@pytest.mark.parametrize("axis", [None, pytest.param(Z, marks=pytest.mark.slow)])
def test_a_misfit_by_too_few_turns_leads_on_to_the_true_ones(axis: Array | None, tmp_path: Path) -> None:
    """A wheel slows down by friction, w = 95 exp(-c t): too slow a one fits, with too much friction, but not well."""
    slowing = 0.002 / 0.02
    angles = 95.0 / slowing * (1.0 - np.exp(-slowing * TIMES))
    seen = places("m", about(Z, angles, np.array([0.1, 0.0, 0.0])), "xy")
    path = "initial.w.rate" if axis is None else "initial.w.spin.2"
    sought = {
        "s": {"path": path, "lower": 0.0, "upper": 120.0, "start": 20.0},
        "k": {"path": "joints.h.friction", "lower": 1e-5, "upper": 0.1},
    }
    wheel = modelled(problem(tmp_path, rotor(axis, 0.002), sought, seen))
    (end,) = descend_many(wheel, wheel.parameters.to_vector(np.array([[95.0 - TURN, 0.006]])))
    assert end.fitness > 10 * NOISE**2
    begun = Outcome(end.point, end.fitness, end.rows, end.message)
    found = followed(wheel, begun, more_turns(wheel, begun), "more turns")
    assert [one.code for one in found.findings] == ["better-minimum-followed"]
    np.testing.assert_allclose(wheel.parameters.to_values(found.point), [95.0, 0.002], rtol=2e-3)
    assert found.fitness < 3 * NOISE**2


def pendulum(rotation: list[float], axis: Array) -> dict[str, Any]:
    """A thin rod of 0.6 m on a hinge in space, under gravity along -z."""
    return {
        "name": "pendulum",
        "dimensions": 3,
        "gravity": [0, 0, -9.81],
        "bodies": {"r": {"kind": "rod", "length": 0.6, "height": 0.01, "width": 0.01, "density": 2700.0}},
        "joints": {
            "h": {
                "kind": "revolute",
                "axis": axis.tolist(),
                "first": {"body": "ground", "point": [0, 0, 0]},
                "second": {"body": "r"},
            }
        },
        "markers": {"e": {"body": "r", "point": "end"}},
        "initial": {"r": {"rotation": rotation, "spin": [0, 0, 0]}},
        "solver": {"duration": 1.5},
    }


ANGLE = {"path": "initial.r.rotation.1", "lower": -3.2, "upper": 3.2, "start": 0.7}
RATE = {"path": "initial.r.spin.1", "lower": -10.0, "upper": 10.0, "start": 0.0}


@pytest.mark.parametrize(("axes", "upper"), [("z", 3.2), ("xz", 3.2), ("z", 1.5)])
@pytest.mark.by_day(1)
def test_a_height_tells_no_pendulum_in_space_from_its_mirror_image(axes: str, upper: float, tmp_path: Path) -> None:
    """About y, downwards: the angle 2.5 with the rate -1 is pi - 2.5 with 1 from the other side."""
    times = np.linspace(0.0, 1.5, 61)

    def slope(_: float, state: Any) -> list[float]:
        return [state[1], 1.5 * 9.81 / 0.6 * np.cos(state[0])]

    true = (np.pi - 2.5, 1.0) if upper < 2.5 else (2.5, -1.0)
    swing = solve_ivp(slope, (0.0, 1.5), true, t_eval=times, rtol=1e-10, atol=1e-12).y[0]
    seen = places("e", 0.6 * np.stack([np.cos(swing), 0.0 * swing, -np.sin(swing)], axis=1), axes)
    sought = {"a": {**ANGLE, "upper": upper}, "w": RATE}
    found = identify(problem(tmp_path, pendulum([0, 0.7, 0], Y), sought, seen, times=times), method="least-squares")
    if axes == "z" and upper > 2.5:
        assert found.verdict is Verdict.AMBIGUOUS, found.message
        assert "mirror images" in found.message
        np.testing.assert_allclose(as_good(found, "a"), [np.pi - 2.5, 2.5], atol=5e-3)
        np.testing.assert_allclose(as_good(found, "w"), [-1.0, 1.0], atol=3e-2)
        return
    assert found.verdict is Verdict.IDENTIFIED, found.message
    assert found.parameters["a"].value == pytest.approx(true[0], abs=5e-3)


def model(folder: Path, scene: dict[str, Any], parameters: dict[str, Any], **ties: str) -> ForwardModel:
    seen = places("e", np.outer(np.sin(TIMES), np.ones(3)))
    return modelled(problem(folder, scene, parameters, seen, {p.replace("_", "."): text for p, text in ties.items()}))


def test_images_are_starts_that_the_parameters_can_make(tmp_path: Path) -> None:
    """Within the bounds, and no other numbers of the start changed: the tilted rod has no mirror image by its spin."""
    both = model(tmp_path, pendulum([0, 0.7, 0], Y), {"a": ANGLE, "w": RATE})
    name = next(iter(both.measurement.recordings))
    found = np.array(list(mirrored(both, np.array([0.7, 1.0]), name)))
    assert np.all((found >= both.lower) & (found <= both.upper))
    for image in ([np.pi - 0.7, -1.0], [-0.7, -1.0], [0.7 - np.pi, 1.0]):
        assert np.min(np.max(np.abs(found - image), axis=1)) < 1e-6
    alone = model(tmp_path, pendulum([0, 0.7, 0], Y), {"w": RATE})
    assert all(np.allclose(image, 1.0) for image in mirrored(alone, np.array([1.0]), name))


def test_more_turns_stay_on_the_axis_of_a_hinge(tmp_path: Path) -> None:
    """Of a spin along an oblique axis, that stands in ties, and within the bounds."""
    tied = {f"initial_r_spin_{k}": f"s*{part}" for k, part in enumerate(OBLIQUE.tolist())}
    seen = model(tmp_path, pendulum([0, 0, 0], OBLIQUE), {"s": {"lower": -100.0, "upper": 100.0}}, **tied)
    found = np.array(list(turned(seen, np.array([5.0]))))
    np.testing.assert_allclose(np.unique(np.round(found, 6)), np.round([5.0 - TURN, 5.0 + TURN], 6))


def test_rotation_vectors_that_are_whole_turns_apart_are_one_attitude(tmp_path: Path) -> None:
    """About one axis; with another component beside, that is not sought, they are two."""
    wide = {"a": {**ANGLE, "lower": -7.0, "upper": 7.0}, "w": RATE}
    seen = model(tmp_path, pendulum([0, 0.7, 0], Y), wide)
    start, beyond = np.array([0.5, 1.0]), np.array([0.5 - 2 * np.pi, 1.0])
    assert not apart(seen, start, beyond)
    assert apart(seen, start, -start)
    np.testing.assert_allclose(nearest_turns(seen, beyond), start)
    beside = model(tmp_path, pendulum([0.3, 0.7, 0], Y), wide)
    assert apart(beside, start, beyond)
    one, other = (Rotation.from_rotvec([0.3, point[0], 0.0]) for point in (start, beyond))
    assert (one.inv() * other).magnitude() > 0.1
