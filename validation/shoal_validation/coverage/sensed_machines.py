"""Rigid machines in the plane drawn at random, each with an IMU somewhere on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from shoal.scene import Scene

Json = dict[str, Any]


@dataclass(frozen=True)
class Machine:
    """A machine with a marker `imu`, whose axes are turned by `tilt` [rad] from its body's, as a file would state it.

    sought: mass, inertia and friction to be found, as paths in the scene
    """

    data: Json
    tilt: float
    sought: dict[str, str]

    @cached_property
    def scene(self) -> Scene:
        """Return the machine as a scene."""
        return Scene.parse(self.data, self.data["name"])

    @property
    def truth(self) -> dict[str, float]:
        """True values of the sought parameters."""
        return {name: float(self.scene.value(path)) for name, path in self.sought.items()}


def machine(rng: np.random.Generator) -> Machine:
    """A chain of one to three bodies, a four-bar linkage or a slider-crank, with friction, springs and motors.

    A spring, a motor or gravity alone sets the scale of forces: without one of the first two only ratios are known.
    """
    kind = (_chain, _chain, _four_bar, _slider_crank)[int(rng.integers(4))]
    data = kind(rng)
    first, last = next(iter(data["bodies"])), list(data["bodies"])[-1]
    data["loads"]["coil"] = {
        "kind": "torsion-spring",
        "first": _at("ground", [0.0, 0.0]),
        "second": _at(first),
        "stiffness": _between(rng, 2.0, 20.0),
        "damping": _between(rng, 0.0, 0.2),
        "angle": _between(rng, -1.0, 1.0),
    }
    if rng.random() < 0.5:
        data["loads"]["spring"] = {
            "kind": "spring",
            "first": _at("ground", [_between(rng, -1.0, 1.0), _between(rng, 1.5, 2.5)]),
            "second": _at(last, "end"),
            "stiffness": _between(rng, 5.0, 60.0),
            "damping": _between(rng, 0.0, 2.0),
            "length": _between(rng, 0.5, 1.5),
        }
    if rng.random() < 0.5:
        torque = f"{_between(rng, 1.0, 4.0):.3f}*sin({_between(rng, 2.0, 6.0):.3f}*t)"
        data["loads"]["motor"] = {"kind": "torque", "at": _at(first), "torque": torque}
    body = str(rng.choice(list(data["bodies"])))
    size = data["bodies"][body]["named_points"]["end"][0]
    place = [size * _between(rng, 0.0, 1.0), size * _between(rng, -0.2, 0.2)]
    data["markers"] = {"imu": _at(body, place)}
    data["solver"] = {"duration": 2.0, "step": 2e-4, "spectral_radius": 0.9}
    moved = str(rng.choice([name for name in data["bodies"] if name != "piston"]))
    joint = str(rng.choice(list(data["joints"])))
    paths = {
        "mass": f"bodies.{moved}.mass",
        "inertia": f"bodies.{moved}.inertia",
        "friction": f"joints.{joint}.friction",
    }
    return Machine(data, _between(rng, -3.0, 3.0), paths)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _at(body: str, point: Any = "start") -> Json:
    return {"body": body, "point": point}


def _body(rng: np.random.Generator, length: float) -> Json:
    mass = _between(rng, 0.5, 3.0)
    return {
        "kind": "rigid-body",
        "mass": mass,
        "inertia": mass * length**2 * _between(rng, 0.05, 0.15),
        "centre_of_mass": [length * _between(rng, 0.3, 0.7), length * _between(rng, -0.1, 0.1)],
        "named_points": {"end": [length, 0.0]},
    }


def _pin(rng: np.random.Generator, first: Json, second: Json, **more: Any) -> Json:
    dry = {"coulomb": _between(rng, 0.02, 0.3), "coulomb_speed": _between(rng, 0.05, 0.2)} if rng.random() < 0.3 else {}
    return {"first": first, "second": second, "friction": _between(rng, 0.05, 0.4), **dry, **more}


def _chain(rng: np.random.Generator) -> Json:
    bodies, joints, initial = {}, {}, {}
    place = _at("ground", [0.0, 0.0])
    for k in range(int(rng.integers(1, 4))):
        name = f"link{k}"
        bodies[name] = _body(rng, _between(rng, 0.3, 1.2))
        joints[f"pin{k}"] = _pin(rng, place, _at(name))
        initial[name] = {"angle": _between(rng, -2.2, -0.4), "rate": _between(rng, -2.0, 2.0)}
        place = _at(name, "end")
    return {"name": "chain", "bodies": bodies, "joints": joints, "loads": {}, "initial": initial}


def _four_bar(rng: np.random.Generator) -> Json:
    crank, rocker, base = _between(rng, 0.3, 0.5), _between(rng, 0.6, 0.9), _between(rng, 0.9, 1.1)
    angle, far_angle = _between(rng, 0.5, 1.2), _between(rng, 1.0, 1.4)
    way = base + rocker * np.exp(1j * far_angle) - crank * np.exp(1j * angle)
    lengths = {"crank": crank, "coupler": float(abs(way)), "rocker": rocker}
    joints = {
        "O": _pin(rng, _at("ground", [0.0, 0.0]), _at("crank")),
        "A": _pin(rng, _at("crank", "end"), _at("coupler")),
        "B": _pin(rng, _at("coupler", "end"), _at("rocker", "end")),
        "C": _pin(rng, _at("ground", [base, 0.0]), _at("rocker")),
    }
    angles = {"crank": angle, "coupler": float(np.angle(way)), "rocker": far_angle}
    initial = {name: {"angle": one} for name, one in angles.items()}
    bodies = {name: _body(rng, length) for name, length in lengths.items()}
    return {"name": "four-bar", "bodies": bodies, "joints": joints, "loads": {}, "initial": initial}


def _slider_crank(rng: np.random.Generator) -> Json:
    crank, rod, height = _between(rng, 0.2, 0.4), _between(rng, 0.6, 1.0), _between(rng, -0.1, 0.1)
    angle = _between(rng, 0.3, 1.2)
    rod_angle = float(np.arcsin((height - crank * np.sin(angle)) / rod))
    bodies = {"crank": _body(rng, crank), "rod": _body(rng, rod), "piston": _body(rng, 0.1)}
    joints = {
        "O": _pin(rng, _at("ground", [0.0, 0.0]), _at("crank")),
        "A": _pin(rng, _at("crank", "end"), _at("rod")),
        "B": _pin(rng, _at("rod", "end"), _at("piston")),
        "S": _pin(rng, _at("ground", [0.0, height]), _at("piston"), kind="slider", rotation="locked"),
    }
    initial = {
        "crank": {"angle": angle},
        "rod": {"angle": rod_angle},
        "piston": {"angle": 0.0, "position": [crank * np.cos(angle) + rod * np.cos(rod_angle), height]},
    }
    return {"name": "slider-crank", "bodies": bodies, "joints": joints, "loads": {}, "initial": initial}
