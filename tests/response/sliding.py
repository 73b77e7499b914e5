"""A puck that few values of its start send against a peg."""

from __future__ import annotations

from shoal.scene import Scene


def puck(place: float, radius: float, stiffness: float) -> Scene:
    """One that slides along x from (-1, y), past a round rubber peg at (0, place)."""
    peg = {"kind": "spring", "first": {"body": "ground", "point": [0.0, place]}, "second": {"body": "P"},
           "stiffness": 0.0, "length": radius, "elastic": f"-{stiffness:.0f}*max(0, -t)"}  # fmt: skip
    return Scene.parse(
        {"name": "puck", "gravity": [0.0, 0.0], "bodies": {"P": {"kind": "point-mass", "mass": 1.0}},
         "loads": {"peg": peg}, "markers": {"P": {"body": "P"}},
         "initial": {"P": {"position": [-1.0, 0.0], "velocity": [1.0, 0.0]}},
         "solver": {"duration": 2.0, "integrator": "dop853", "samples": 20, "relative_tolerance": 1e-9,
                    "absolute_tolerance": 1e-11}}
    )  # fmt: skip
