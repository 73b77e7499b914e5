"""Stops of joints: one-sided limits of the angle of a hinge, and of the place of a slider on its line."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.assembly.loads import ElementForceLaw, Measures
from shoal.mechanics.forces import PLACE
from shoal.mechanics.gaps import Gaps
from shoal.mechanics.numerics.tile import Number, stacked
from shoal.mechanics.reach import span
from shoal.scene import Revolute, Slider

RESOLUTION = 1e-12
"""Gaps below this part of the machine's size, or below it in rad, are closed: a thousand times round-off."""
BEYOND = 1e-6
"""Starts farther beyond a stop than this part of the machine's size, or than this in rad, are none."""
LOWER, UPPER = 1.0, -1.0


class Stops(Measures):
    """Measures of stops: each is a force element without a force, whose natural value is the limit."""

    beyond: Any = np.zeros(1, dtype=bool)
    """Which lanes start beyond a stop, (lanes,) or (1,)."""

    def gaps(self) -> Gaps:
        """Return the stops as arrays. Raises InputError where a scene without lanes starts beyond a stop."""
        self.signs: list[Number] = []
        self.restitutions: list[Number] = []
        for name, joint in self.scene.joints.items():
            if isinstance(joint, Revolute | Slider) and joint.stops is not None:
                for field, sign, limit in (("min", LOWER, joint.stops.min), ("max", UPPER, joint.stops.max)):
                    if limit is not None:
                        place = self._add(name, joint, limit)
                        self.signs.append(sign)
                        self.restitutions.append(joint.stops.restitution)
                        self._check(f"joints.{name}.stops.{field}", place, sign, limit)
        resolution = RESOLUTION * float(np.max(span(self.scene)))
        return Gaps(len(self.kinds), self.forces(), stacked(self.signs), stacked(self.restitutions), resolution)

    def _add(self, name: str, joint: Revolute | Slider, limit: Number) -> Number:
        """Add a measure; returns where it is at the start [rad or m]."""
        law = ElementForceLaw(natural=limit)
        if isinstance(joint, Revolute):
            self._angle(name, joint.first, joint.second, law, joint.axis)
            return self.angles[-1]
        line = self.placement.line(joint.first, joint.direction if joint.axis is None else joint.axis)
        ends = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        self._measure(name, PLACE, [*ends, line], law, 0.0)
        first, second, along = (self.placement.start_of(one)[0] for one in (*ends, line))
        return np.asarray(sum((second - first) * along) / np.sqrt(sum(along**2)))

    def _check(self, field: str, place: Number, sign: Number, limit: Number) -> None:
        beyond = np.ravel(sign * (np.asarray(place) - limit) < -BEYOND * np.max(span(self.scene)))
        if len(beyond) == 1 and beyond[0]:
            start, stop = float(np.ravel(place)[0]), float(np.ravel(limit)[0])
            raise InputError(f"{field}: the machine starts beyond this stop, at {start:.6g} where it is {stop:.6g}")
        self.beyond = self.beyond | beyond
