"""What is known of rods before any model of them is run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.scene import Scene
from shoal.selection.prior import estimate


def pendulum(**more: Any) -> Scene:
    """A rod that carries a point mass at its end, hanging near its place of rest."""
    rod = {"kind": "rod", "length": 0.5, "height": 0.01, "width": 0.01, "density": 2700.0, "element": "ancf-cable"}
    pivot = {"body": "ground", "point": [0.0, 0.0]}
    return Scene.parse(
        {
            "name": "pendulum",
            "bodies": {
                "rod": rod | {"youngs_modulus": 7e10, "elements": 2},
                "bob": {"kind": "point-mass", "mass": 0.2},
            },
            "joints": {
                "pivot": {"first": pivot, "second": {"body": "rod", "point": "start"}},
                "pin": {"first": {"body": "rod", "point": "end"}, "second": {"body": "bob"}},
            },
            "markers": {"bob": {"body": "bob"}},
            "initial": {"rod": {"angle": -np.pi / 2 + 0.05}},
            "solver": {"duration": 0.3, "samples": 10},
        }
        | more
    )


def test_a_point_mass_has_no_angle_to_vary_and_a_small_swing_does_not_grow() -> None:
    found = estimate(pendulum(), ("rod",))["rod"]
    assert found.growth == pytest.approx(1.0, rel=0.01)  # delta cos(omega t), whose largest value is that of the start
    assert np.isfinite(found.error)


def test_a_load_that_depends_on_the_motion_leaves_the_deflection_unknown() -> None:
    anchor = {"body": "ground", "point": [0.3, -0.5]}
    spring = {"kind": "spring", "first": anchor, "second": {"body": "rod", "point": "end"}, "stiffness": 50.0}
    assert np.isnan(estimate(pendulum(loads={"spring": spring}), ("rod",))["rod"].deflection)
