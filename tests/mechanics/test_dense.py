"""The motion inside a step: Hermite interpolation reproduces polynomials of its degree, and their derivatives."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from shoal.mechanics.integrators import dense


@pytest.mark.parametrize(("inside", "degree"), [(dense.quintic, 5), (dense.cubic, 3)])
@pytest.mark.parametrize("x", [0.0, 0.17, 0.5, 0.93, 1.0])
def test_polynomials_are_reproduced(inside: Any, degree: int, x: float) -> None:
    h = 0.3
    motions = [Polynomial(np.cos(np.arange(degree + 1) * k)) for k in (1, 2, 3)]
    ends = [np.array([[p.deriv(order)(t) for p in motions] for order in range(3)]) for t in (0.0, h)]
    w = SimpleNamespace(z=ends[1][0], zdot=ends[1][1], a=ends[1][2])
    q, v = np.zeros(3), np.zeros(3)
    inside.py_func((0,), None, SimpleNamespace(unknowns=3), w, ends[0].ravel(), x, h, q, v)
    np.testing.assert_allclose(q, [p(x * h) for p in motions], atol=1e-13)
    np.testing.assert_allclose(v, [p.deriv()(x * h) for p in motions], atol=1e-12)
