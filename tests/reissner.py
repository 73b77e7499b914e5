"""A cantilever by Reissner's equations of 1972, which have no mesh, for tests of rods with shear."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_bvp


def end_of_cantilever(force: float, length: float, modulus: float, height: float, width: float, nu: float) -> Any:
    """Where a dead load [N] upwards at the end brings it [m], (2,); shear by Cowper's factor for a rectangle."""
    axial, bending = modulus * width * height, modulus * width * height**3 / 12
    shear = axial / (2 * (1 + nu)) * 10 * (1 + nu) / (12 + 11 * nu)

    def slopes(_: Any, y: Any) -> Any:
        turn, moment = y[2:]
        c, n = np.cos(turn), np.sin(turn)
        stretch, slide = 1 + force * n / axial, force * c / shear
        dx, dy = stretch * c - slide * n, stretch * n + slide * c
        return np.array([dx, dy, moment / bending, -dx * force])

    guess = np.array([np.linspace(0, length, 50), *np.zeros((3, 50))])
    ends = solve_bvp(slopes, lambda a, b: np.array([a[0], a[1], a[2], b[3]]), np.linspace(0, length, 50), guess,
                     tol=1e-10, max_nodes=100_000)  # fmt: skip
    assert ends.success
    return ends.y[:2, -1]
