"""Virtual sensors: what accelerometers, load cells and strain gauges on a machine would measure of its motion.

They need the motion of every body, or of two places beside the gauge, for which the scene gets markers of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.identification.recording.source import (
    ACCELERATIONS,
    IN_SPACE,
    MOMENTS,
    PRESSING,
    RATES,
    REACTIONS,
    SIGNAL,
    STRAIN,
    Channel,
)
from shoal.scene import FRAMED, Attachment, Rod, Scene
from shoal.scene.joints import DrivenAngle
from shoal.trajectory import Array, Trajectory

if TYPE_CHECKING:
    from shoal.mechanics.analysis.course import Course
    from shoal.mechanics.analysis.felt import Felt

_GAUGE = 1e-3
"""Length of a strain gauge over that of its rod."""
_BODY, _BEFORE, _BEHIND = "sensed-body-", "sensed-before-", "sensed-behind-"
"""Of the names of markers that sensors need."""


def from_start(times: Array, channels: tuple[Channel, ...]) -> Array:
    """Instants [s] that show some channels at `times`: with the start before them, where turns are counted from it."""
    counted = any(channel.to is not None or channel.is_sensor for channel in channels)
    return np.append(0.0, times) if counted and times[0] > 0.0 else times


def needs_states(scene: Scene, channels: tuple[Channel, ...]) -> bool:
    """Return whether sensors of some channels need more than the motion of bodies: the machine bends, touches, is in
    space or has states, or they show signals.
    """
    if any(channel.quantity == SIGNAL for channel in channels):
        return True
    if scene.dimensions == 3:
        return any(channel.is_sensor for channel in channels)
    bends = any(body.element != "rigid" for body in scene.bodies.values())
    return (bends or scene.touches or bool(scene.states)) and any(channel.is_dynamic for channel in channels)


def engine_options(engine: Engine, scene: Scene, channels: tuple[Channel, ...]) -> dict[str, bool]:
    """Options of an engine's run that give what the sensors of some channels need. Raises InputError if it cannot."""
    if not needs_states(scene, channels):
        return {}
    if not isinstance(engine, GaussEngine):
        quantity = next(channel.quantity for channel in channels if channel.is_sensor)
        where = "in space" if scene.dimensions == 3 else "of a machine that bends, touches or has signals or states"
        raise InputError(f"channels: {quantity} {where} is computed by the engine gauss alone; found {engine.name}")
    return {"whole": True}


def with_sensor_markers(scene: Scene, channels: tuple[Channel, ...]) -> Scene:
    """The scene with the markers that the sensors of some channels need."""
    markers: dict[str, Attachment] = {}
    if any(channel.is_dynamic for channel in channels) and not needs_states(scene, channels):
        markers |= {f"{_BODY}{name}": Attachment(body=name, point=(0.0, 0.0)) for name in scene.bodies}
    for channel in channels:
        if channel.quantity == STRAIN and scene.dimensions == 2:
            at = scene.markers[channel.marker]
            for prefix, place in zip((_BEFORE, _BEHIND), _ends(scene, at), strict=True):
                markers[f"{prefix}{channel.marker}"] = Attachment(body=at.body, point=(place, 0.0))
    return scene.model_copy(update={"markers": {**scene.markers, **markers}}) if markers else scene


def _ends(scene: Scene, at: Attachment) -> tuple[float, float]:
    """Arc lengths of the ends of a strain gauge [m], within its rod."""
    rod = scene.bodies[at.body]
    assert isinstance(rod, Rod)
    s = float(scene.location(at)[0])
    half = 0.5 * _GAUGE * rod.length
    middle = min(max(s, half), rod.length - half)
    return middle - half, middle + half


