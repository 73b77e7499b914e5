"""Built-in scenes of which there is one for every number: the N-four-bar linkage."""

from __future__ import annotations

import math
import re
from typing import Any

from shoal.errors import InputError

FOUR_BARS = re.compile(r"^n-four-bar-([0-9]+)$")
_MOST_LOOPS = 1000
EXAMPLES = ("n-four-bar-2", "n-four-bar-40")


def parametric(name: str) -> dict[str, Any] | None:
    """The data of a parametric scene, or None if the name is not of that form. Raises InputError."""
    found = FOUR_BARS.match(name)
    if found is None:
        return None
    loops = int(found[1])
    if not 1 <= loops <= _MOST_LOOPS:
        raise InputError(f"{name}: the linkage has 1 to {_MOST_LOOPS} loops, found {loops}")
    return n_four_bar(loops)


def n_four_bar(loops: int) -> dict[str, Any]:
    """N four-bar linkages side by side, started upright with 1 m/s at the top.

    Uniform rods of 1 m and 1 kg: cranks A0B0 ... ANBN on the ground, couplers between neighbouring B's. All lie on
    one line twice a turn, where the constraints lose N ranks (Gonzalez, Dopico, Luaces and Cuadrado, A benchmarking
    system for MBS simulation software, 2011: 1 m/s and N loops).
    """
    bodies, joints, initial = {}, {}, {}
    for k in range(loops + 1):
        bodies[f"crank{k}"] = _bar()
        initial[f"crank{k}"] = {"angle": math.pi / 2, "rate": -1.0}
        joints[f"A{k}"] = _revolute("ground", [float(k), 0.0], f"crank{k}", "start")
        if k:
            bodies[f"coupler{k}"] = _bar()
            joints[f"B{k - 1}"] = _revolute(f"crank{k - 1}", "end", f"coupler{k}", "start")
            joints[f"C{k}"] = _revolute(f"crank{k}", "end", f"coupler{k}", "end")
    return {
        "name": f"n-four-bar-{loops}",
        "description": f"Four-bar linkage of {loops} loops, upright, 1 m/s: singular twice a turn (any N).",
        "bodies": bodies,
        "joints": joints,
        "markers": {"B0": {"body": "crank0", "point": "end"}},
        "initial": initial,
        "solver": {"duration": 10.0, "samples": 200, "step": 1e-3},
    }


def _bar() -> dict[str, Any]:
    return {
        "kind": "rigid-body",
        "mass": 1.0,
        "inertia": 1 / 12,
        "centre_of_mass": [0.5, 0.0],
        "named_points": {"end": [1.0, 0.0]},
    }


def _revolute(first: str, at: Any, second: str, point: Any) -> dict[str, Any]:
    return {"kind": "revolute", "first": {"body": first, "point": at}, "second": {"body": second, "point": point}}
