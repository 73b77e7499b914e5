"""Candidates of a measurement: by a camera, by encoders, and by sensors on the machine."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shoal.errors import InputError
from shoal.identification.conventions import DIFFERENCE
from shoal.identification.design.asked import ANGLE
from shoal.identification.design.precision import Bundle
from shoal.identification.recording.source import ACCELERATIONS, FORCES, MOMENTS, RATES, Channel, Quantity
from shoal.identification.recording.virtual_sensors import has_axes, takes_gauges
from shoal.scene import Scene
from shoal.scene.bodies import Rod
from shoal.scene.joints import Revolute

_SAME = 1e-3
"""Two places whose sensitivities differ by less tell the same."""
_TILTS = 8
"""Directions of an accelerometer of one axis that are tried, over half a turn; the other half differs by the sign."""
_DIRECTIONS = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1))
"""The same in space: along the axes of a body, and halfway between two."""
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
_IN_SPACE: dict[Kind, tuple[Quantity, ...]] = {
    **_QUANTITIES,
    "position": ("x", "y", "z"),
    "rate": RATES,
    "accelerometer": ACCELERATIONS,
    "imu": (*ACCELERATIONS, *RATES),
    "force": FORCES,
    "torque": MOMENTS,
}


@dataclass(frozen=True)
class Sensor:
    """Something that could be measured. name: of a marker, or of a joint; body, point: where, of a marker.

    quantity: position (x and y), angle, rate, accelerometer (ax and ay), imu (these and the rate), one-axis (ax, turned
    by `tilt` [rad] from the body's x axis), force (fx and fy) and torque of a joint, strain at a `height` [m]
    to: the marker of another body, against which an encoder in the joint between them shows the angle
    in_space: of three components each; tilt is then a rotation vector, and strain may be to a `side` [m]
    """

    name: str
    body: str
    point: str | tuple[float, ...]
    quantity: Kind
    to: str | None = None
    tilt: float | tuple[float, ...] = 0.0
    height: float = 0.0
    side: float = 0.0
    in_space: bool = False

    @property
    def label(self) -> str:
        """For tables."""
        against = f" against {self.to}" if self.to else ""
        shown = [channel.quantity for channel in self.channels]
        what = " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)
        if self.quantity == "one-axis":
            tilt = ", ".join(f"{part:.2g}" for part in np.atleast_1d(self.tilt))
            what += f" tilted by {f'({tilt})' if isinstance(self.tilt, tuple) else tilt}"
        if self.quantity == "strain":
            where = f"to the side by {self.side:g} m" if self.side else f"at height {self.height:g} m"
            return f"{self.body} at {float(self.point[0]):g} m, strain {where}"
        return f"{self.name}{against}, {what}"

    @property
    def in_joint(self) -> bool:
        """Return whether it stands in a joint."""
        return self.quantity in ("force", "torque")

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Return them as signals."""
        where: dict[str, Any] = {"joint": self.name} if self.in_joint else {"marker": self.name, "to": self.to}
        where |= {"tilt": self.tilt} if self.tilt else {}
        where |= {"height": self.height} if self.height else {}
        where |= {"side": self.side} if self.side else {}
        quantities = _IN_SPACE if self.in_space else _QUANTITIES
        return tuple(Channel(quantity=quantity, **where) for quantity in quantities[self.quantity])

    def to_json(self) -> dict[str, Any]:
        """Place and quantity, as `shoal design --json` prints them."""
        place = {"marker": None if self.in_joint else self.name, "joint": self.name if self.in_joint else None}
        where = {"to": self.to, "body": self.body, "point": self.point, "tilt": self.tilt, "height": self.height}
        return {**place, **where, **({"side": self.side} if self.in_space else {}), "quantity": self.quantity}


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
    found += _of_forces(scene, places, known)
    for name, rod in scene.bodies.items() if "strain" in known else ():
        if isinstance(rod, Rod) and takes_gauges(scene, rod):
            found += _on_its_sides(name, rod, places, scene.dimensions == 3)
    data = scene.model_dump(mode="json")
    data["markers"] = {name: {"body": body, "point": point} for name, (body, point) in places.items()}
    return Scene.parse(data, scene.name), found


def _on_its_sides(name: str, rod: Rod, places: dict[str, tuple[str, Any]], in_space: bool) -> Iterator[Sensor]:
    """Strain gauges on top of a rod and, in space, beside it; their places are added."""
    width = rod.width or rod.height
    for share in _ALONG:
        high = rod.height if rod.end_height is None else rod.height + share * (rod.end_height - rod.height)
        wide = width if rod.end_width is None else width + share * (rod.end_width - width)
        gauge, at = f"{name}-{100 * share:.0f}-percent", (name, (share * rod.length, 0.0))
        places[gauge] = at
        yield Sensor(gauge, *at, "strain", height=high / 2, in_space=in_space)
        if in_space:
            yield Sensor(gauge, *at, "strain", side=wide / 2, in_space=True)


def _of_motion(scene: Scene, places: dict[str, tuple[str, Any]], known: Collection[str]) -> Iterator[Sensor]:
    """Positions, angles, of a joint that two bodies turn in the angle between them too, and rates."""
    in_space = scene.dimensions == 3
    quantities: tuple[Literal["position", "angle", "rate"], ...] = ("position", "angle", "rate")
    for quantity in quantities:
        if quantity in known and not (in_space and quantity == "angle"):
            for name, place in places.items():
                if quantity != "rate" or has_axes(scene, place[0]):
                    yield Sensor(name, *place, quantity, in_space=in_space)
    if in_space:
        return
    on = {body: name for name, (body, _) in reversed(places.items())}
    for joint in scene.joints.values() if ANGLE in known else ():
        if isinstance(joint, Revolute) and joint.first.body in on and joint.second.body in on:
            second = on[joint.second.body]
            yield Sensor(second, *places[second], "angle", on[joint.first.body])


def _of_forces(scene: Scene, places: dict[str, tuple[str, Any]], known: Collection[str]) -> Iterator[Sensor]:
    """Accelerometers at every place, of two axes, with a gyroscope, and of one axis at many tilts; load cells."""
    in_space = scene.dimensions == 3
    tilts = [_towards(axis) for axis in _DIRECTIONS] if in_space else [k * np.pi / _TILTS for k in range(_TILTS)]
    for name, place in places.items() if "acceleration" in known else ():
        if not has_axes(scene, place[0]):
            continue
        yield Sensor(name, *place, "accelerometer", in_space=in_space)
        if "rate" in known:
            yield Sensor(name, *place, "imu", in_space=in_space)
        for tilt in tilts:
            yield Sensor(name, *place, "one-axis", tilt=tilt, in_space=in_space)
    for joint in scene.joints:
        if "force" in known:
            yield Sensor(joint, "", "", "force", in_space=in_space)
        if "torque" in known:
            yield Sensor(joint, "", "", "torque", in_space=in_space)


def _towards(axis: tuple[int, ...]) -> tuple[float, ...]:
    """The rotation vector that turns the x axis to another one by the least angle."""
    along = np.array(axis) / np.linalg.norm(axis)
    about = np.cross((1.0, 0.0, 0.0), along)
    sine = float(np.linalg.norm(about))
    # Adding zero makes -0 a zero that tables show without its sign.
    return tuple((about * (np.arctan2(sine, along[0]) / sine) + 0.0).tolist()) if sine else (0.0, 0.0, 0.0)


def columns_of(bundle: Bundle, sensors: list[Sensor]) -> dict[Sensor, list[int]]:
    """The channels of each sensor, without those that show nothing or the same as one before."""
    found: dict[Sensor, list[int]] = {}
    place = bundle.present
    for sensor in sensors:
        own = list(range(place, place + len(sensor.channels)))
        place = own[-1] + 1
        mine = bundle.table[:, own] * bundle.span
        size = float(np.linalg.norm(mine))
        same = [k for k in found.values() if len(k) == len(own)]
        repeated = any(np.linalg.norm(bundle.table[:, k] * bundle.span - mine) < _SAME * size for k in same)
        if size > DIFFERENCE and not repeated:
            found[sensor] = own
    if not found:
        raise InputError("parameters: no marker and no end of a body moves with any of them")
    return found
