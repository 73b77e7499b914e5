"""Views of a machine in space: from the front, from above, from the right, and from a corner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.trajectory import Array


@dataclass(frozen=True)
class ViewDirection:
    """A way to look, turned from the front by a yaw about the upward direction and a pitch downwards [rad].

    right, up: unit vectors of the directions that point to the right and up on the paper, (3,) each.
    """

    name: str
    yaw: float
    pitch: float
    right: Array
    up: Array

    @property
    def plane(self) -> Array:
        """Right and up as columns: places times this are places on the paper, (3, 2)."""
        return np.stack([self.right, self.up], axis=1)

    @property
    def labels(self) -> tuple[str, str]:
        """Return the names of the coordinates on the paper; empty where they are along no axis."""
        return _label(self.right), _label(self.up)


def views(up: Array) -> tuple[ViewDirection, ViewDirection, ViewDirection, ViewDirection]:
    """Front, top, right side and corner; up: the direction against gravity, along an axis, (3,)."""
    return (
        _view("front", up, 0.0, 0.0),
        _view("top", up, 0.0, 90.0),
        _view("right side", up, -90.0, 0.0),
        _view("corner", up, -35.0, 22.0),
    )


def _view(name: str, up: Array, *degrees: float) -> ViewDirection:
    yaw, pitch = np.radians(degrees)
    # In front x points to the right, or y where x is up.
    right = np.eye(3)[1 if abs(up[0]) > 0.5 else 0]
    aside = np.cos(yaw) * right + np.sin(yaw) * np.cross(right, up)
    towards = np.cos(pitch) * np.cross(aside, up) + np.sin(pitch) * up
    return ViewDirection(name, float(yaw), float(pitch), aside, np.cross(towards, aside))


def _label(way: Array) -> str:
    k = int(np.argmax(np.abs(way)))
    if abs(way[k]) < 1 - 1e-9:
        return ""
    return f"{'−' if way[k] < 0 else ''}{'xyz'[k]} [m]"
