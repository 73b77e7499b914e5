"""What must not happen: MARKER.QUANTITY < NUMBER, or >. Margins are positive as long as it does not."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from shoal.errors import InputError
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

UNITS = {
    "x": "m",
    "y": "m",
    "z": "m",
    "angle": "rad",
    "vx": "m/s",
    "vy": "m/s",
    "vz": "m/s",
    "speed": "m/s",
    "rate": "rad/s",
}
QUANTITIES = {2: ("x", "y", "angle", "vx", "vy", "speed", "rate"), 3: ("x", "y", "z", "vx", "vy", "vz", "speed")}
"""By dimensions."""
"""Of a marker, with their units."""
FORM = '"MARKER.QUANTITY < NUMBER", with <, > and abs(MARKER.QUANTITY)'
_EXPRESSION = re.compile(r"^\s*(abs\()?\s*([^\s()<>]+)\.(\w+)\s*(\))?\s*(<|>)=?\s*(\S+)\s*$")


@dataclass(frozen=True)
class Limit:
    """Passed where a quantity of a marker lies beyond a bound: above it or below it, its absolute value or itself."""

    text: str
    marker: str
    quantity: str
    above: bool
    bound: float
    absolute: bool = False

    @property
    def unit(self) -> str:
        """Of the bound and the margin."""
        return UNITS[self.quantity]

    def margin(self, of: Array) -> Array:
        """How far the quantity is from the bound, negative beyond it."""
        value = np.abs(of) if self.absolute else of
        return np.asarray(self.bound - value if self.above else value - self.bound)

    def margins(self, motion: Trajectory) -> Array:
        """Of every lane at every instant, (lanes, instants). Raises InputError."""
        return self.margin(_quantity(motion, self.marker, self.quantity).T)


def limit(text: str, scene: Scene) -> Limit:
    """What a user wrote. Raises InputError."""
    found = _EXPRESSION.match(text)
    if found is None or bool(found[1]) != bool(found[4]):
        raise InputError(f"limit: {text!r} is not {FORM}")
    _, marker, quantity, _, sign, number = found.groups()
    if marker not in scene.markers:
        raise InputError(f"limit: {text}: no marker {marker!r}; there are {', '.join(scene.markers)}")
    if quantity not in (known := QUANTITIES[scene.dimensions]):
        raise InputError(f"limit: {text}: no quantity {quantity!r}; there are {', '.join(known)}")
    try:
        bound = float(number)
    except ValueError:
        bound = float("nan")
    if not np.isfinite(bound):
        raise InputError(f"limit: {text}: {number!r} is no finite number; write {FORM}")
    return Limit(text.strip(), marker, quantity, sign == ">", bound, bool(found[1]))


def _quantity(motion: Trajectory, marker: str, quantity: str) -> Array:
    """(instants, lanes)."""
    k = motion.markers.index(marker)
    if quantity in motion.axes:
        return np.asarray(motion.points[:, k, motion.axes.index(quantity)])
    if quantity == "angle":
        return np.asarray(motion.angles[:, k])
    if motion.velocities is None or motion.rates is None:
        raise InputError(f"limit: engine {motion.engine} does not tell {quantity}; there are x, y, angle")
    if quantity == "rate":
        return np.asarray(motion.rates[:, k])
    velocity = motion.velocities[:, k]
    return np.asarray(
        np.linalg.norm(velocity, axis=1) if quantity == "speed" else velocity[:, motion.axes.index(quantity[1])]
    )
