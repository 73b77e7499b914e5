"""One rigid body that hangs from the ground: the machine that tests of services and of responses ask about."""

from __future__ import annotations

from typing import Any


def pendulum(inertia: float = 0.0, centre: float = 1.0, **more: Any) -> dict[str, Any]:
    """A body of 1 kg and 1 m, its centre of mass so far along it [m]. inertia [kg m^2]; more: other fields."""
    return {
        "name": "pendulum",
        "bodies": {
            "OA": {
                "kind": "rigid-body",
                "mass": 1.0,
                "inertia": inertia,
                "centre_of_mass": [centre, 0.0],
                "named_points": {"end": [1.0, 0.0]},
            }
        },
        "joints": {
            "O": {
                "kind": "revolute",
                "first": {"body": "ground", "point": [0, 0]},
                "second": {"body": "OA", "point": "start"},
            }
        },
        "markers": {"A": {"body": "OA", "point": "end"}},
        **more,
    }
