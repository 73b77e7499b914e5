"""What could be measured: the position or the angle of a marker, or of a named point of a body, or a joint's angle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shoal.errors import InputError
from shoal.identification.design.precision import Bundle
from shoal.identification.recording.source import Channel
from shoal.scene import Scene
from shoal.scene.joints import Revolute

_SAME = 1e-3
"""Two places whose sensitivities differ by less tell the same."""


@dataclass(frozen=True)
class Sensor:
    """Something that could be measured. body, point: where; quantity: position (x and y) or angle.

    to: the marker of another body, against which an encoder in the joint between them shows the angle
    """

    name: str
    body: str
    point: str | tuple[float, float]
    quantity: Literal["position", "angle"]
    to: str | None = None

    @property
    def label(self) -> str:
        """For tables."""
        against = f" against {self.to}" if self.to else ""
        return f"{self.name}{against}, {'x and y' if self.quantity == 'position' else 'angle'}"

    @property
    def channels(self) -> tuple[Channel, ...]:
        """As signals."""
        quantities: tuple[Any, ...] = ("x", "y") if self.quantity == "position" else ("angle",)
        return tuple(Channel(marker=self.name, quantity=quantity, to=self.to) for quantity in quantities)


def sensors_of(scene: Scene) -> tuple[Scene, list[Sensor]]:
    """The scene with markers at all its bodies' named points, and what they could show; existing markers first.

    Of a joint that two bodies turn in, the angle between them too.
    """
    places: dict[str, tuple[str, Any]] = {name: (m.body, m.point) for name, m in scene.markers.items()}
    for body_name, body in scene.bodies.items():
        for point in body.points:
            if point != "centre":
                places.setdefault(f"{body_name}-{point}", (body_name, point))
    data = scene.model_dump(mode="json")
    data["markers"] = {name: {"body": body, "point": point} for name, (body, point) in places.items()}
    quantities: tuple[Literal["position", "angle"], ...] = ("position", "angle")
    found = [Sensor(name, *place, quantity) for quantity in quantities for name, place in places.items()]
    on = {body: name for name, (body, _) in reversed(places.items())}
    for joint in scene.joints.values():
        if isinstance(joint, Revolute) and joint.first.body in on and joint.second.body in on:
            second = on[joint.second.body]
            found.append(Sensor(second, *places[second], "angle", on[joint.first.body]))
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
