"""Moduli, stiffness, masses and lengths that are started wrong by factors of 2 to 3: the default method finds them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from shoal.engines import get_engine
from shoal.identification import Estimate, Problem, Verdict, identify
from shoal.identification.forward import ForwardModel
from shoal.identification.measure import measure
from shoal.identification.methods.lanes import descend_many
from shoal.scene import Scene, load_scene

NOISE = 1e-3
BASE = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "OA", "point": "start"}}
ANGLE = {"lower": -3.0, "upper": 3.0}


def rod(rng: np.random.Generator, **more: Any) -> dict[str, Any]:
    length = float(rng.uniform(0.4, 1.2))
    return {"kind": "rod", "length": length, "height": 0.02 * length, "width": 0.04, "density": 2000.0, **more}


def bending(rng: np.random.Generator, body: dict[str, Any], periods: float, duration: float) -> dict[str, Any]:
    """The rod with a modulus for which it bends so many times over a record [s], pinned at one end."""
    frequency = 2 * np.pi * periods / duration
    modulus = 12 * body["density"] * (frequency * body["length"] ** 2 / 15.418 / body["height"]) ** 2
    return {**body, "youngs_modulus": modulus, "element": "ancf-cable", "elements": 2}


def sprung(rng: np.random.Generator) -> tuple[dict[str, Any], list[str], list[str]]:
    """A rod on a torsion spring that swings 2 to 12 times: stiffness, damping."""
    body, duration = rod(rng), float(rng.uniform(1.0, 3.0))
    inertia = body["density"] * body["height"] * body["width"] * body["length"] ** 3 / 3
    frequency = 2 * np.pi * rng.uniform(2.0, 12.0) / duration
    spring = {"kind": "torsion-spring", **BASE, "stiffness": inertia * frequency**2}
    spring |= {"damping": 0.05 * inertia * frequency, "angle": 0.0}
    scene = {"bodies": {"OA": body}, "joints": {"O": {"kind": "revolute", **BASE}}, "loads": {"S": spring}}
    return machine(scene, {"OA": rng.uniform(0.3, 1.0)}, duration), ["loads.S.stiffness", "loads.S.damping"], ["A"]


def swinging(rng: np.random.Generator) -> tuple[dict[str, Any], list[str], list[str]]:
    """A pendulum of which only the angle is seen: length, friction."""
    body = rod(rng)
    scene = {"bodies": {"OA": body}, "joints": {"O": {"kind": "revolute", "friction": 0.02, **BASE}}}
    found = machine(scene, {"OA": rng.uniform(-1.2, 0.0)}, float(rng.uniform(3.0, 12.0)), gravity=-9.81)
    return found, ["bodies.OA.length", "joints.O.friction"], ["angle"]


def double(rng: np.random.Generator) -> tuple[dict[str, Any], list[str], list[str]]:
    """A double pendulum of which both angles are seen: lengths, a density."""
    elbow = {"first": {"body": "OA", "point": "end"}, "second": {"body": "AB", "point": "start"}}
    joints = {"O": {"kind": "revolute", **BASE}, "A": {"kind": "revolute", **elbow}}
    scene = {"bodies": {"OA": rod(rng), "AB": rod(rng)}, "joints": joints}
    angles = {"OA": rng.uniform(-1.3, -0.3), "AB": rng.uniform(-1.3, 0.3)}
    found = machine(scene, angles, float(rng.uniform(1.0, 3.0)), gravity=-9.81)
    return found, ["bodies.OA.length", "bodies.AB.length", "bodies.AB.density"], ["angle"]


def bent(rng: np.random.Generator) -> tuple[dict[str, Any], list[str], list[str]]:
    """A flexible pendulum that bends 1 to 10 times: its modulus."""
    duration = float(rng.uniform(0.3, 0.6))
    body = bending(rng, rod(rng), float(rng.uniform(1.0, 10.0)), duration)
    scene = {"bodies": {"OA": body}, "joints": {"O": {"kind": "revolute", **BASE}}}
    found = machine(scene, {"OA": rng.uniform(-0.5, 0.8)}, duration, gravity=-9.81)
    return found, ["bodies.OA.youngs_modulus"], ["M", "A"]


def bent_twice(rng: np.random.Generator) -> tuple[dict[str, Any], list[str], list[str]]:
    """A flexible double pendulum whose rods bend 1 to 6 times: both moduli."""
    duration = float(rng.uniform(0.3, 0.6))
    one, two = (bending(rng, rod(rng), float(rng.uniform(1.0, 6.0)), duration) for _ in range(2))
    elbow = {"first": {"body": "OA", "point": "end"}, "second": {"body": "AB", "point": "start"}}
    joints = {"O": {"kind": "revolute", **BASE}, "A": {"kind": "revolute", **elbow}}
    angles = {"OA": rng.uniform(-0.5, 0.8), "AB": rng.uniform(-0.5, 0.8)}
    found = machine({"bodies": {"OA": one, "AB": two}, "joints": joints}, angles, duration, gravity=-9.81)
    return found, ["bodies.OA.youngs_modulus", "bodies.AB.youngs_modulus"], ["A", "B"]


KINDS = (sprung, swinging, double, bent, bent_twice)


def machine(scene: dict[str, Any], angles: dict[str, float], duration: float, gravity: float = 0.0) -> dict[str, Any]:
    """The scene with markers at the ends and in the middle of its bodies."""
    markers = {
        "A": {"body": "OA", "point": "end"},
        "M": {"body": "OA", "point": [scene["bodies"]["OA"]["length"] / 2, 0.0]},
    }
    if "AB" in scene["bodies"]:
        markers["B"] = {"body": "AB", "point": "end"}
    initial = {name: {"angle": float(angle)} for name, angle in angles.items()}
    solver = {"duration": duration, "step": 1e-3, "samples": 100}
    return {"name": "m", "gravity": [0.0, gravity], "markers": markers, "initial": initial, "solver": solver, **scene}


def drawn(seed: int, folder: Path) -> tuple[Problem, dict[str, float]]:
    """A problem whose positive parameters start wrong by factors of 2 to 3, and the true values."""
    rng = np.random.default_rng(seed)
    data, paths, seen = KINDS[seed % len(KINDS)](rng)
    scene, path = Scene.parse(data, "m"), folder / f"{seed}.yaml"
    path.write_text(yaml.safe_dump(data))
    parameters: dict[str, Any] = {b: {"path": f"initial.{b}.angle", **ANGLE} for b in data["bodies"]}
    truth = {b: float(data["initial"][b]["angle"]) for b in data["bodies"]}
    for name in paths:
        true = float(scene.value(name))
        start = true * rng.uniform(2.0, 3.0) ** rng.choice([-1.0, 1.0])
        bounds = {"lower": true / rng.uniform(4.0, 10.0), "upper": true * rng.uniform(4.0, 10.0)}
        parameters[name.replace(".", "_")] = {"path": name, "start": float(start), **bounds}
        truth[name.replace(".", "_")] = true
    angles = [{"marker": m, "quantity": "angle"} for m in ("A", "B") if m in data["markers"]]
    places = [{"marker": m, "quantity": q} for m in seen for q in ("x", "y")]
    source = {
        "kind": "engine",
        "engine": "gauss",
        "stop": scene.solver.duration,
        "count": 100,
        "noise": NOISE,
        "seed": seed,
    }
    stated = {"name": "m", "scene": str(path), "parameters": parameters, "source": source, "noise": NOISE}
    return Problem.parse({**stated, "channels": angles if seen == ["angle"] else places}, "m"), truth


def outcome(seed: int, folder: Path) -> tuple[Estimate, bool]:
    """The default answer, and whether it stands where a descent from the truth ends."""
    problem, truth = drawn(seed, folder)
    measurement = measure(problem, problem.load_scene())
    model = ForwardModel(problem, problem.load_scene(), get_engine("gauss"), measurement)
    there = model.parameters.to_vector(np.array([truth[name] for name in model.names]))
    best = descend_many(model, there[None])[0]
    found = identify(problem, measurement=measurement)
    return found, found.fitness <= 1.001 * best.fitness


FAST = (0, 3, 7, 18)


@pytest.mark.parametrize("seed", [pytest.param(s, marks=() if s in FAST else pytest.mark.slow) for s in range(60)])
@pytest.mark.by_day(2)
def test_the_answer_is_where_a_descent_from_the_truth_ends(seed: int, tmp_path: Path) -> None:
    found, at_truth = outcome(seed, tmp_path)
    assert at_truth, found.message
    # A small vibration may be hidden by the noise, and then another modulus is as good.
    assert found.verdict.trusted or found.verdict is Verdict.AMBIGUOUS, found.message


def test_lanes_of_different_lengths_reach_as_far_as_they_are_long() -> None:
    """A pendulum five times as long as the scene says leaves the circle of the scene's own length."""
    lengths = np.array([0.2, 1.0, 5.0])
    run = get_engine("gauss").simulate_many(
        load_scene("rigid-double-pendulum"), {"bodies.OA.length": lengths}, np.array([0.1])
    )
    assert [str(status) for status in run.status] == ["ok"] * 3
