"""Machines drawn at random with the default settings: what is called right is, and what is right is called so.

Judged by Exudyn on the same mesh at a step ten times shorter.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.sources import WRONG
from shoal.engines.verification import verified
from shoal.errors import ComputationError, InputError
from shoal.scene import Rod, Scene
from shoal.trajectory import Trajectory

Random = np.random.Generator
FEW, MANY, DAMPED, DRAGGED = 1, 60, 100, 140


def machine(seed: int) -> Scene:
    """A chain of one to three rods or a four-bar linkage, driven or not, with springs, dampers and friction or not.

    From the seed DAMPED on, flexible rods may lose energy in themselves, and joints to dry friction; from DRAGGED on
    to quadratic drag as well.
    """
    rng = np.random.default_rng(seed)
    loop = rng.random() < 0.3
    names = ["a", "b", "c"][: 3 if loop else int(rng.integers(1, 4))]
    lengths = dict(zip(names, (0.5, 1.0, 0.7) if loop else rng.uniform(0.4, 1.2, 3), strict=False))
    bodies = {name: _rod(rng, float(length)) for name, length in lengths.items()}
    drive = rng.choice(["none", "point", "angle"], p=[0.5, 0.25, 0.25])
    base: dict[str, Any] = {"body": "ground", "point": "P" if drive == "point" else [0.0, 0.0]}
    joints: dict[str, Any] = {"O": {"first": base, "second": _at("a", "start")}}
    for one, other in pairwise(names):
        end = "end" if loop and other == "c" else "start"
        joints[f"{one}{other}"] = {"first": _at(one, "end"), "second": _at(other, end)}
    initial: dict[str, Any] = {name: {"angle": float(rng.uniform(-3, 3))} for name in names}
    if loop:
        joints["C"] = {"first": {"body": "ground", "point": [0.9, 0.0]}, "second": _at("c", "start")}
        initial = {"a": {"angle": 1.4}, "b": {"angle": 0.18808402310337824}, "c": {"angle": 1.329390049292321}}
    elif rng.random() < 0.3:
        rate = float(rng.uniform(-25, 25))
        initial = {name: {"angle": 0.3, "rate": rate} for name in names}
    points = {}
    if drive == "point":
        points["P"] = {"x": f"{rng.uniform(0.02, 0.1)}*sin({rng.uniform(1, 12)}*t)"}
    if drive == "angle":
        bodies["a"] = bodies["a"] | {"element": "rigid"}
        start = initial["a"]["angle"]
        angle = f"{start} + {rng.uniform(0.1, 0.5)}*(1 - cos({rng.uniform(1, 8)}*t))"
        joints["D"] = {"kind": "driven-angle", "first": base, "second": _at("a", "start"), "angle": angle}
        initial = {name: {"angle": here["angle"]} for name, here in initial.items()}
    loads: dict[str, Any] = {}
    if rng.random() < 0.3:
        anchor = {"body": "ground", "point": [0.3, 1.0]}
        stiffness, damping = float(rng.uniform(5, 500)), float(rng.uniform(0, 2))
        end = _at(names[-1], "end")
        loads["s"] = {"kind": "spring", "first": anchor, "second": end, "stiffness": stiffness, "damping": damping}
    if rng.random() < 0.3:
        joints["O"]["friction"] = float(rng.uniform(0, 0.2))
    if seed >= DAMPED:
        for name, body in bodies.items():
            if body["element"] != "rigid" and rng.random() < 0.5:
                bodies[name] = body | {"retardation": float(10 ** rng.uniform(-5, -2.5))}
        for joint in ("O", "ab"):
            if joint in joints and rng.random() < 0.4:
                dry = {
                    "coulomb": float(10 ** rng.uniform(-2, 0.3)),
                    "coulomb_speed": float(10 ** rng.uniform(-2, -0.5)),
                }
                joints[joint] |= dry
    if seed >= DRAGGED:
        for joint in ("O", "ab"):
            if joint in joints:
                joints[joint]["drag"] = float(10 ** rng.uniform(-3, -0.5))
    return Scene.parse(
        {
            "name": f"machine-{seed}",
            "bodies": bodies,
            "joints": joints,
            "loads": loads,
            "ground_points": points,
            "markers": {name: _at(name, "end") for name in names},
            "initial": initial,
            "solver": {"duration": 0.5, "samples": 10},
        }
    )


def _rod(rng: Random, length: float) -> dict[str, Any]:
    rod = {"kind": "rod", "length": length, "height": 0.01, "width": 0.02, "density": 2700.0, "element": "rigid"}
    if rng.random() < 0.25:
        return rod
    modulus = float(10 ** rng.uniform(7.5, 11))
    return rod | {"youngs_modulus": modulus, "element": "ancf-cable", "elements": int(rng.integers(2, 6))}


def _at(body: str, point: str) -> dict[str, str]:
    return {"body": body, "point": point}


def fault(seed: int) -> str:
    """What is wrong with the verdict on a machine; empty if nothing is."""
    scene = machine(seed)
    run = verified(get_engine("gauss"), scene)
    try:
        judge = get_engine("exudyn").simulate(scene.with_values({"solver.step": 1e-4}))
    except (InputError, ComputationError):
        judge = None
    estimates = run.model.get("verification", {})
    if not run.ok:
        right = (
            judge is None
            or not judge.ok
            or turned(run, judge) > WRONG
            or ("mesh-too-coarse" in run.codes and mesh_matters(scene, estimates["scale"]))
        )
        return "" if right else f"{run.status[0]}: {run.message}"
    if estimates["time_error"] is None:
        return f"not estimated: {estimates['note']}"
    if judge is None or not judge.ok:
        return ""
    away, allowed = run.distance(judge), 3 * estimates["time_error"] + 2e-3 * estimates["scale"]
    return "" if away <= allowed else f"{away:.2g} m away, estimated {estimates['time_error']:.2g} m"


def turned(run: Trajectory, judge: Trajectory) -> float:
    """The largest difference of an angle [rad]: a soft rod's end may have turned too far where its place is right."""
    return max(float(np.abs(run.angle(name) - judge.angle(name)).max()) for name in run.markers)


def mesh_matters(scene: Scene, scale: float) -> bool:
    """Whether Exudyn is far from itself on twice as many elements, for which it needs shorter steps."""
    rods = {name: body.elements for name, body in scene.bodies.items() if isinstance(body, Rod)}
    finer = {f"bodies.{name}.elements": 2 * count for name, count in rods.items()}
    runs = [get_engine("exudyn").simulate(scene.with_values({**more, "solver.step": 2e-5})) for more in ({}, finer)]
    return all(run.ok for run in runs) and runs[0].distance(runs[1]) > WRONG * scale


@pytest.mark.parametrize("seed", range(FEW))
@pytest.mark.slow
def test_the_verdict_on_a_few_machines_is_right(seed: int) -> None:
    assert fault(seed) == ""


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(FEW, MANY), *range(DAMPED, DRAGGED + 20)])
def test_the_verdict_on_many_machines_is_right(seed: int) -> None:
    assert fault(seed) == ""
