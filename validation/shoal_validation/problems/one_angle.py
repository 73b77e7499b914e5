"""Machines with one degree of freedom: their motion in one angle, by elliptic functions or scipy's DOP853."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk
from shoal.trajectory import Array

from shoal_validation.problems.contract import Reference

G = 9.81
TOLERANCE = 1e-13


def motion(acceleration: Callable[[float, float], float], angle: float, rate: float, times: Array) -> Array:
    """The angle [rad] at the times [s] of angle'' = acceleration(angle, angle'), (times,)."""
    run = solve_ivp(
        lambda _, y: [y[1], acceleration(*y)],
        (0.0, times[-1]),
        [angle, rate],
        "DOP853",
        t_eval=times,
        rtol=TOLERANCE,
        atol=TOLERANCE,
    )
    if not run.success:
        raise RuntimeError(run.message)
    return np.asarray(run.y[0])


def pendulum(times: Array) -> Reference:
    """A mass point on 1 m, released horizontally: sin((angle + pi/2)/2) = k sn(K - omega t | k^2), k^2 = 1/2."""
    m = 0.5
    swing = 2 * np.arcsin(np.sqrt(m) * ellipj(ellipk(m) - np.sqrt(G) * times, m)[0])
    points = np.stack([np.sin(swing), -np.cos(swing)], axis=1)
    return Reference(points, "elliptic functions (scipy)", 1e-12 + 1e-14 * float(times[-1]))


def four_bar(loops: int) -> Callable[[Array], Reference]:
    """Tip of the first crank of an N-four-bar linkage of uniform 1 m, 1 kg rods, which leaves upright at 1 rad/s."""

    def settle(times: Array) -> Reference:
        kappa = G * ((loops + 1) / 2 + loops) / ((loops + 1) / 3 + loops)
        phi = motion(lambda angle, _: kappa * np.sin(angle), 0.0, 1.0, times)
        points = np.stack([np.sin(phi), np.cos(phi)], axis=1)
        return Reference(points, "phi'' = kappa sin phi, scipy DOP853", 1e-10)

    return settle


def parallelogram(angle: float, rate: float, side: float = 0.0) -> Callable[[Array], Reference]:
    """Cranks of 1 and 3 kg and a coupler of 2 kg, which translates, are one pendulum; `side` [N] pulls along x."""
    inertia = (1.0 + 3.0) / 3 + 2.0

    def settle(times: Array) -> Reference:
        phi = motion(lambda a, _: (-4.0 * G * np.cos(a) - side * np.sin(a)) / inertia, angle, rate, times)
        return Reference(np.stack([np.cos(phi), np.sin(phi)], axis=1), "one pendulum equation, scipy DOP853", 1e-10)

    return settle


def slider_crank(angle: float, rate: float) -> Callable[[Array], Reference]:
    """T = (1/3 + sin^2 a) a'^2, V = g sin a for two uniform rods of 1 m and 1 kg; place of the slider."""

    def acceleration(a: float, w: float) -> float:
        inertia = 2 / 3 + 2 * np.sin(a) ** 2
        return float(-(G * np.cos(a) + 2 * np.sin(a) * np.cos(a) * w * w) / inertia)

    def settle(times: Array) -> Reference:
        phi = motion(acceleration, angle, rate, times)
        points = np.stack([2 * np.cos(phi), np.zeros(len(times))], axis=1)
        return Reference(points, "Lagrange's equation in one angle, scipy DOP853", 1e-10)

    return settle
