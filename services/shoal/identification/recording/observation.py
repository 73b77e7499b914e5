"""From the motion of markers to what a recording shows: by a camera and sensors, in the order of the channels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.identification.recording.source import Channel, Clocked
from shoal.identification.recording.virtual_sensors import sensor_channels
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory


class Camera(NamedTuple):
    """Camera that sees positions: at rotation(-tilt) (X - [x, y]) / scale, z at z / scale; numbers or (lanes,).

    mounting and biases: of inertial sensors, see `Clocked`
    """

    scale: float | Array = 1.0
    x: float | Array = 0.0
    y: float | Array = 0.0
    tilt: float | Array = 0.0
    mounting: float | Array = 0.0
    bias_ax: float | Array = 0.0
    bias_ay: float | Array = 0.0
    bias_az: float | Array = 0.0
    bias_rate: float | Array = 0.0
    bias_wx: float | Array = 0.0
    bias_wy: float | Array = 0.0
    bias_wz: float | Array = 0.0


STRAIGHT = Camera()


def camera(stated: Clocked) -> Camera:
    """The camera that a recording states."""
    return Camera(*(getattr(stated, name) for name in Camera._fields))


def without_turns(seen: Array, channels: tuple[Channel, ...]) -> Array:
    """Channels (lanes, samples, channels), angles between two bodies less their whole turns at the first sample.

    What a recording shows of them has lost these.
    """
    between = [channel.to is not None and channel.quantity == "angle" for channel in channels]
    if not any(between):
        return seen
    first = np.where(between, seen[:, :1], 0.0)
    return np.asarray(seen - 2 * np.pi * np.round(first / (2 * np.pi)))


def observe(
    trajectory: Trajectory,
    channels: tuple[Channel, ...],
    seen_by: Camera = STRAIGHT,
    scene: Scene | None = None,
    values: Mapping[str, Array] | None = None,
) -> Array:
    """The channels of a trajectory, (lanes, samples, channels). Raises InputError if its engine gives no rates.

    scene, values by path, one for each lane: of the machine, which sensors of acceleration, force and strain need; the
    trajectory is then that of the scene with their markers, see `virtual_sensors.with_sensor_markers`
    """
    columns = []
    c, s = np.cos(seen_by.tilt), np.sin(seen_by.tilt)
    sensed = sensor_channels(trajectory, channels, scene, values or {}, seen_by.mounting)
    for number, channel in enumerate(channels):
        if number in sensed:
            bias = getattr(seen_by, f"bias_{channel.quantity}", 0.0)
            columns.append(sensed[number] + bias)
            continue
        index = trajectory.markers.index(channel.marker)
        against = None if channel.to is None else trajectory.markers.index(channel.to)
        if channel.quantity == "angle":
            zero = seen_by.tilt if against is None else trajectory.angles[:, against]
            columns.append(trajectory.angles[:, index] - zero)
        elif channel.quantity == "rate":
            if trajectory.rates is None:
                raise InputError(f"channels: engine {trajectory.engine} tells no rates; use gauss, or no rate")
            still = 0.0 if against is None else trajectory.rates[:, against]
            columns.append(trajectory.rates[:, index] - still + seen_by.bias_rate)
        elif channel.quantity == "z":
            columns.append(trajectory.points[:, index, 2] / seen_by.scale)
        elif channel.is_position:
            x, y = trajectory.points[:, index, 0] - seen_by.x, trajectory.points[:, index, 1] - seen_by.y
            columns.append((c * x + s * y if channel.quantity == "x" else c * y - s * x) / seen_by.scale)
        else:
            raise NotImplementedError(f"channels: {channel.quantity} is not observed")
    # Lanes that differ by their camera alone share a motion, of which some channels show each the same.
    return np.moveaxis(np.stack(np.broadcast_arrays(*columns), axis=1), -1, 0)
