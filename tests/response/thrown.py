"""A body that flies free, whose motion is known in closed form."""

from __future__ import annotations

THROWN = {
    "name": "thrown",
    "gravity": [0.0, -10.0],
    "bodies": {
        "P": {
            "kind": "rigid-body",
            "mass": 1.0,
            "inertia": 0.1,
            "centre_of_mass": [0.0, 0.0],
            "named_points": {"c": [0.0, 0.0]},
        }
    },
    "joints": {},
    "markers": {"P": {"body": "P", "point": "c"}},
    "initial": {"P": {"position": [0.0, 0.0], "velocity": [2.0, 5.0]}},
    "solver": {"duration": 1.0, "samples": 50},
}
"""v t - 5 t^2 first reaches h at t if v = h / t + 5 t."""
UP, ALONG = "initial.P.velocity.1", "initial.P.velocity.0"
