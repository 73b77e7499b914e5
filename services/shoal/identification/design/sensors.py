"""What could be measured: the position or the angle of a marker, or of a named point of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shoal.errors import InputError
from shoal.identification.design.precision import Bundle
from shoal.identification.recording.source import Channel
from shoal.scene import Scene

_SAME = 1e-3
"""Two places whose sensitivities differ by less tell the same."""


@dataclass(frozen=True)
class Sensor:
    """Something that could be measured. body, point: where; quantity: position (x and y) or angle."""

    name: str
    body: str
    point: str | tuple[float, float]
    quantity: Literal["position", "angle"]

    @property
    def label(self) -> str:
        """For tables."""
        return f"{self.name}, {'x and y' if self.quantity == 'position' else 'angle'}"

    @property
    def channels(self) -> tuple[Channel, ...]:
        """As signals."""
        quantities: tuple[Any, ...] = ("x", "y") if self.quantity == "position" else ("angle",)
        return tuple(Channel(marker=self.name, quantity=quantity) for quantity in quantities)


def sensors_of(scene: Scene) -> tuple[Scene, list[Sensor]]:
    """The scene with markers at all its bodies' named points, and what they could show; existing markers first."""
    places: dict[str, tuple[str, Any]] = {name: (m.body, m.point) for name, m in scene.markers.items()}
    for body_name, body in scene.bodies.items():
        for point in body.points:
            if point != "centre":
                places.setdefault(f"{body_name}-{point}", (body_name, point))
    data = scene.model_dump(mode="json")
    data["markers"] = {name: {"body": body, "point": point} for name, (body, point) in places.items()}
    quantities: tuple[Literal["position", "angle"], ...] = ("position", "angle")
    found = [Sensor(name, *place, quantity) for quantity in quantities for name, place in places.items()]
    return Scene.parse(data, scene.name), found


def columns_of(bundle: Bundle, sensors: list[Sensor], angles: bool) -> dict[Sensor, list[int]]:
    """The channels of each sensor, without those that tell nothing or the same as one before."""
    found: dict[Sensor, list[int]] = {}
    place = bundle.present
    for sensor in sensors:
        own = list(range(place, place + len(sensor.channels)))
        place = own[-1] + 1
        mine = bundle.table[:, own] * bundle.span
        size = float(np.linalg.norm(mine))
        same = [k for k in found.values() if len(k) == len(own)]
        repeated = any(np.linalg.norm(bundle.table[:, k] * bundle.span - mine) < _SAME * size for k in same)
        if size > 0 and not repeated and (angles or sensor.quantity == "position"):
            found[sensor] = own
    if not found:
        raise InputError("parameters: no marker and no end of a body moves with any of them")
    return found
