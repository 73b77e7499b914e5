"""What sensors on a machine show of its motion: accelerometers on bodies, load cells in joints, strain gauges on rods.

They need the motion of every body, or of two places beside the gauge, for which the scene gets markers of their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from shoal.errors import InputError
from shoal.identification.recording.source import ACCELERATIONS, STRAIN, Channel
from shoal.scene import Attachment, Rod, Scene
from shoal.trajectory import Array, Trajectory

if TYPE_CHECKING:
    from shoal.mechanics.analysis.felt import Course, Felt

_GAUGE = 1e-3
"""Length of a strain gauge over that of its rod."""
_BODY, _BEFORE, _BEHIND = "sensed-body-", "sensed-before-", "sensed-behind-"
"""Of the names of markers that sensors need."""


def check_felt(scene: Scene, channels: tuple[Channel, ...]) -> None:
    """Whether a machine can carry the sensors of some channels. Raises InputError."""
    for channel in channels:
        if not channel.is_felt:
            continue
        what = f"channels: {channel.quantity}"
        if scene.dimensions != 2:
            raise InputError(f"{what} is measured in the plane; in space x, y and z are")
        if channel.joint is not None and channel.joint not in scene.joints:
            raise InputError(f"{what}: no joint {channel.joint!r}; there are {', '.join(scene.joints) or 'none'}")
        body = "" if channel.joint is not None else scene.markers[channel.marker].body
        bending = {name: one.element for name, one in scene.bodies.items() if one.element != "rigid"}
        if channel.quantity == STRAIN and body not in bending:
            known = f"; flexible are {', '.join(bending)}" if bending else ""
            raise InputError(
                f"{what} is measured on a flexible rod; {body}, with marker {channel.marker}, is rigid{known}"
            )
        if channel.quantity == STRAIN and bending[body] == "modal":
            raise InputError(f"{what} is told of rods of elements; bodies.{body}.element is modal, use ancf-cable")
        rod = scene.bodies.get(body)
        if channel.quantity == STRAIN and isinstance(rod, Rod) and rod.curvature:
            raise InputError(f"{what} is told of straight rods; bodies.{body}.curvature is not zero")
        if channel.quantity == STRAIN and isinstance(rod, Rod):
            _on_its_rod(scene, channel, rod)
        if channel.quantity != STRAIN and bending:
            name, element = next(iter(bending.items()))
            raise InputError(
                f"{what} is told of rigid machines; bodies.{name}.element is {element}, where strain, x, y, angle and "
                "rate can be measured"
            )


def _on_its_rod(scene: Scene, channel: Channel, rod: Rod) -> None:
    """Whether a gauge is within the height of its rod. Raises InputError."""
    share = float(scene.location(scene.markers[channel.marker])[0]) / rod.length
    end = rod.height if rod.end_height is None else rod.end_height
    side = 0.5 * (rod.height + share * (end - rod.height))
    if abs(channel.height) > side * (1 + 1e-9):
        raise InputError(
            f"channels: height: {channel.height:g} m is off the rod; at marker {channel.marker} it reaches from "
            f"{-side:g} to {side:g} m"
        )


def is_flexible(body: object) -> bool:
    """Whether a body is a rod that bends."""
    return isinstance(body, Rod) and body.element != "rigid"


def from_start(times: Array, channels: tuple[Channel, ...]) -> Array:
    """Instants [s] that show some channels at `times`: with the start before them, where turns are counted from it."""
    counted = any(channel.to is not None or channel.is_dynamic for channel in channels)
    return np.append(0.0, times) if counted and times[0] > 0.0 else times


def equipped(scene: Scene, channels: tuple[Channel, ...]) -> Scene:
    """The scene with the markers that the sensors of some channels need."""
    markers: dict[str, Attachment] = {}
    if any(channel.is_dynamic for channel in channels):
        markers |= {f"{_BODY}{name}": Attachment(body=name, point=(0.0, 0.0)) for name in scene.bodies}
    for channel in channels:
        if channel.quantity == STRAIN:
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


def felt(
    trajectory: Trajectory,
    channels: tuple[Channel, ...],
    scene: Scene | None,
    values: Mapping[str, Array],
    mounting: float | Array = 0.0,
) -> dict[int, Array]:
    """Channels of sensors by their number, (samples, lanes), nan where a lane failed. Raises InputError.

    scene, values: of the machine and its lanes; mounting [rad]: of accelerometers, a number or (lanes,)
    """
    numbers = [k for k, channel in enumerate(channels) if channel.is_felt]
    if not numbers:
        return {}
    if scene is None:
        raise InputError(f"channels: {channels[numbers[0]].quantity} is not told by a motion alone")
    found = {k: _strain(trajectory, scene, channels[k]) for k in numbers if channels[k].quantity == STRAIN}
    dynamic = [k for k in numbers if k not in found]
    if not dynamic:
        return found
    check_felt(scene, tuple(channels[k] for k in dynamic))
    if trajectory.velocities is None or trajectory.rates is None:
        quantity = channels[dynamic[0]].quantity
        raise InputError(f"channels: {quantity} needs rates, of which engine {trajectory.engine} tells none; use gauss")
    from shoal.mechanics.analysis.felt import machine, machines  # slow to import

    # Lanes that differ by their sensors alone share one motion.
    turned = np.atleast_1d(np.asarray(mounting, dtype=float))
    shape = len(trajectory.times), max(trajectory.lanes, len(turned))
    turned = np.broadcast_to(turned, shape[1])
    found |= {k: np.full(shape, np.nan) for k in dynamic}
    course = _course(trajectory, scene)
    motion = course.places, course.angles, course.velocities, course.rates
    whole = [lane for lane in range(trajectory.lanes) if all(np.all(np.isfinite(part[..., lane])) for part in motion)]
    if not whole:
        return found
    joints = tuple(dict.fromkeys(c.joint for k in dynamic if (c := channels[k]).joint is not None))
    alone = (machine(scene, values, course, lane) for lane in whole)
    lanes = alone if joints else machines(scene, values, course, whole)
    for lane, one in zip(whole, lanes, strict=True):
        views = slice(None) if trajectory.lanes == 1 else slice(lane, lane + 1)
        for k, signal in _of_lane(one, scene, channels, dynamic, joints, turned[views]).items():
            found[k][:, views] = signal
    return found


def _of_lane(
    one: Felt, scene: Scene, channels: tuple[Channel, ...], numbers: list[int], joints: tuple[str, ...], turned: Array
) -> dict[int, Array]:
    """What accelerometers, turned by some angles, and load cells show of one lane, (samples, angles or 1) each."""
    from shoal.mechanics.analysis.load_cells import reactions_along  # slow to import

    reactions = reactions_along(one, joints) if joints else {}
    c, s, found = np.cos(turned), np.sin(turned), {}
    for k in numbers:
        channel = channels[k]
        if channel.joint is not None:
            force, torque = reactions[channel.joint]
            signal = torque if channel.quantity == "torque" else force[:, "xy".index(channel.quantity[1])]
            found[k] = signal[:, None]
        else:
            x, y = one.specific_force(scene.markers[channel.marker], channel.tilt).T[..., None]
            found[k] = c * x + s * y if channel.quantity == ACCELERATIONS[0] else c * y - s * x
    return found


def _course(trajectory: Trajectory, scene: Scene) -> Course:
    """The motion of the bodies."""
    from shoal.mechanics.analysis.felt import Course  # slow to import

    rows = [trajectory.markers.index(f"{_BODY}{name}") for name in scene.bodies]
    assert trajectory.velocities is not None
    assert trajectory.rates is not None
    places, velocities = trajectory.points[:, rows], trajectory.velocities[:, rows]
    return Course(trajectory.times, places, velocities, trajectory.angles[:, rows], trajectory.rates[:, rows])


def _strain(trajectory: Trajectory, scene: Scene, channel: Channel) -> Array:
    """Of a gauge: how its ends move apart, and at a height turn, over its length, (samples, lanes)."""
    begin, end = _ends(scene, scene.markers[channel.marker])
    one, other = (trajectory.markers.index(f"{prefix}{channel.marker}") for prefix in (_BEFORE, _BEHIND))
    apart = np.linalg.norm(trajectory.points[:, other] - trajectory.points[:, one], axis=1)
    turned = trajectory.angles[:, other] - trajectory.angles[:, one]
    return np.asarray((apart - channel.height * turned) / (end - begin) - 1.0)
