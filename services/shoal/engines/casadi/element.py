"""The planar Bernoulli-Euler cable element as an energy; CasADi differentiates, nothing is derived by hand.

The element has two nodes with position r and slope r' = dr/ds, and a cubic Hermite position field.
Energies: kinetic 1/2 int rho A |dr/dt|^2 ds, elastic 1/2 int (EA eps^2 + EI kappa^2) ds with
eps = |r'| - 1 and kappa = (r' x r'') / |r'|^2 (Gerstmayr and Irschik, J. Sound Vib. 318 (2008) 461).
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from shoal.scene.bodies import Quadrature
from shoal.trajectory import Array

_gauss = np.polynomial.legendre.leggauss
# Gauss with 4 points integrates degree 7; products of cubics have degree 6.
_MASS_RULE = _gauss(4)
_LOBATTO_3 = (np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3)
_RULES = {"full": (_gauss(5), _gauss(3)), "reduced": (_LOBATTO_3, _gauss(2))}
"""Points on [-1, 1] and weights, axial then bending."""


class CableElement(NamedTuple):
    """Functions of the nodal values `e` = (r, r', r, r'), (8,), and the element's length h [m].

    field: (e, s, h) -> position [m], (2,), slope [-], (2,), at the arc length s [m]
    strain: (e, h) -> int eps^2 ds [m], int kappa^2 ds [1/m]
    square: (e, h) -> int |r|^2 ds [m^3], which with nodal velocities gives the kinetic energy
    integral: (e, h) -> int r ds [m^2], (2,)
    """

    field: Any
    strain: Any
    square: Any
    integral: Any


@cache
def cable_element(quadrature: Quadrature) -> CableElement:
    """The element's energies, with the axial and the bending part integrated by the named quadrature."""
    e, s, h = ca.SX.sym("e", 8), ca.SX.sym("s"), ca.SX.sym("h")
    field = _hermite_field(e, s, h)
    slope = ca.jacobian(field, s)
    curve = ca.jacobian(slope, s)
    axial = (ca.norm_2(slope) - 1) ** 2
    bending = ((slope[0] * curve[1] - slope[1] * curve[0]) / ca.sumsqr(slope)) ** 2
    axial_rule, bending_rule = _RULES[quadrature]

    def integrate(expression: Any, rule: tuple[Array, Array]) -> Any:
        points, weights = rule
        return sum(
            w / 2 * h * ca.substitute(expression, s, (1 + x) / 2 * h) for x, w in zip(points, weights, strict=True)
        )

    return CableElement(
        field=ca.Function("field", [e, s, h], [field, slope]),
        strain=ca.Function("strain", [e, h], [integrate(axial, axial_rule), integrate(bending, bending_rule)]),
        square=ca.Function("square", [e, h], [integrate(ca.sumsqr(field), _MASS_RULE)]),
        integral=ca.Function("integral", [e, h], [integrate(field, _MASS_RULE)]),
    )


def _hermite_field(e: Any, s: Any, h: Any) -> Any:
    """Position at arc length s: the cubic with the nodal positions and slopes at its ends, (2,)."""
    x = s / h
    shapes = (1 - 3 * x**2 + 2 * x**3, h * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, h * (x**3 - x**2))
    return sum(shape * e[2 * i : 2 * i + 2] for i, shape in enumerate(shapes))
