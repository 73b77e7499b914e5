"""The rigid double pendulum of two uniform rods, by its textbook equations."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from shoal.scene import Rod, load_scene
from shoal.trajectory import Array

from shoal_validation.problems.contract import Reference
from shoal_validation.problems.one_angle import TOLERANCE, G


def settle(times: Array) -> Reference:
    """Tip of the scene `rigid-double-pendulum` from Lagrange's equations in two absolute angles."""
    scene = load_scene("rigid-double-pendulum")
    start = (scene.value("initial.OA.angle"), scene.value("initial.AB.angle"))
    return Reference(lagrange(start, times)[1], "Lagrange's equations in two angles, scipy DOP853", 1e-9)


def lagrange(
    start: tuple[float, float], times: Array, density: float = 1000.0, friction: float = 0.0
) -> tuple[Array, Array]:
    """Elbow and tip of that machine [m], (samples, 2) each, released from rest at other absolute angles [rad].

    density: of the second rod [kg/m^3]; friction: of the joint at the ground [N m s]
    """
    scene = load_scene("rigid-double-pendulum").with_values({"bodies.AB.density": density})
    rods = [body for body in scene.bodies.values() if isinstance(body, Rod)]
    (m1, l1), (m2, l2) = ((rod.mass, rod.length) for rod in rods)

    def rate(_: float, y: Array) -> Array:
        a, b, u, w = y
        c, s = np.cos(a - b), np.sin(a - b)
        mass = np.array([[(m1 / 3 + m2) * l1**2, m2 * l1 * l2 / 2 * c], [m2 * l1 * l2 / 2 * c, m2 * l2**2 / 3]])
        load = np.array(
            [
                -m2 * l1 * l2 / 2 * s * w * w - (m1 / 2 + m2) * G * l1 * np.cos(a) - friction * u,
                m2 * l1 * l2 / 2 * s * u * u - m2 * G * l2 / 2 * np.cos(b),
            ]
        )
        return np.concatenate([[u, w], np.linalg.solve(mass, load)])

    run = solve_ivp(rate, (0.0, times[-1]), [*start, 0.0, 0.0], "DOP853", t_eval=times, rtol=TOLERANCE, atol=TOLERANCE)
    a, b = run.y[:2]
    elbow = l1 * np.stack([np.cos(a), np.sin(a)], axis=1)
    return elbow, elbow + l2 * np.stack([np.cos(b), np.sin(b)], axis=1)
