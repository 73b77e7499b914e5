"""Ten machines with uncertain fields in shapes of their own: friction, stops, motors, singular places, wide intervals.

The bounds that `shoal.uncertain` states are tried by runs of the same engine that it has not chosen: all over the box,
on its faces and edges, and about the best ones so far.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from shoal.engines import get_engine
from shoal.notebook import uncertain
from shoal.response import Response
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array, Status

Fields = Mapping[str, Any]
DOP853: Fields = {"integrator": "dop853", "duration": 2.0, "relative_tolerance": 1e-10, "absolute_tolerance": 1e-12}
BLOCK = 500
ROUNDING = 1e-6
"""Of the width: what steps of the integrators may differ by."""


@dataclass(frozen=True)
class Asked:
    """scene: its text as fields, or a name of the library; vary: path -> (low, high); times [s]."""

    name: str
    scene: Fields | str
    vary: Mapping[str, tuple[float, float]]
    times: tuple[float, ...]

    @property
    def machine(self) -> Scene:
        """The scene."""
        return load_scene(self.scene) if isinstance(self.scene, str) else Scene.parse({"name": "drawn", **self.scene})


def _pendulum(load: Fields | None = None, **joint: float) -> Fields:
    """A rod of 1 m and 1 kg that hangs on the origin, drawn aside by 0.8 rad from the horizontal."""
    return {
        "gravity": [0.0, -9.81],
        "bodies": {
            "OA": {
                "kind": "rigid-body",
                "mass": 1.0,
                "inertia": 1 / 12,
                "centre_of_mass": [0.5, 0.0],
                "named_points": {"end": [1.0, 0.0]},
            }
        },
        "joints": {
            "O": {
                "kind": "revolute",
                "first": {"body": "ground", "point": [0, 0]},
                "second": {"body": "OA", "point": "start"},
                **joint,
            }
        },
        "loads": load or {},
        "markers": {"A": {"body": "OA", "point": "end"}},
        "initial": {"OA": {"angle": -0.8}},
        "solver": DOP853,
    }


def _sliding(load: Fields) -> Fields:
    """A mass on a line, pulled by a spring to the origin."""
    return {
        "gravity": [0.0, 0.0],
        "bodies": {"mass": {"kind": "point-mass", "mass": 1.0}},
        "joints": {
            "rail": {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "mass"}}
        },
        "loads": {
            "spring": {"kind": "spring", "first": {"body": "ground", "point": [-2, 0]}, "second": {"body": "mass"}}
            | dict(load)
        },
        "markers": {"P": {"body": "mass"}},
        "initial": {"mass": {"position": [0.3, 0.0]}},
        "solver": DOP853,
    }


def _load(kind: str, **fields: Any) -> Fields:
    return {"load": {"kind": kind, **fields}}


_HINGE = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "OA", "point": "start"}}
_CANTILEVER: Fields = {
    "gravity": [0.0, -9.81],
    "bodies": {
        "rod": {
            "kind": "rod",
            "length": 1.0,
            "height": 0.02,
            "width": 0.03,
            "density": 3000.0,
            "youngs_modulus": 5e8,
            "element": "ancf-cable",
            "elements": 3,
        }
    },
    "joints": {
        "clamp": {
            "kind": "weld",
            "first": {"body": "ground", "point": [0.0, 0.0]},
            "second": {"body": "rod", "point": "start"},
        }
    },
    "markers": {"tip": {"body": "rod", "point": "end"}},
    "initial": {"rod": {"angle": 0.0}},
    "solver": {"duration": 0.5, "step": 1e-4, "integrator": "leapfrog", "theory": "slender"},
}
_AFTER = tuple(float(t) for t in np.linspace(0.25, 2.0, 8))

STUDIES = (
    Asked(
        "dry friction that stops a pendulum",
        _pendulum(coulomb=0.5),
        {"joints.O.coulomb": (0.25, 0.75), "bodies.OA.mass": (0.7, 1.3)},
        _AFTER,
    ),
    Asked(
        "a stop that a mass runs against",
        _sliding({"stiffness": 40.0, "length": 2.0, "elastic": "2000*max(t - 0.1, 0)"}),
        {"loads.spring.stiffness": (30.0, 50.0), "bodies.mass.mass": (0.8, 1.2)},
        _AFTER,
    ),
    Asked(
        "a spring with the force of an abs",
        _sliding({"stiffness": 10.0, "length": 2.0, "elastic": "30*t*abs(t)"}),
        {"initial.mass.position.0": (0.1, 0.5), "loads.spring.stiffness": (5.0, 15.0)},
        _AFTER,
    ),
    Asked(
        "a push along the path that lifts a pendulum, or does not",
        _pendulum(_load("force", at={"body": "OA", "point": "end"}, force=[0.0, 4.5], follows=True), friction=0.2),
        {"loads.load.force.1": (3.0, 6.0), "joints.O.friction": (0.1, 0.3)},
        _AFTER,
    ),
    Asked(
        "a driven crank and rods of uncertain length",
        {
            "gravity": [0.0, -9.81],
            "bodies": {
                "crank": {
                    "kind": "rod",
                    "length": 0.3,
                    "height": 0.02,
                    "width": 0.02,
                    "density": 2700.0,
                    "element": "rigid",
                },
                "rod": {
                    "kind": "rod",
                    "length": 0.8,
                    "height": 0.02,
                    "width": 0.02,
                    "density": 2700.0,
                    "element": "rigid",
                },
            },
            "joints": {
                "O": {
                    "kind": "revolute",
                    "first": {"body": "ground", "point": [0.0, 0.0]},
                    "second": {"body": "crank", "point": "start"},
                },
                "drive": {
                    "kind": "driven-angle",
                    "first": {"body": "ground", "point": [0.0, 0.0]},
                    "second": {"body": "crank"},
                    "angle": "3*t + 0.4*abs(sin(2*t))",
                },
                "A": {
                    "kind": "revolute",
                    "first": {"body": "crank", "point": "end"},
                    "second": {"body": "rod", "point": "start"},
                },
                "S": {
                    "kind": "slider",
                    "first": {"body": "ground", "point": [0.0, 0.05]},
                    "second": {"body": "rod", "point": "end"},
                },
            },
            "markers": {"S": {"body": "rod", "point": "end"}, "A": {"body": "crank", "point": "end"}},
            "initial": {"crank": {"angle": 0.0}, "rod": {"angle": 0.0}},
            "solver": DOP853,
        },
        {"bodies.crank.length": (0.25, 0.35), "bodies.rod.length": (0.7, 0.9)},
        _AFTER,
    ),
    Asked(
        "a spring of uncertain rest length",
        _pendulum(
            _load(
                "spring",
                first={"body": "ground", "point": [1.0, 0.5]},
                second={"body": "OA", "point": "end"},
                stiffness=60.0,
                length=0.6,
                damping=1.0,
            )
        ),
        {"loads.load.length": (0.3, 0.9), "loads.load.stiffness": (30.0, 90.0)},
        _AFTER,
    ),
    Asked(
        "uncertain speeds at the start of a double pendulum",
        "rigid-double-pendulum",
        {"initial.OA.rate": (-0.5, 0.5), "initial.AB.rate": (-0.5, 0.5)},
        _AFTER[:5],
    ),
    Asked(
        "uncertain gravity and an angle on either side of rest",
        _pendulum(_load("torsion-spring", **_HINGE, stiffness=1.0, cubic=4.0, angle=-math.pi / 2)),
        {"gravity.1": (-14.7, -4.9), "initial.OA.angle": (-2.2, -0.9)},
        _AFTER,
    ),
    Asked(
        "height and modulus of a cantilever, by half",
        _CANTILEVER,
        {"bodies.rod.height": (0.015, 0.025), "bodies.rod.youngs_modulus": (2.5e8, 7.5e8)},
        (0.05, 0.1, 0.15, 0.2, 0.3),
    ),
    Asked(
        "a slider-crank that passes its singular position",
        "equal-slider-crank",
        {"bodies.crank.mass": (0.5, 1.5), "bodies.rod.mass": (0.5, 1.5), "initial.crank.rate": (5.9, 6.0)},
        _AFTER[:4],
    ),
)


@dataclass(frozen=True)
class Tried:
    """A study, and the runs that tried it: how many failed.

    beyond: how far a run lies beyond the outer bounds within the horizon; short: beyond the attained ones, both as
    shares of the width of the marker's quantity
    """

    name: str
    response: Response
    beyond: float
    short: float
    failed: int

    @property
    def kept(self) -> bool:
        """Return whether no run lies further out than the reported gap."""
        assert self.response.bounds is not None
        gap = self.response.bounds.gap
        return math.isnan(gap) or self.beyond <= gap + ROUNDING


def tried(asked: Asked, runs: int, seed: int = 1) -> Tried:
    """One study, and `runs` runs against it."""
    found = uncertain(asked.machine, dict(asked.vary), asked.times, verify=False)
    bounds = found.bounds
    assert bounds is not None
    low, high, failed = attempted(asked, runs, seed)
    low, high = np.minimum(low, bounds.lower), np.maximum(high, bounds.upper)
    each = (high - low).reshape(len(asked.times), -1)
    width = np.tile(np.maximum(each.max(axis=0), 1e-9), len(asked.times))
    within = np.repeat(np.array(asked.times) <= found.horizon, each.shape[1])
    beyond = np.maximum(bounds.lower_outer - low, high - bounds.upper_outer) / width
    short = np.maximum(bounds.lower - low, high - bounds.upper) / width
    beyond, short = (np.nan_to_num(of)[within].max(initial=0.0) for of in (beyond, short))
    return Tried(asked.name, found, float(beyond), float(short), failed)


def attempted(asked: Asked, runs: int, seed: int) -> tuple[Array, Array, int]:
    """Extremes of `count` runs, (columns,) each, and the number of those that failed."""
    random, scene, engine = np.random.default_rng(seed), asked.machine, get_engine("gauss")
    ends = np.array(list(asked.vary.values()))
    count, times = len(ends), np.array(asked.times)
    corners = np.array(list(product((-1.0, 0.0, 1.0), repeat=count)))
    at: Array = np.zeros((1, count))
    low = high = np.zeros(0)
    failed = 0
    for k in range(max(1, runs // BLOCK)):
        if k < runs // (2 * BLOCK) or k == 0:
            xi = random.uniform(-1, 1, (BLOCK, count))
            xi = np.where(random.random(xi.shape) < (0.0, 0.3, 0.7)[k % 3], np.sign(xi), xi)
            xi = np.vstack([corners, xi])[:BLOCK] if k == 0 else xi
        else:
            size = 10.0 ** random.uniform(-4, -0.5, (BLOCK, 1))
            xi = at[random.integers(0, len(at), BLOCK)] + size * random.uniform(-1, 1, (BLOCK, count))
            xi = np.clip(xi, -1, 1)
        values = ends.mean(axis=1) + xi * np.diff(ends, axis=1)[:, 0] / 2
        motion = engine.simulate_many(scene, dict(zip(asked.vary, values.T, strict=True)), times)
        good = np.array([status is Status.OK for status in motion.status])
        failed += int((~good).sum())
        told = np.concatenate([motion.points, motion.angles[:, :, None]], axis=2)
        told = np.moveaxis(told, -1, 0).reshape(motion.lanes, -1)[good]
        xi = xi[good]
        if k == 0:
            low, high = told.min(axis=0), told.max(axis=0)
            at = np.concatenate([xi[told.argmin(axis=0)], xi[told.argmax(axis=0)]])
        for side, better in enumerate((told.min(axis=0) < low, told.max(axis=0) > high)):
            best = xi[(told.argmin(axis=0), told.argmax(axis=0))[side]]
            half = slice(side * len(low), (side + 1) * len(low))
            at[half] = np.where(better[:, None], best, at[half])
        low, high = np.minimum(low, told.min(axis=0)), np.maximum(high, told.max(axis=0))
    return low, high, failed
