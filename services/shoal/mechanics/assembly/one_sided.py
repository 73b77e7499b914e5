"""One-sided constraints of joints: stops of hinges and sliders, ropes and struts."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.assembly.loads import ElementForceLaw, Measures
from shoal.mechanics.forces import DISTANCE, PLACE
from shoal.mechanics.gaps import Gaps
from shoal.mechanics.numerics.tile import Number, stacked
from shoal.mechanics.reach import span
from shoal.scene import Distance, Revolute, Slider

RESOLUTION = 1e-12
"""Gaps below this part of the machine's size, or below it in rad, are closed: a thousand times round-off."""
BEYOND = 1e-6
"""Starts farther beyond a limit than this part of the machine's size, or than this in rad, are none."""
LOWER, UPPER = 1.0, -1.0


class OneSided(Measures):
    """Measures of one-sided constraints: each is a force element without a force, whose natural value is the limit."""

    beyond: Any = np.zeros(1, dtype=bool)
    """Which lanes start beyond a limit, (lanes,) or (1,)."""

    def gaps(self) -> Gaps:
        """Return the constraints as arrays. Raises InputError where a scene without lanes starts beyond a limit."""
        self.fields: list[str] = []
        self.signs: list[Number] = []
        self.restitutions: list[Number] = []
        for name, joint in self.scene.joints.items():
            if isinstance(joint, Revolute | Slider) and joint.stops is not None:
                for field, sign, limit in (("min", LOWER, joint.stops.min), ("max", UPPER, joint.stops.max)):
                    if limit is not None:
                        place = self._stop(name, joint, limit)
                        self._add(f"joints.{name}.stops", field, place, sign, limit, joint.stops.restitution)
            if isinstance(joint, Distance) and joint.keeps != "exactly":
                place, limit = self._apart(name, joint)
                sign = UPPER if joint.keeps == "at-most" else LOWER
                self._add(f"joints.{name}.keeps", "", place, sign, limit, joint.restitution)
        resolution = RESOLUTION * float(np.max(span(self.scene))) if self.kinds else 0.0
        return Gaps(len(self.kinds), self.forces(), stacked(self.signs), stacked(self.restitutions), resolution)

    def _add(self, field: str, side: str, place: Number, sign: float, limit: Number, restitution: Number) -> None:
        """Add the side of a measure; place: where it is at the start [rad or m]."""
        self.fields.append(field)
        self.signs.append(sign)
        self.restitutions.append(restitution)
        beyond = np.ravel(sign * (np.asarray(place) - limit) < -BEYOND * np.max(span(self.scene)))
        if len(beyond) == 1 and beyond[0]:
            start, stop = float(np.ravel(place)[0]), float(np.ravel(limit)[0])
            where = ".".join(filter(None, (field, side)))
            raise InputError(f"{where}: the machine starts beyond this limit, at {start:.6g} where it is {stop:.6g}")
        self.beyond = self.beyond | beyond

    def _stop(self, name: str, joint: Revolute | Slider, limit: Number) -> Number:
        """Measure the free motion of a joint; returns where it is at the start [rad or m]."""
        law = ElementForceLaw(natural=limit)
        if isinstance(joint, Revolute):
            self._angle(name, joint.first, joint.second, law, joint.axis)
            return self.angles[-1]
        line = self.placement.line(joint.first, joint.direction if joint.axis is None else joint.axis)
        ends = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        self._measure(name, PLACE, [*ends, line], law, 0.0)
        first, second, along = (self.placement.start_of(one)[0] for one in (*ends, line))
        return np.asarray(sum((second - first) * along) / np.sqrt(sum(along**2)))

    def _apart(self, name: str, joint: Distance) -> tuple[Number, Number]:
        """Measure a distance; returns what it is at the start, and its limit [m]."""
        ends = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        first, second = (self.placement.start_of(end)[0] for end in ends)
        start = np.sqrt(sum((second - first) ** 2))
        limit = start if joint.length is None or joint.length.number is None else joint.length.number
        self._measure(name, DISTANCE, ends, ElementForceLaw(natural=limit), 0.0)
        return start, limit
