"""Which sensors a machine can carry."""

from __future__ import annotations

from shoal.errors import InputError
from shoal.identification.recording.source import ACCELERATIONS, IN_SPACE, RATES, STRAIN, Channel
from shoal.scene import FRAMED, Rod, Scene
from shoal.scene.joints import DrivenAngle

_BENT = ("curvature", "side_curvature", "twist")
"""Fields that make the unstrained rod curved."""


def check_felt(scene: Scene, channels: tuple[Channel, ...]) -> None:
    """Return whether a machine can carry the sensors of some channels. Raises InputError."""
    for channel in channels:
        if not channel.is_felt:
            continue
        what = f"channels: {channel.quantity}"
        if scene.dimensions == 2 and channel.quantity in IN_SPACE:
            raise InputError(f"{what} is measured in space; {scene.name} is a scene in the plane")
        if scene.dimensions == 2 and (isinstance(channel.tilt, tuple) or channel.side):
            field = "side" if channel.side else "tilt"
            wanted = "leave it out" if channel.side else "give one angle"
            raise InputError(f"channels: {field}: {scene.name} is a scene in the plane; {wanted}")
        if channel.joint is not None:
            _in_a_joint(scene, channel, channel.joint)
        elif channel.quantity == STRAIN:
            _on_a_rod(scene, channel)
        elif channel.quantity in (*ACCELERATIONS, *RATES):
            _on_a_body(scene, channel)


def _in_a_joint(scene: Scene, channel: Channel, name: str) -> None:
    joint = scene.joints.get(name)
    if joint is None:
        known = ", ".join(scene.joints) or "none"
        raise InputError(f"channels: {channel.quantity}: no joint {name!r}; there are {known}")
    if channel.quantity == "torque" and scene.dimensions == 3 and not isinstance(joint, DrivenAngle):
        raise InputError(
            f"channels: torque is in space that of a driven-angle about its axis; joint {name} is a {joint.kind}, of "
            "which mx, my and mz are measured"
        )


def _on_a_body(scene: Scene, channel: Channel) -> None:
    name = scene.markers[channel.marker].body
    if not has_axes(scene, name):
        raise InputError(
            f"channels: {channel.quantity} is measured along the axes of a section, which a cable in space has not; "
            f"make bodies.{name}.element director-rod"
        )


def has_axes(scene: Scene, body: str) -> bool:
    """Return whether a body has axes along which something on it is measured: cables in space have none."""
    return scene.dimensions == 2 or scene.bodies[body].element not in ("ancf-cable", "ancf-quintic")


def takes_gauges(scene: Scene, rod: Rod) -> bool:
    """Return whether the strain of a rod is told: of straight ones of elements, in space of director rods."""
    told = rod.element == "director-rod" if scene.dimensions == 3 else rod.element not in FRAMED
    return told and not any(getattr(rod, field) for field in _BENT)


def _on_a_rod(scene: Scene, channel: Channel) -> None:
    what, at = f"channels: {STRAIN}", scene.markers[channel.marker]
    rod = scene.bodies[at.body]
    bending = [name for name, one in scene.bodies.items() if one.element != "rigid"]
    if at.body not in bending:
        known = f"; flexible are {', '.join(bending)}" if bending else ""
        raise InputError(
            f"{what} is measured on a flexible rod; {at.body}, with marker {channel.marker}, is rigid{known}"
        )
    if rod.element == "modal" or not isinstance(rod, Rod):
        raise InputError(f"{what} is told of rods of elements; bodies.{at.body}.element is modal, use ancf-cable")
    if scene.dimensions == 3 and rod.element != "director-rod":
        raise InputError(f"{what} is in space told of director rods; bodies.{at.body}.element is {rod.element}")
    for field in _BENT:
        if getattr(rod, field):
            raise InputError(f"{what} is told of straight rods; bodies.{at.body}.{field} is not zero")
    share = float(scene.location(at)[0]) / rod.length
    for field, thick, end in (("height", rod.height, rod.end_height), ("side", rod.width or rod.height, rod.end_width)):
        half = 0.5 * (thick + share * ((thick if end is None else end) - thick))
        if abs(getattr(channel, field)) > half * (1 + 1e-9):
            raise InputError(
                f"channels: {field}: {getattr(channel, field):g} m is off the rod; at marker {channel.marker} it "
                f"reaches from {-half:g} to {half:g} m"
            )
