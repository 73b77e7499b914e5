"""What joints demand: each kind as a few conditions, which are all that the rest of the mechanics knows of it.

A joint shares what it can (`assembly.groups`), holds the rest by constraints (`assembly.placement`), closes at the
start (`start.closure`) and pushes where its conditions forbid a motion (`analysis.reactions`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.mechanics.numerics.tile import Number
from shoal.scene import (
    GROUND,
    Attachment,
    Coupling,
    Distance,
    DrivenAngle,
    Function,
    Parallel,
    Perpendicular,
    Revolute,
    Scene,
    Slider,
    Weld,
)
from shoal.scene.joints import CoupledCoordinate


@dataclass(frozen=True)
class Meet:
    """Two places coincide."""

    first: Attachment
    second: Attachment


@dataclass(frozen=True)
class Along:
    """The second place stays on a line through the first; direction: of the line in the first body's frame [rad]."""

    first: Attachment
    second: Attachment
    direction: Number

    @property
    def is_fixed(self) -> bool:
        """Whether the line rests on the ground."""
        return self.first.body == GROUND and not isinstance(self.first.point, str)


@dataclass(frozen=True)
class Apart:
    """Two places keep a distance [m]; None: that of the start."""

    first: Attachment
    second: Attachment
    length: Function | None


@dataclass(frozen=True)
class Turned:
    """The angle [rad] from the first direction to the second is kept, or follows a function of time.

    either: two angles, of which the one nearer to the start is kept. Without an angle it is that of the start.
    """

    first: Attachment
    second: Attachment
    angle: Function | Number | None = None
    either: tuple[float, float] | None = None

    @property
    def driven(self) -> bool:
        """Whether it follows a function of time."""
        return isinstance(self.angle, Function)

    @property
    def is_of_start(self) -> bool:
        """Whether any angle that the start has is kept."""
        return self.angle is None and self.either is None

    def kept(self, ahead: Number) -> Number:
        """The angle that is kept, if it does not follow a function; ahead: that at the start [rad]."""
        if self.either is not None:
            return np.where(np.cos(ahead - self.either[0]) >= -1e-12, *self.either)
        return ahead if self.angle is None else self.angle


@dataclass(frozen=True)
class Sum:
    """The sum of factor * coordinate follows a function of time [m]."""

    terms: tuple[CoupledCoordinate, ...]
    value: Function


Condition = Meet | Along | Apart | Turned | Sum


def _slider(joint: Slider) -> list[Condition]:
    line = Along(joint.first, joint.second, joint.direction)
    return [line, Turned(joint.first, joint.second)] if joint.rotation == "locked" else [line]


CONDITIONS: dict[type, Callable[[Any], list[Condition]]] = {
    Revolute: lambda joint: [Meet(joint.first, joint.second)],
    Weld: lambda joint: [Meet(joint.first, joint.second), Turned(joint.first, joint.second, joint.angle)],
    Slider: _slider,
    Distance: lambda joint: [Apart(joint.first, joint.second, joint.length)],
    Parallel: lambda joint: [Turned(joint.first, joint.second, either=(0.0, np.pi))],
    Perpendicular: lambda joint: [Turned(joint.first, joint.second, either=(np.pi / 2, -np.pi / 2))],
    DrivenAngle: lambda joint: [Turned(joint.first, joint.second, joint.angle)],
    Coupling: lambda joint: [Sum(joint.terms, joint.value)],
}


def conditions(joint: Any) -> list[Condition]:
    """The conditions of a joint. Raises NotImplementedError for a kind that nobody told the mechanics of."""
    if type(joint) not in CONDITIONS:
        raise NotImplementedError(f"the mechanics knows no conditions of a joint of kind {joint.kind!r}")
    return CONDITIONS[type(joint)](joint)


def unknown(condition: Any) -> NotImplementedError:
    """What is raised where somebody has not been told of a condition."""
    return NotImplementedError(f"nobody says here what a condition {type(condition).__name__} does")


def of_scene(scene: Scene) -> Iterator[tuple[str, Condition]]:
    """The conditions of all joints, in the order of the scene, with the name of the joint."""
    for name, joint in scene.joints.items():
        yield from ((name, condition) for condition in conditions(joint))


def weld_of(conditions: list[Condition]) -> Turned | None:
    """What keeps the angle, if the conditions keep the place as well."""
    held = [one for one in conditions if isinstance(one, Turned) and not one.driven]
    return held[0] if held and any(isinstance(one, Meet) for one in conditions) else None