def sensor_channels(
    trajectory: Trajectory,
    channels: tuple[Channel, ...],
    scene: Scene | None,
    values: Mapping[str, Array],
    mounting: float | Array = 0.0,
) -> dict[int, Array]:
    """Channels of sensors by their number, (samples, lanes), nan where a lane failed. Raises InputError.

    scene, values: of the machine and its lanes; mounting [rad]: of IMUs, a number or (lanes,)
    """
    numbers = [k for k, channel in enumerate(channels) if channel.is_sensor]
    if not numbers:
        return {}
    if scene is None:
        raise InputError(f"channels: {channels[numbers[0]].quantity} cannot be computed from a motion alone")
    planar = scene.dimensions == 2
    found = {k: _strain(trajectory, scene, channels[k]) for k in numbers if planar and channels[k].quantity == STRAIN}
    followed = [k for k in numbers if channels[k].quantity == SIGNAL]
    if followed:
        names = tuple(dict.fromkeys(str(channels[k].signal) for k in followed))
        courses = _signals(trajectory, scene, values, names)
        found |= {k: courses[names.index(str(channels[k].signal))] for k in followed}
    dynamic = [k for k in numbers if k not in found]
    if not dynamic:
        return found
    check_sensors(scene, tuple(channels[k] for k in dynamic))
    # Lanes that differ by their sensors alone share one motion.
    turned = np.atleast_1d(np.asarray(mounting, dtype=float))
    shape = len(trajectory.times), max(trajectory.lanes, len(turned))
    turned = np.broadcast_to(turned, shape[1])
    found |= {k: np.full(shape, np.nan) for k in dynamic}
    joints = tuple(dict.fromkeys(_exerting(channels[k]) for k in dynamic if channels[k].quantity in REACTIONS))
    lanes = _by_states if needs_states(scene, channels) else _by_course
    alone = bool(joints) or scene.alone(values) is not None
    for lane, one in lanes(trajectory, scene, values, channels[dynamic[0]], alone):
        views = slice(None) if trajectory.lanes == 1 else slice(lane, lane + 1)
        for k, signal in _of_lane(one, scene, channels, dynamic, joints, turned[views]).items():
            found[k][:, views] = signal
    return found


def _signals(trajectory: Trajectory, scene: Scene, values: Mapping[str, Array], names: tuple[str, ...]) -> Array:
    """Signals and states along a motion, by their names, (names, samples, lanes); nan where a lane failed."""
    from shoal.mechanics.analysis.signals_along import signals_along  # slow to import

    states = trajectory.states
    if states is None:
        raise InputError(f"channels: signal {names[0]} needs all coordinates, which this motion does not tell")
    alone = scene.alone(values) is not None
    return signals_along(states, trajectory.times, scene, values if alone else {}, names)


def _by_states(
    trajectory: Trajectory, scene: Scene, values: Mapping[str, Array], channel: Channel, alone: bool
) -> Iterator[tuple[int, Felt]]:
    """The lanes that ran to the end, by their states; alone: each on a model of its own."""
    from shoal.mechanics.analysis.felt import lane_of, lanes_of  # slow to import

    states = trajectory.states
    if states is None:
        raise InputError(f"channels: {channel.quantity} needs all coordinates, which this motion does not tell")
    finite = np.all(np.isfinite(states.q) & np.isfinite(states.v), axis=(0, 1))
    whole = np.flatnonzero(finite).tolist()
    if alone and values:
        yield from ((lane, lane_of(states, trajectory.times, scene, values, lane)) for lane in whole)
    else:
        yield from zip(whole, lanes_of(states, trajectory.times, whole), strict=True)


def _by_course(
    trajectory: Trajectory, scene: Scene, values: Mapping[str, Array], channel: Channel, alone: bool
) -> Iterator[tuple[int, Felt]]:
    """The same of a rigid machine in the plane, by the motion of its bodies, of any engine."""
    from shoal.mechanics.analysis.course import machine, machines  # slow to import

    if trajectory.velocities is None or trajectory.rates is None:
        raise InputError(
            f"channels: {channel.quantity} needs rates, of which engine {trajectory.engine} tells none; use gauss"
        )
    course = _course(trajectory, scene)
    motion = course.places, course.angles, course.velocities, course.rates
    whole = [lane for lane in range(trajectory.lanes) if all(np.all(np.isfinite(part[..., lane])) for part in motion)]
    if alone:
        yield from ((lane, machine(scene, values, course, lane)) for lane in whole)
    elif whole:
        yield from zip(whole, machines(scene, values, course, whole), strict=True)


