"""Machines that several tests in space look at."""

from __future__ import annotations

import math
from typing import Any

import pytest


def _joint(kind: str, first: Any, second: Any, **more: Any) -> dict[str, Any]:
    return {"kind": kind, "first": first, "second": second, **more}


@pytest.fixture
def many_joints() -> dict[str, Any]:
    """A planar scene with every joint and load of the plane."""
    link = {"kind": "rigid-body", "mass": 1.5, "inertia": 0.2, "centre_of_mass": [0.4, 0.1],
            "named_points": {"end": [0.8, 0.0], "side": [0.3, 0.2]}}  # fmt: skip
    end = {"body": "A", "point": "end"}
    return {
        "name": "many",
        "bodies": {"A": link, "B": link, "C": link, "D": link, "E": link, "P": {"kind": "point-mass", "mass": 0.3}},
        "ground_points": {"M": {"x": "0.1*sin(3*t)", "y": 0.0}},
        "joints": {
            "O": _joint("revolute", {"body": "ground", "point": "M"}, {"body": "A"}, friction=0.2, coulomb=0.1),
            "W": _joint("weld", end, {"body": "B"}, angle=0.4),
            "S": _joint("slider", {"body": "B", "point": "end"}, {"body": "C"}, direction=0.3, friction=0.1),
            "L": _joint("slider", {"body": "ground", "point": [2.0, 0.0]}, {"body": "D"}, direction=1.0,
                       rotation="locked"),
            "Q": _joint("perpendicular", {"body": "D"}, {"body": "E"}),
            "R": _joint("revolute", {"body": "D", "point": "end"}, {"body": "E"}),
            "T": _joint("distance", {"body": "D", "point": "side"}, {"body": "P"}, length="0.5 + 0.1*sin(t)"),
        },
        "loads": {
            "K": {"kind": "spring", "first": end, "second": {"body": "ground", "point": [1.0, -2.0]},
                  "stiffness": 20.0, "damping": 0.5, "length": 1.0},
            "U": {"kind": "torsion-spring", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "A"},
                  "stiffness": 3.0, "angle": 0.2, "cubic": 1.0},
            "F": {"kind": "force", "at": {"body": "A", "point": "side"}, "force": [1.0, 2.0], "follows": True},
            "G": {"kind": "force", "at": {"body": "C", "point": "side"}, "force": [1.0, 2.0], "scale": "sin(2*t)"},
            "H": {"kind": "torque", "at": {"body": "C"}, "torque": "0.7*cos(t)", "reaction": {"body": "B"}},
        },
        "markers": {"a": end, "b": {"body": "B", "point": "end"}, "c": {"body": "C", "point": "end"},
                    "d": {"body": "D", "point": "end"}, "e": {"body": "E", "point": "end"}, "p": {"body": "P"}},
        "initial": {"A": {"angle": -0.7, "rate": 0.5}, "C": {"angle": 0.2}, "D": {"position": [2.0, 0.0]},
                    "E": {"angle": math.pi / 2}, "P": {"position": [2.3, -0.3]}},
    }  # fmt: skip
