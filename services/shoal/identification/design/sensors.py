"""What could be measured: by a camera, by encoders, and by sensors on the machine."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shoal.errors import InputError
from shoal.identification.design.asked import ANGLE
from shoal.identification.design.precision import Bundle
from shoal.identification.recording.felt import is_flexible
from shoal.identification.recording.source import Channel, Quantity
from shoal.scene import Scene
from shoal.scene.bodies import Rod
from shoal.scene.joints import Revolute

_SAME = 1e-3
"""Two places whose sensitivities differ by less tell the same."""
_TILTS = 8
"""Directions of an accelerometer of one axis that are tried, over half a turn; the other half differs by the sign."""
_ALONG = (0.02, 0.25, 0.5, 0.75, 0.98)
"""Of the length of a rod: where strain gauges may be."""

Kind = Literal["position", "angle", "rate", "accelerometer", "imu", "one-axis", "force", "torque", "strain"]
_QUANTITIES: dict[Kind, tuple[Quantity, ...]] = {
    "position": ("x", "y"),
    "angle": ("angle",),
    "rate": ("rate",),
    "accelerometer": ("ax", "ay"),
    "imu": ("ax", "ay", "rate"),
    "one-axis": ("ax",),
    "force": ("fx", "fy"),
    "torque": ("torque",),
    "strain": ("strain",),
}


@dataclass(frozen=True)
class Sensor:
    """Something that could be measured. name: of a marker, or of a joint; body, point: where, of a marker.

    quantity: position (x and y), angle, rate, accelerometer (ax and ay), imu (these and the rate), one-axis (ax, turned
    by `tilt` [rad] from the body's x axis), force (fx and fy) and torque of a joint, strain at a `height` [m]
    to: the marker of another body, against which an encoder in the joint between them shows the angle
    """

    name: str
    body: str
    point: str | tuple[float, ...]
    quantity: Kind
    to: str | None = None
    tilt: float = 0.0
    height: float = 0.0

    @property
    def label(self) -> str:
        """For tables."""
        against = f" against {self.to}" if self.to else ""
        shown = [channel.quantity for channel in self.channels]
        what = " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)
        what += f" tilted by {self.tilt:.2g}" if self.quantity == "one-axis" else ""
        if self.quantity == "strain":
            return f"{self.body} at {float(self.point[0]):g} m, strain at height {self.height:g} m"
        return f"{self.name}{against}, {what}"

    @property
    def in_joint(self) -> bool:
        """Whether it stands in a joint."""
        return self.quantity in ("force", "torque")

    @property
    def channels(self) -> tuple[Channel, ...]:
        """As signals."""
        where: dict[str, Any] = {"joint": self.name} if self.in_joint else {"marker": self.name, "to": self.to}
        where |= {"tilt": self.tilt} if self.tilt else {}
        where |= {"height": self.height} if self.height else {}
        return tuple(Channel(quantity=quantity, **where) for quantity in _QUANTITIES[self.quantity])

    def to_json(self) -> dict[str, Any]:
        """Where and what, as `shoal design --json` tells it."""
        place = {"marker": None if self.in_joint else self.name, "joint": self.name if self.in_joint else None}
        where = {"to": self.to, "body": self.body, "point": self.point, "tilt": self.tilt, "height": self.height}
        return {**place, **where, "quantity": self.quantity}


def sensors_of(scene: Scene, known: Collection[str]) -> tuple[Scene, list[Sensor]]:
    """The scene with the markers that they need, and what could be measured; existing markers first.

    known: of what the noise is known: position, angle, rate, acceleration, force, torque, strain
    """
    places: dict[str, tuple[str, Any]] = {name: (m.body, m.point) for name, m in scene.markers.items()}
    for body_name, body in scene.bodies.items():
        for point in body.points:
            if point != "centre":
                places.setdefault(f"{body_name}-{point}", (body_name, point))
    found = [*_of_motion(scene, places, known)]
    bending = [name for name, body in scene.bodies.items() if is_flexible(body)]
    if not bending:
        found += _of_forces(scene, places, known)
    for name in bending if "strain" in known else ():
        rod = scene.bodies[name]
        assert isinstance(rod, Rod)
        for share in () if rod.curvature else _ALONG:
            thick = rod.height if rod.end_height is None else rod.height + share * (rod.end_height - rod.height)
            gauge, at = f"{name}-{100 * share:.0f}-percent", (name, (share * rod.length, 0.0))
            places[gauge] = at
            found.append(Sensor(gauge, *at, "strain", height=thick / 2))
    data = scene.model_dump(mode="json")
    data["markers"] = {name: {"body": body, "point": point} for name, (body, point) in places.items()}
    return Scene.parse(data, scene.name), found


def _of_motion(scene: Scene, places: dict[str, tuple[str, Any]], known: Collection[str]) -> Iterator[Sensor]:
    """Positions, angles, of a joint that two bodies turn in the angle between them too, and rates."""
    quantities: tuple[Literal["position", "angle", "rate"], ...] = ("position", "angle", "rate")
    for quantity in quantities:
        if quantity in known:
            yield from (Sensor(name, *place, quantity) for name, place in places.items())
    on = {body: name for name, (body, _) in reversed(places.items())}
    for joint in scene.joints.values() if ANGLE in known else ():
        if isinstance(joint, Revolute) and joint.first.body in on and joint.second.body in on:
            second = on[joint.second.body]
            yield Sensor(second, *places[second], "angle", on[joint.first.body])


def _of_forces(scene: Scene, places: dict[str, tuple[str, Any]], known: Collection[str]) -> Iterator[Sensor]:
    """Accelerometers at every place, of two axes, with a gyroscope, and of one axis at many tilts; load cells."""
    if "acceleration" in known:
        for name, place in places.items():
            yield Sensor(name, *place, "accelerometer")
            if "rate" in known:
                yield Sensor(name, *place, "imu")
            for k in range(_TILTS):
                yield Sensor(name, *place, "one-axis", tilt=k * np.pi / _TILTS)
    for joint in scene.joints:
        if "force" in known:
            yield Sensor(joint, "", "", "force")
        if "torque" in known:
            yield Sensor(joint, "", "", "torque")


def columns_of(bundle: Bundle, sensors: list[Sensor]) -> dict[Sensor, list[int]]:
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
        if size > 0 and not repeated:
            found[sensor] = own
    if not found:
        raise InputError("parameters: no marker and no end of a body moves with any of them")
    return found