def _of_lane(
    one: Felt, scene: Scene, channels: tuple[Channel, ...], numbers: list[int], joints: tuple[str, ...], turned: Array
) -> dict[int, Array]:
    """Signals of the sensors on one lane, turned by given angles, (samples, angles or 1) each."""
    from shoal.mechanics.analysis.reactions_along import reactions_along  # slow to import

    reactions = reactions_along(one, joints) if joints else {}
    c, s, found = np.cos(turned), np.sin(turned), {}
    for k in numbers:
        channel, axis = channels[k], "xyz".find(channels[k].quantity[1:])
        if channel.quantity in PRESSING:
            found[k] = getattr(reactions[_exerting(channel)], channel.quantity)[:, None]
        elif channel.quantity in REACTIONS:
            force, torque, drive, *_ = reactions[_exerting(channel)]
            vector = torque if channel.quantity in MOMENTS else force
            about = torque if drive is None else drive
            found[k] = about[:, None] if channel.quantity == "torque" else vector[:, [axis]]
        elif channel.quantity == STRAIN:
            found[k] = one.strain(scene.markers[channel.marker], channel.height, channel.side)[:, None]
        else:
            sensed = one.spin if channel.quantity in RATES else one.specific_force
            x, y, *rest = sensed(scene.markers[channel.marker], channel.tilt).T[..., None]
            found[k] = (c * x + s * y, c * y - s * x, *rest)[axis]
    return found


def _exerting(channel: Channel) -> str:
    """Return the joint or the contact, as `reactions_along` names it."""
    return f"contacts.{channel.contact}" if channel.joint is None else channel.joint


def _course(trajectory: Trajectory, scene: Scene) -> Course:
    """The motion of the bodies."""
    from shoal.mechanics.analysis.course import Course  # slow to import

    rows = [trajectory.markers.index(f"{_BODY}{name}") for name in scene.bodies]
    assert trajectory.velocities is not None
    assert trajectory.rates is not None
    places, velocities = trajectory.points[:, rows], trajectory.velocities[:, rows]
    return Course(trajectory.times, places, velocities, trajectory.angles[:, rows], trajectory.rates[:, rows])


def _strain(trajectory: Trajectory, scene: Scene, channel: Channel) -> Array:
    """Strain of a gauge: relative motion and rotation of its ends over its length, (samples, lanes)."""
    begin, end = _ends(scene, scene.markers[channel.marker])
    one, other = (trajectory.markers.index(f"{prefix}{channel.marker}") for prefix in (_BEFORE, _BEHIND))
    apart = np.linalg.norm(trajectory.points[:, other] - trajectory.points[:, one], axis=1)
    turned = trajectory.angles[:, other] - trajectory.angles[:, one]
    return np.asarray((apart - channel.height * turned) / (end - begin) - 1.0)


_BENT = ("curvature", "side_curvature", "twist")
"""Fields that make the unstrained rod curved."""


def check_sensors(scene: Scene, channels: tuple[Channel, ...]) -> None:
    """Return whether a machine can carry the sensors of some channels. Raises InputError."""
    for channel in channels:
        if not channel.is_sensor:
            continue
        what = f"channels: {channel.quantity}"
        if scene.dimensions == 2 and channel.quantity in IN_SPACE:
            raise InputError(f"{what} is measured in space; {scene.name} is a scene in the plane")
        if scene.dimensions == 2 and (isinstance(channel.tilt, tuple) or channel.side):
            field = "side" if channel.side else "tilt"
            wanted = "leave it out" if channel.side else "give one angle"
            raise InputError(f"channels: {field}: {scene.name} is a scene in the plane; {wanted}")
        if channel.contact is not None and channel.contact not in scene.contacts:
            known = ", ".join(scene.contacts) or "none"
            raise InputError(f"{what}: no contact {channel.contact!r}; there are {known}")
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
    """Return whether strain is computed for a rod: straight ones of elements, in space director rods."""
    supported = rod.element == "director-rod" if scene.dimensions == 3 else rod.element not in FRAMED
    return supported and not any(getattr(rod, field) for field in _BENT)


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
        raise InputError(f"{what} is computed for rods of elements; bodies.{at.body}.element is modal, use ancf-cable")
    if scene.dimensions == 3 and rod.element != "director-rod":
        raise InputError(f"{what} is in space computed for director rods; bodies.{at.body}.element is {rod.element}")
    for field in _BENT:
        if getattr(rod, field):
            raise InputError(f"{what} is computed for straight rods; bodies.{at.body}.{field} is not zero")
    share = float(scene.location(at)[0]) / rod.length
    for field, thick, end in (("height", rod.height, rod.end_height), ("side", rod.width or rod.height, rod.end_width)):
        half = 0.5 * (thick + share * ((thick if end is None else end) - thick))
        if abs(getattr(channel, field)) > half * (1 + 1e-9):
            raise InputError(
                f"channels: {field}: {getattr(channel, field):g} m is off the rod; at marker {channel.marker} it "
                f"reaches from {-half:g} to {half:g} m"
            )
