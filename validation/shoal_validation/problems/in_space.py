"""References of machines in space: pendulum and top by their textbook equations, IFToMM's benchmarks as published."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.integrate import solve_ivp
from shoal.scene import load_scene
from shoal.trajectory import Array

from shoal_validation.problems.contract import Reference
from shoal_validation.problems.one_angle import TOLERANCE, G
from shoal_validation.spatial.machines import PUBLISHED

_TOP = "mass", "inertia", "centre_of_mass"


def swing(start: tuple[float, float, float], times: Array) -> Array:
    """Polar angle from below [rad], its rate and the azimuth of a pendulum of 1 m, (3, times).

    start: polar angle, its rate and the azimuth's rate [rad/s]; the momentum about the vertical stays.
    """
    momentum = np.sin(start[0]) ** 2 * start[2]

    def rate(_: float, y: Array) -> list[float]:
        sine = np.sin(y[0])
        return [y[1], momentum**2 * np.cos(y[0]) / sine**3 - G * sine, momentum / sine**2]

    begin, span = [start[0], start[1], 0.0], (0.0, float(times[-1]))
    return np.asarray(solve_ivp(rate, span, begin, "DOP853", t_eval=times, rtol=TOLERANCE, atol=TOLERANCE).y)


def spherical_pendulum(times: Array) -> Reference:
    """The scene of that name, released 60 degrees from below with 2 rad/s about the vertical."""
    x, _, z = load_scene("spherical-pendulum").value("initial.A.position")
    polar, _, azimuth = swing((float(np.arctan2(x, -z)), 0.0, 2.0), times)
    level = np.sin(polar)
    points = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), -np.cos(polar)], axis=1)
    return Reference(points, "equations in two angles, scipy DOP853", 1e-11)


def heavy_top(times: Array) -> Reference:
    """The scene of that name."""
    spin = load_scene("heavy-top").value("initial.top.spin")
    return Reference(top(spin, times), "momentum about its point, scipy DOP853", 1e-10)


def top(spin: Sequence[float], times: Array) -> Array:
    """Centre of the top of that scene [m], (times, 3), from a start with an angular velocity [rad/s] without x part.

    A u x u' + C s u is the angular momentum about the point, with the moments A across and C along the axis u and the
    own spin s, which stays.
    """
    scene = load_scene("heavy-top")
    mass, (across, along, _), axis = (scene.value(f"bodies.top.{name}") for name in _TOP)
    across += mass * np.dot(axis, axis)
    turning, weight = along * spin[1], mass * np.array([0.0, 0.0, G])

    def rate(_: float, y: Array) -> Array:
        u, v = y[:3], y[3:]
        moment = np.cross(u, -weight)
        return np.concatenate([v, -(v @ v) * u + np.cross(moment - turning * v, u) / across])

    begin, span = np.concatenate([axis, np.cross(spin, axis)]), (0.0, float(times[-1]))
    run = solve_ivp(rate, span, begin, "DOP853", t_eval=times, rtol=TOLERANCE, atol=TOLERANCE)
    return np.asarray(run.y[:3].T)


def bricard(times: Array) -> Reference:
    """P3 at 1 s of IFToMM's benchmark A04, by its closed closure (Gonzalez, Dopico, Luaces and Cuadrado)."""
    if times.tolist() != [1.0]:
        raise ValueError("the benchmark prints the position at 1 s only")
    return Reference(np.array([PUBLISHED]), "IFToMM A04, closed closure, P3(1 s)", 1e-10)


def governor(times: Array) -> Reference:
    """The slider at 1 and 10 s of IFToMM's benchmark A05, by the eight digits that its own tables agree in."""
    if times.tolist() != [1.0, 10.0]:
        raise ValueError("the benchmark's digits are known at 1 and 10 s only")
    return Reference(np.array([[0.0, 0.0, 0.50142092], [0.0, 0.0, 0.61962292]]), "IFToMM A05, s(1 s), s(10 s)", 5e-9)
