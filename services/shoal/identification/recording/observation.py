"""From the motion of markers to what a recording shows of it: through a camera, in the order of the channels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.identification.recording.source import Channel, Clocked
from shoal.trajectory import Array, Trajectory


class Camera(NamedTuple):
    """Where positions are seen from: at rotation(-tilt) (X - [x, y]) / scale, z at z / scale; numbers or (lanes,)."""

    scale: float | Array = 1.0
    x: float | Array = 0.0
    y: float | Array = 0.0
    tilt: float | Array = 0.0


STRAIGHT = Camera()


def camera(stated: Clocked) -> Camera:
    """The camera that a recording states."""
    return Camera(stated.scale, stated.x, stated.y, stated.tilt)


def observe(trajectory: Trajectory, channels: tuple[Channel, ...], seen_by: Camera = STRAIGHT) -> Array:
    """The channels of a trajectory, (lanes, samples, channels). Raises InputError if its engine tells no rates."""
    columns = []
    c, s = np.cos(seen_by.tilt), np.sin(seen_by.tilt)
    for channel in channels:
        index = trajectory.markers.index(channel.marker)
        if channel.quantity == "angle":
            columns.append(trajectory.angles[:, index] - seen_by.tilt)
        elif channel.quantity == "rate":
            if trajectory.rates is None:
                raise InputError(f"channels: engine {trajectory.engine} tells no rates; use gauss, or no rate")
            columns.append(trajectory.rates[:, index])
        elif channel.quantity == "z":
            columns.append(trajectory.points[:, index, 2] / seen_by.scale)
        elif channel.is_position:
            x, y = trajectory.points[:, index, 0] - seen_by.x, trajectory.points[:, index, 1] - seen_by.y
            columns.append((c * x + s * y if channel.quantity == "x" else c * y - s * x) / seen_by.scale)
        else:
            raise NotImplementedError(f"channels: {channel.quantity} is not observed")
    return np.moveaxis(np.stack(columns, axis=1), -1, 0)
