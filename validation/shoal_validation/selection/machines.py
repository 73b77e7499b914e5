"""Random machines: chains of one to four rods with loads, over six decades of stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from shoal.scene import Scene


@dataclass(frozen=True)
class Draw:
    """A machine and the accuracy that is asked of it [m]."""

    seed: int
    scene: Scene
    tolerance: float


def draw(seed: int) -> Draw:
    """The machine of a seed: moduli around 1e6 to 1e12 Pa, a tolerance between 1e-4 and 1e-2 of its length."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 5))
    names = ["A", "B", "C", "D"][:count]
    modulus = _log(rng, 1e6, 1e12)
    bodies = {name: _rod(rng, modulus) for name in names}
    joints = {f"to-{name}": _joint(rng, names, index) for index, name in enumerate(names)}
    length = sum(body["length"] for body in bodies.values())
    scene = {
        "name": f"machine-{seed}",
        "bodies": bodies,
        "joints": joints,
        "markers": {name: {"body": name, "point": "end"} for name in (names[-1], names[0])},
        "initial": {name: {"angle": float(rng.uniform(-np.pi, np.pi))} for name in names},
        "loads": _loads(rng, bodies),
        "solver": {"duration": float(rng.uniform(0.2, 0.6)), "samples": 50},
    }
    return Draw(seed, Scene.parse(scene), float(length * _log(rng, 1e-4, 1e-2)))


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _rod(rng: np.random.Generator, modulus: float) -> dict[str, Any]:
    length = _log(rng, 0.2, 2.0)
    return {
        "kind": "rod",
        "length": length,
        "height": length * _log(rng, 0.01, 0.05),
        "width": length * 0.04,
        "density": _log(rng, 1000.0, 8000.0),
        "youngs_modulus": modulus * _log(rng, 0.3, 3.0),
        "element": str(rng.choice(["rigid", "ancf-cable", "ancf-quintic"])),
        "elements": int(rng.integers(1, 9)),
    }


def _mass(rod: dict[str, Any]) -> float:
    return float(rod["density"] * rod["length"] * rod["height"] * rod["width"])


def _joint(rng: np.random.Generator, names: list[str], index: int) -> dict[str, Any]:
    first = {"body": "ground", "point": [0.0, 0.0]} if index == 0 else {"body": names[index - 1], "point": "end"}
    kind = "revolute" if rng.random() < 0.85 else "weld"
    return {"kind": kind, "first": first, "second": {"body": names[index], "point": "start"}}


def _loads(rng: np.random.Generator, bodies: dict[str, Any]) -> dict[str, Any]:
    """None, a force, a torque, a distributed force or a spring, of the size of the weight of the rod it acts on."""
    name = str(rng.choice(list(bodies)))
    weight, length = 9.81 * _mass(bodies[name]), bodies[name]["length"]
    place = {"body": name, "point": "end"}
    angle = float(rng.uniform(-np.pi, np.pi))
    push = [weight * np.cos(angle), weight * np.sin(angle)]
    kinds: list[dict[str, Any]] = [
        {},
        {"kind": "force", "at": place, "force": push, "follows": bool(rng.random() < 0.5)},
        {"kind": "torque", "at": place, "torque": 0.3 * weight * length},
        {"kind": "distributed-force", "body": name, "force": [push[0] / length, push[1] / length]},
        {
            "kind": "spring",
            "first": {"body": "ground", "point": [length, 0.0]},
            "second": place,
            "stiffness": 3.0 * weight / length,
            "damping": 0.1 * weight,
        },
    ]
    chosen = kinds[int(rng.integers(len(kinds)))]
    return {"load": chosen} if chosen else {}
