"""User functions of Exudyn's, made from numbers and functions of time.

The engine calls them, and exported scripts hold their text: they know numpy and each other, and no more of Shoal.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

OfTime = Callable[[float], Any]


def scaled_load(vector: Any, scale: OfTime) -> Any:
    """A load vector times a function of time."""

    def load(mbs: Any, t: float, given: Any) -> list[float]:
        factor = scale(t)
        return [factor * part for part in vector]

    return load


def offset(value: OfTime) -> Any:
    """A prescribed coordinate, which Exudyn counts from the start."""
    begin = value(0.0)
    return lambda mbs, t, item, given: value(t) - begin


def offset_rate(slope: OfTime) -> Any:
    """Its rate."""
    return lambda mbs, t, item, given: slope(t)


def torque_against(value: OfTime) -> Any:
    """A connector's torque that does not resist but drives."""
    return lambda mbs, t, item, angle, rate, *more: -value(t)


def law_force(law: dict[str, float], elastic: Any, x: Any, rate: Any) -> Any:
    """Return the resisting force or torque for an elongation or angle x and its rate."""
    return law["stiffness"] * x + law["cubic"] * x**3 + law_resisting(law, elastic, x, rate)


def law_resisting(law: dict[str, float], elastic: Any, x: Any, rate: Any) -> Any:
    """Its part beside the polynomial; elastic: a function of x, or None."""
    force = (law["damping"] + law["drag"] * np.abs(rate)) * rate + law["coulomb"] * np.tanh(rate / law["speed"])
    return force if elastic is None else force + elastic(x)


def spring_force(law: dict[str, float], elastic: Any) -> Any:
    """The force of a spring, of its elongation."""
    return lambda mbs, t, item, x, rate, *more: float(law_force(law, elastic, np.float64(x), np.float64(rate)))


def spring_torque(law: dict[str, float], elastic: Any) -> Any:
    """The torque of a torsion spring; Exudyn gives the angle as it counts it, and the offset after two others."""

    def torque(mbs: Any, t: float, item: int, angle: float, rate: float, *more: float) -> float:
        return float(law_force(law, elastic, np.float64(angle - more[2]), np.float64(rate)))

    return torque


def rotation(turn: Any) -> Any:
    """The matrix (..., 3, 3) that Exudyn makes of Euler parameters (..., 4), which need not be of unit length."""
    s, x, y, z = np.moveaxis(np.asarray(turn), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - s * z), 2 * (x * z + s * y)],
        [2 * (x * y + s * z), 1 - 2 * (x * x + z * z), 2 * (y * z - s * x)],
        [2 * (x * z - s * y), 2 * (y * z + s * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def rotation_slope(turn: Any) -> Any:
    """Its derivative by the Euler parameters, (..., 3, 3, 4)."""
    s, x, y, z = np.moveaxis(np.asarray(turn), -1, 0)
    none = 0.0 * s
    by = [
        [[none, -z, y], [z, none, -x], [-y, x, none]],
        [[none, y, z], [y, -2 * x, -s], [z, s, -2 * x]],
        [[-2 * y, x, s], [x, none, z], [-s, z, -2 * y]],
        [[-2 * z, -s, x], [s, -2 * z, y], [x, y, none]],
    ]
    return 2 * np.moveaxis(np.array(by), (0, 1, 2), (-1, -3, -2))


def direction(q: Any, image: Any) -> tuple[Any, Any]:
    """A direction that a node's body has as `image`, at the node's coordinates q, and its derivative by them.

    The ground has no coordinates, a node of a cable six (its tangent is the direction), one of a rigid body seven.
    """
    slope = np.zeros((3, len(q)))
    if len(q) == 0:
        return image, slope
    if len(q) == 6:
        slope[:, 3:] = np.eye(3)
        return q[3:6], slope
    slope[:, 3:] = np.einsum("ijk,j->ik", rotation_slope(q[3:7]), image)
    return rotation(q[3:7]) @ image, slope


def products(size: int, first: Any, second: Any, q: Any) -> tuple[Any, Any]:
    """Products of directions of two nodes, and their derivatives; size: coordinates of the first node."""
    values, slopes = [], []
    for one, other in zip(first, second, strict=True):
        (u, by_u), (w, by_w) = direction(np.array(q[:size]), one), direction(np.array(q[size:]), other)
        values.append(u @ w)
        slopes.append(np.concatenate([w @ by_u, u @ by_w]))
    return np.array(values), np.array(slopes)


def products_gap(size: int, first: Any, second: Any, wanted: Any) -> Any:
    """A constraint: products of directions are what is wanted (functions of time, value and rate), or 0."""

    def gap(mbs: Any, t: float, item: int, q: Any, v: Any, of_rates: bool) -> Any:
        values, slopes = products(size, first, second, q)
        found = slopes @ np.array(v) if of_rates else values
        return found - np.array([one(t)[1 if of_rates else 0] for one in wanted] or 0.0)

    return gap


def products_slope(exu: Any, size: int, first: Any, second: Any) -> Any:
    """Its derivative."""
    return lambda mbs, t, item, q, v, of_rates: exu.MatrixContainer(products(size, first, second, q)[1])


def teeth(size: int, sides: Any, period: float, q: Any) -> tuple[Any, Any]:
    """Return the gap of gear teeth, modulo a period [rad], and its derivative.

    size: coordinates of the first node; sides: of both, the factor of its angle, a direction of its body, and the
    plane's two axes between which that turns.
    """
    total, slopes = 0.0, []
    for part, (factor, image, axes) in zip((q[:size], q[size:]), sides, strict=True):
        u, by_u = direction(np.array(part), image)
        x, y = axes @ u
        total += factor * np.arctan2(y, x)
        slopes.append(factor * (x * axes[1] - y * axes[0]) @ by_u / (x * x + y * y))
    return total - period * np.rint(total / period), np.concatenate(slopes)


def teeth_gap(size: int, sides: Any, period: float) -> Any:
    """A constraint: teeth mesh."""

    def gap(mbs: Any, t: float, item: int, q: Any, v: Any, of_rates: bool) -> Any:
        apart, slopes = teeth(size, sides, period, q)
        return np.array([slopes @ np.array(v) if of_rates else apart])

    return gap


def teeth_slope(exu: Any, size: int, sides: Any, period: float) -> Any:
    """Its derivative."""
    return lambda mbs, t, item, q, v, of_rates: exu.MatrixContainer(teeth(size, sides, period, q)[1][None])


def cosine(value: OfTime, slope: OfTime) -> Any:
    """Return the cosine of an angle that is a function of time, and its rate."""
    return lambda t: (np.cos(value(t)), -np.sin(value(t)) * slope(t))


def sine(value: OfTime, slope: OfTime) -> Any:
    """Return the sine of an angle that is a function of time, and its rate."""
    return lambda t: (np.sin(value(t)), np.cos(value(t)) * slope(t))


def planes_gap(normals: Any, base: Any) -> Any:
    """A constraint: the place of a node stays in planes through another."""

    def gap(mbs: Any, t: float, item: int, q: Any, v: Any, of_rates: bool) -> Any:
        return normals @ (np.array(v)[:3] if of_rates else np.array(q)[:3] - base)

    return gap


def planes_slope(exu: Any, normals: Any, size: int) -> Any:
    """Its derivative; size: coordinates of the node."""
    slope = np.hstack([normals, np.zeros((len(normals), size - 3))])
    return lambda mbs, t, item, q, v, of_rates: exu.MatrixContainer(slope)
