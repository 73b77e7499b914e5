"""Euler's column on two balls: nothing keeps it from spinning about its axis, and yet it stands, buckles and bends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene

HEIGHT, WIDTH, MODULUS = 0.01, 0.02, 7e10
CRITICAL = np.pi**2 * MODULUS * WIDTH * HEIGHT**3 / 12
"""Of a metre between two balls [N]."""


def column(force: float, elements: int = 8, **loads: Any) -> Scene:
    """Pressed through a slide."""
    rod = {"kind": "rod", "length": 1.0, "height": HEIGHT, "width": WIDTH, "density": 2700.0,
           "youngs_modulus": MODULUS, "element": "director-rod", "elements": elements}  # fmt: skip
    slide = {"kind": "slider", "axis": [1, 0, 0], "rotation": "locked"}
    return Scene.parse({
        "name": "column", "dimensions": 3, "gravity": [0, 0, 0],
        "bodies": {"R": rod, "S": {"kind": "rigid-body", "mass": 0.1, "inertia": [1e-4] * 3}},
        "joints": {
            "O": {"kind": "spherical", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "R"}},
            "P": slide | {"first": {"body": "ground", "point": [1, 0, 0]}, "second": {"body": "S"}},
            "Q": {"kind": "spherical", "first": {"body": "R", "point": "end"}, "second": {"body": "S"}},
        },
        "loads": {"F": {"kind": "force", "at": {"body": "S"}, "force": [-force, 0, 0]}} | loads,
        "markers": {"M": {"body": "R", "point": [0.5, 0, 0]}, "E": {"body": "R", "point": "end"}},
    })  # fmt: skip


def elastica(ratio: float) -> tuple[float, float]:
    """Deflection of the middle and way of the end of a metre without stretch, at so many times the critical load."""
    root = np.sqrt(ratio)
    k = brentq(lambda k: 2 * ellipk(k * k) / np.pi - root, 1e-6, 0.999)
    return 2 * k / (np.pi * root), 2 * (1 - ellipe(k * k) / ellipk(k * k))


@pytest.mark.parametrize(("ratio", "status"), [(0.99, EquilibriumStatus.OK), (1.01, EquilibriumStatus.UNSTABLE)])
def test_it_stands_up_to_eulers_load(ratio: float, status: EquilibriumStatus) -> None:
    found = statics(column(ratio * CRITICAL, 4), leave_unstable=False)
    assert found.status is status
    assert abs(found.marker("M")[1]) < 1e-9
    assert status is EquilibriumStatus.UNSTABLE or "free-to-spin" in found.codes


@pytest.mark.slow
def test_beyond_it_bends_as_the_elastica() -> None:
    """In the plane of its weaker side, whichever that is; the rest is the mesh, which falls with its square."""
    deflection, way = elastica(1.2)
    errors = []
    for elements in (8, 16):
        found = statics(column(1.2 * CRITICAL, elements))
        assert found.ok, found.message
        assert found.marker("M")[1] == pytest.approx(deflection, rel=0.03)
        errors.append(abs(1.0 - found.marker("E")[0] - way))
    assert errors[1] < errors[0] / 3


def test_a_torque_that_turns_it_is_not_overlooked() -> None:
    torque = {"kind": "torque", "at": {"body": "R", "point": "end"}, "torque": 0.1, "axis": [1.0, 0.0, 0.0]}
    found = statics(column(0.5 * CRITICAL, 4, T=torque))
    assert not found.ok
