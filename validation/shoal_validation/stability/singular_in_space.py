"""Machines in space that pass singular positions, and their motion in one angle: what tests and stability maps share.

A parallelogram on hinges and on balls, a platform on equal legs, Bennett's linkage that folds onto a line.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from shoal_validation.problems import one_angle

TURN = Rotation.from_rotvec([0.4, -1.1, 0.7])
"""Of whole machines, so that no axis is one of the ground."""
RATE = -4.0
"""Of the first angle at the start [rad/s]."""


def turned(*x: float) -> list[float]:
    """A vector of the machine along the axes of the ground."""
    return [float(part) for part in TURN.apply(x)]


# --- a parallelogram on hinges and on balls, and a platform on equal legs: each is one pendulum


def at(body: str, point: Any = "start") -> dict[str, Any]:
    """An attachment."""
    return {"body": body, "point": point}


def parallelogram(angle: float, *, balls: bool = False) -> dict[str, Any]:
    """Cranks of 1 and 3 kg, 1 m long, and a coupler of 2 kg and 2 m, in an oblique plane; see the problem library."""
    pose = {"rotation": (TURN * Rotation.from_rotvec([0, 0, angle])).as_rotvec().tolist()}
    x, y = math.cos(angle), math.sin(angle)
    spin = turned(0.0, 0.0, RATE)
    rod: dict[str, Any] = {"kind": "rigid-body", "inertia": [1.0, 1.0, 1.0], "named_points": {"end": [1.0, 0, 0]}}
    crank = rod | {"centre_of_mass": [0.5, 0, 0]}
    axis = {"axis": turned(0, 0, 1)}
    hinge = {"kind": "spherical"} if balls else {"kind": "revolute", **axis}
    return {
        "name": "parallelogram", "dimensions": 3, "gravity": turned(0, -9.81, 0),
        "bodies": {
            "left": crank | {"mass": 1.0, "inertia": [0.01, 1 / 12, 1 / 12]},
            "right": crank | {"mass": 3.0, "inertia": [0.01, 3 / 12, 3 / 12]},
            "coupler": rod | {"mass": 2.0, "inertia": [0.01, 0.7, 0.7], "centre_of_mass": [1.0, 0, 0],
                              "named_points": {"end": [2.0, 0, 0]}},
        },
        "joints": {
            "O": {"kind": "revolute", "first": at("ground", [0, 0, 0]), "second": at("left"), **axis},
            "P": {"kind": "revolute", "first": at("ground", turned(2, 0, 0)), "second": at("right"), **axis},
            "A": {"first": at("left", "end"), "second": at("coupler"), **hinge},
            "B": {"first": at("right", "end"), "second": at("coupler", "end"), **hinge},
        },
        "markers": {"A": at("left", "end"), "B": at("right", "end")},
        "initial": {"left": pose | {"spin": spin}, "right": pose | {"spin": spin},
                    "coupler": {"rotation": TURN.as_rotvec().tolist(), "position": turned(x, y, 0),
                                "spin": [0.0, 0.0, 0.0]}},
    }  # fmt: skip


def platform(angle: float, *, legs: int = 3) -> dict[str, Any]:
    """A platform of 2 kg on equal, parallel legs of 1 m without mass; it never turns, and swings as a point mass."""
    corners = np.array([[0.4, 0.0, 0.1], [-0.3, 0.0, 0.5], [-0.2, 0.0, -0.6], [0.5, 0.0, 0.6]])[:legs]
    x, y = math.cos(angle), math.sin(angle)
    joints = {
        f"L{k}": {"kind": "distance", "first": {"body": "ground", "point": turned(*corner)},
                  "second": {"body": "plate", "point": corner.tolist()}}
        for k, corner in enumerate(corners)
    }  # fmt: skip
    return {
        "name": "platform", "dimensions": 3, "gravity": turned(0, -9.81, 0),
        "bodies": {"plate": {"kind": "rigid-body", "mass": 2.0, "inertia": [0.2, 0.5, 0.4]}},
        "joints": joints, "markers": {"A": {"body": "plate"}},
        "initial": {"plate": {"rotation": TURN.as_rotvec().tolist(), "position": turned(x, y, 0),
                              "velocity": turned(-y * RATE, x * RATE, 0), "spin": [0.0, 0.0, 0.0]}},
    }  # fmt: skip


def swing(angle: float) -> Callable[[Any], Any]:
    """A point mass on 1 m."""

    def points(times: Any) -> Any:
        phi = one_angle.motion(lambda a, _: -one_angle.G * math.cos(a), angle, RATE, times)
        return np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)

    return points


def pendulum(angle: float) -> Callable[[Any], Any]:
    """The parallelogram, whose coupler translates."""
    return lambda times: np.pad(one_angle.parallelogram(angle, RATE)(times).points, ((0, 0), (0, 1)))


# --- Bennett's linkage, which folds onto a line


ALPHA = 0.7
"""Twist of one pair of links; the other has its complement to a straight angle, and the lengths are equal."""


def bennett(first: Any) -> tuple[list[Any], list[Any]]:
    """Places and axes of the hinges at the angle of the first one, which may be complex."""
    other = math.pi - 2 * np.arctan(np.tan(first / 2) * math.cos(ALPHA))
    places, axes = [np.zeros(3)], [np.array([0.0, 0.0, 1.0])]
    frame = np.eye(3)
    for angle, twist in ((first, ALPHA), (other, math.pi - ALPHA)):
        c, s = np.cos(angle), np.sin(angle)
        frame = frame @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        places.append(places[-1] + 0.5 * frame[:, 0])
        frame = frame @ Rotation.from_rotvec([twist, 0, 0]).as_matrix()
        axes.append(frame[:, 2])
    places.append(np.array([-0.5, 0.0, 0.0]))
    axes.append(Rotation.from_rotvec([ALPHA - math.pi, 0, 0]).apply([0, 0, 1]))
    return places, axes


def masses(first: Any) -> list[Any]:
    """Places of four point masses of 1 kg in each of the three moving links, which give them inertia."""
    places, axes = bennett(first)
    found = []
    for k in range(3):
        middle = (places[k] + places[k + 1]) / 2
        found += [middle + sign * 0.1 * axis for axis in (axes[k], axes[k + 1]) for sign in (1, -1)]
    return found


def linkage(first: float) -> dict[str, Any]:
    """Bennett's linkage at the angle of its first hinge [rad], without gravity."""
    places, axes = bennett(first)
    bodies, initial, joints = {}, {}, {}
    points = np.array(masses(first)).reshape(3, 4, 3)
    for k in range(3):
        away = points[k] - points[k].mean(axis=0)
        inertia = np.sum(away**2) * np.eye(3) - away.T @ away
        bodies[f"B{k}"] = {
            "kind": "rigid-body", "mass": 4.0, "inertia": ((inertia + inertia.T) / 2).tolist(),
            "centre_of_mass": (points[k].mean(axis=0) - places[k]).tolist(),
            "named_points": {"end": (places[k + 1] - places[k]).tolist()},
        }  # fmt: skip
        initial[f"B{k}"] = {"rotation": TURN.as_rotvec().tolist(), "position": turned(*places[k])}
        before = {"body": f"B{k - 1}", "point": "end"} if k else {"body": "ground", "point": turned(*places[0])}
        joints[f"R{k}"] = {"first": before, "second": {"body": f"B{k}"}, "axis": turned(*axes[k])}
    base = {"body": "ground", "point": turned(*places[3])}
    joints["R3"] = {"first": base, "second": {"body": "B2", "point": "end"}, "axis": turned(*axes[3])}
    initial["B0"]["spin"] = turned(0, 0, RATE)
    return {"name": "bennett", "dimensions": 3, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints,
            "initial": initial, "markers": {"A": {"body": "B1", "point": "end"}}}  # fmt: skip


def folding(angle: float) -> Callable[[Any], Any]:
    """Without gravity the rate follows from the energy alone; derivatives of the closure by complex steps."""

    def inertia(first: float) -> float:
        return float(sum(np.sum((place.imag / 1e-20) ** 2) for place in masses(first + 1e-20j)))

    def points(times: Any) -> Any:
        whole = inertia(angle) * RATE**2
        run = solve_ivp(lambda _, y: [-math.sqrt(whole / inertia(float(y[0])))], (0, times[-1]), [angle], "DOP853",
                        t_eval=times, rtol=1e-12, atol=1e-13)  # fmt: skip
        return np.array([bennett(first)[0][2] for first in run.y[0]])

    return points


MACHINES: dict[str, tuple[Callable[[float], dict[str, Any]], Callable[[float], Callable[[Any], Any]]]] = {
    "parallelogram": (parallelogram, pendulum),
    "parallelogram on balls": (lambda angle: parallelogram(angle, balls=True), pendulum),
    "platform": (platform, swing),
    "platform with a leg too many": (lambda angle: platform(angle, legs=4), swing),
    "bennett": (linkage, folding),
}
"""The machine whose first angle is so far from the singular position [rad], and where its marker A is [m], (times, 3),
along axes that TURN turns.
"""
