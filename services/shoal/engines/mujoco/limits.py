"""Stops, ropes and struts as MuJoCo's limits: springs with dampers that push and do not pull, for a second opinion."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from shoal.mechanics.machine import Machine
from shoal.scene import Distance, Scene
from shoal.scene.joints import Stops

STEPS = 20.0
"""Steps of the integrator during a contact: half a period of the limit's spring."""
MOST = 5.0
"""Largest damping ratio, which gives back a hundredth of the rate: more is too stiff for the step."""
FAR = 1e9
"""Range to a side without a stop [rad or m]."""


class SpringDamper(NamedTuple):
    """A spring with a damper that does not pull. stiffness [1/s^2] and damping [1/s]: per mass that it feels"""

    stiffness: float
    damping: float

    @classmethod
    def of(cls, restitution: float, step: float) -> SpringDamper:
        """Return the one that gives back so much of the rate, as stiff as a step [s] resolves."""
        rate = np.pi / (STEPS * step)
        return cls(rate**2, 2.0 * damping_ratio(restitution) * rate)

    def attributes(self, of: str) -> dict[str, str]:
        """Return the attributes of MJCF; of: a limit, or nothing of a contact."""
        return {f"solimp{of}": "0.9999 0.9999 0.001 0.5 2", f"solref{of}": f"{-self.stiffness!r} {-self.damping!r}"}


class Limit(NamedTuple):
    """A limit of MuJoCo's. range: of a joint's coordinate, which is zero at the start, or of a length [rad or m]"""

    range: tuple[float, float]
    spring: SpringDamper

    @property
    def attributes(self) -> dict[str, str]:
        """Return the attributes of MJCF."""
        low, high = self.range
        return {"limited": "true", "range": f"{low!r} {high!r}", **self.spring.attributes("limit")}


def limit_of(stops: Stops, start: float, sign: float, step: float) -> Limit:
    """Return the limit of a joint. start: of its free motion [rad or m]; sign: of MuJoCo's coordinate against that."""
    low, high = (None if end is None else sign * (end - start) for end in (stops.min, stops.max))
    low, high = (low, high) if sign > 0 else (high, low)
    ends = (-FAR if low is None else float(low), FAR if high is None else float(high))
    return Limit(ends, SpringDamper.of(stops.restitution, step))


def limit_of_length(joint: Distance, length: float, step: float) -> Limit:
    """Return the limit of a rope's or a strut's length [m]."""
    ends = (0.0, length) if joint.keeps == "at-most" else (length, FAR)
    return Limit(ends, SpringDamper.of(joint.restitution, step))


def damping_ratio(restitution: float) -> float:
    """Return the damping ratio of a linear contact that cannot pull and gives back so much of the rate."""
    if restitution >= kept(0.0):
        return 0.0
    return MOST if restitution <= kept(MOST) else float(brentq(lambda ratio: kept(ratio) - restitution, 0.0, MOST))


def kept(ratio: float) -> float:
    """Return the rate after a contact over that before, until the force of spring and damper vanishes.

    exp(-2 z arccos z / sqrt(1 - z^2)), beyond the critical damping with the hyperbolic functions.
    """
    if abs(ratio - 1.0) < 1e-9:
        return float(np.exp(-2.0))
    turned = np.arccos(ratio) if ratio < 1.0 else np.arccosh(ratio)
    return float(np.exp(-2.0 * ratio * turned / np.sqrt(abs(1.0 - ratio * ratio))))


def start_of_hinges(scene: Scene) -> dict[str, float]:
    """Return the angles of hinges with stops at the start, as the mechanics counts them [rad]."""
    model: Any = Machine.of(scene).model()
    angles = zip(model.gap_fields, np.ravel(model.gap_angles[:, 0]), strict=True)
    return {field.split(".")[1]: float(angle) for field, angle in angles if ".stops" in field}
