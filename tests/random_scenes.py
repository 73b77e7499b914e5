"""Scenes drawn at random from the words that a scene knows, small and short, for tests that only ask for an answer."""

from __future__ import annotations

from typing import Any

import numpy as np

Random = np.random.Generator
PLANAR = ("rigid", "ancf-cable", "ancf-quintic", "simo-reissner", "modal", "rigid-body", "point-mass")
SPATIAL = ("rigid", "rigid-body", "ancf-cable", "director-rod", "point-mass")


def scene(seed: int) -> dict[str, Any]:
    """Return a tree of one to three bodies, in the plane or (each fourth) in space, with loads, drives and a start."""
    rng = np.random.default_rng(seed)
    dimensions = 3 if seed % 4 == 3 else 2
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    initial: dict[str, Any] = {}
    points: dict[str, Any] = {}
    end = np.zeros(2)
    parent: dict[str, Any] = {"body": "ground", "point": [0.0] * dimensions}
    if rng.random() < 0.2:
        points["P"] = {"x": f"{_drawn(rng, 0.01, 0.05)}*sin({_drawn(rng, 1, 9)}*t)"}
        parent = {"body": "ground", "point": "P"}
    kinds = SPATIAL if dimensions == 3 else PLANAR
    for name in ("crank", "arm", "load")[: int(rng.integers(1, 4))]:
        kind = str(rng.choice(kinds))
        angle = _drawn(rng, -2, 2)
        length = _drawn(rng, 0.3, 0.8)
        bodies[name] = _body(rng, kind, length, dimensions)
        joint = _joint(rng, kind, parent, name, dimensions, length)
        joints[f"to-{name}"] = joint
        if kind == "point-mass":
            if joint["kind"] == "distance":
                end = end + length * np.array([np.cos(angle), np.sin(angle)])
                initial[name] = {"position": [float(x) for x in end] + [0.0] * (dimensions - 2)}
            break
        initial[name] = {"angle": angle}
        if rng.random() < 0.3:
            initial[name]["rate"] = _drawn(rng, -3, 3)
        end = end + length * np.array([np.cos(angle), np.sin(angle)])
        parent = {"body": name, "point": "end"}
    last = list(bodies)[-1]
    tip = {"body": last} if bodies[last]["kind"] == "point-mass" else {"body": last, "point": "end"}
    drawn: dict[str, Any] = {
        "name": f"drawn-{seed}",
        "dimensions": dimensions,
        "gravity": [0.0, -9.81] if dimensions == 2 else [0.0, 0.0, -9.81],
        "bodies": bodies,
        "joints": joints,
        "loads": _loads(rng, bodies, last, tip, dimensions),
        "ground_points": points,
        "markers": {"tip": tip},
        "initial": initial,
        "solver": {"duration": 0.1, "samples": 5},
    }
    if rng.random() < 0.15:
        drawn["initial"] = {"from": "statics"} | {name: {"angle": -1.5} for name in initial if "angle" in initial[name]}
    if rng.random() < 0.2:
        drawn["solver"]["integrator"] = str(rng.choice(["leapfrog", "rk4", "generalized-alpha", "radau5"]))
        drawn["solver"]["step"] = 1e-4
    return drawn


def _drawn(rng: Random, low: float, high: float) -> float:
    return float(np.round(rng.uniform(low, high), 4))


def _body(rng: Random, kind: str, length: float, dimensions: int) -> dict[str, Any]:
    if kind == "point-mass":
        return {"kind": kind, "mass": _drawn(rng, 0.05, 0.5)}
    if kind == "rigid-body":
        inertia: Any = _drawn(rng, 0.01, 0.05)
        middle, far = [length / 2, 0.0, 0.0][:dimensions], [length, 0.0, 0.0][:dimensions]
        return {
            "kind": kind,
            "mass": _drawn(rng, 0.2, 2),
            "inertia": [0.5 * inertia, inertia, inertia] if dimensions == 3 else inertia,
            "centre_of_mass": middle,
            "named_points": {"end": far},
        }
    rod: dict[str, Any] = {"kind": "rod", "length": length, "height": 0.01, "width": 0.01, "density": 2700.0}
    if dimensions == 3 and rng.random() < 0.5:
        rod |= {"section": "round"}
        rod.pop("width")
    if kind == "rigid":
        return rod
    rod |= {"element": kind, "youngs_modulus": float(10 ** rng.uniform(8, 10.5))}
    if kind != "modal":
        rod["elements"] = int(rng.integers(1, 4))
    return rod


def _joint(rng: Random, kind: str, parent: dict[str, Any], name: str, dimensions: int, length: float) -> dict[str, Any]:
    joint: dict[str, Any] = {"first": parent, "second": {"body": name}}
    if kind == "point-mass":
        if rng.random() < 0.5 and parent["body"] != "ground":
            return joint | {"kind": "spherical" if dimensions == 3 else "revolute"}
        return joint | {"kind": "distance", "length": length}
    chosen = str(rng.choice(["hinge", "weld", "ball"], p=[0.7, 0.15, 0.15]))
    if chosen == "weld" and parent["body"] == "ground":
        return joint | {"kind": "weld"}
    if dimensions == 3 and chosen == "ball":
        return joint | {"kind": "spherical"}
    if rng.random() < 0.3:
        joint |= {"friction": _drawn(rng, 0.001, 0.1)}
    if rng.random() < 0.15:
        joint |= {"coulomb": _drawn(rng, 0.01, 0.1), "coulomb_speed": 0.1}
    if rng.random() < 0.15:
        joint |= {"drag": _drawn(rng, 0.001, 0.05)}
    return joint | {"kind": "revolute"}


def _loads(rng: Random, bodies: dict[str, Any], last: str, tip: dict[str, Any], dimensions: int) -> dict[str, Any]:
    loads: dict[str, Any] = {}
    far = [0.3, 1.0, 0.0][:dimensions]
    if rng.random() < 0.3:
        anchor = {"body": "ground", "point": far}
        loads["spring"] = {"kind": "spring", "first": anchor, "second": tip, "stiffness": _drawn(rng, 5, 300)}
    if rng.random() < 0.3:
        loads["push"] = {
            "kind": "force",
            "at": tip,
            "force": [1.0, 0.5, 0.2][:dimensions],
            "scale": str(rng.choice(["1", "sin(20*t)", "step(t - 0.05)"])),
        }
    if rng.random() < 0.2 and bodies[last]["kind"] != "point-mass":
        loads["twist"] = {"kind": "torque", "at": {"body": last}, "torque": _drawn(rng, 0.01, 0.2)}
    first = next(iter(bodies))
    if rng.random() < 0.2 and bodies[first]["kind"] == "rod":
        loads["wind"] = {"kind": "distributed-force", "body": first, "force": [0.5, 0.2, 0.0][:dimensions]}
    if rng.random() < 0.2 and bodies[first]["kind"] != "point-mass":
        ground = {"body": "ground", "point": [0.0] * dimensions}
        loads["coil"] = {
            "kind": "torsion-spring",
            "first": ground,
            "second": {"body": first},
            "stiffness": _drawn(rng, 0.5, 20),
        }
    return loads
