"""Loads: springs and dampers between bodies, forces and torques on them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr

from shoal.scene.function import Function, SignalFunction
from shoal.scene.joints import Attachment, Direction, Z
from shoal.scene.record import Axis, NonNegative, Record, Vector, kinds


def _alike(given: Any) -> Any:
    return (given,) * 3 if isinstance(given, int | float | str) else given


class Elastic(Record):
    """Base of springs: a polynomial law and a damper between two places."""

    kind: str
    first: Attachment
    """Place on the first body."""
    second: Attachment
    """Place on the second body."""
    stiffness: float = 0.0
    """Linear stiffness [N/m; of a torsion spring N m/rad]."""
    cubic: float = 0.0
    """Cubic stiffness [N/m^3; of a torsion spring N m/rad^3]."""
    damping: NonNegative = 0.0
    """Viscous damping [N s/m; of a torsion spring N m s/rad]."""


class Spring(Elastic):
    """A spring and damper between two places, along the line that joins them."""

    kind: Literal["spring"] = "spring"
    length: NonNegative | None = None
    """Length without force [m]; by default the distance at the start."""
    elastic: Function | None = None
    """Further elastic force [N] as a function of the elongation [m], which it calls `t`."""


class TorsionSpring(Elastic):
    """A spring and damper between the directions of two bodies."""

    kind: Literal["torsion-spring"] = "torsion-spring"
    first_to: Attachment | None = None
    """In the plane, the first direction is that from `first` to this place, in place of the body's; so a point mass has
    one.
    """
    second_to: Attachment | None = None
    """The same of the second direction."""
    axis: Axis = Z
    """Axis of the angle in space, as it points at the start [1]; a joint keeps it common to both."""
    angle: float | None = None
    """Relative angle at rest, counted over full turns [rad]; by default that of the start."""
    elastic: Function | None = None
    """Further elastic torque [N m] as a function of the angle from rest [rad], which it calls `t`."""


Along = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(_alike)]
"""Three numbers, along the axes of the ground at the start; one stands for all of them."""


class Bushing(Record):
    """A spring and damper of all displacements and turns between two bodies, relaxed at the start. In space only."""

    kind: Literal["bushing"] = "bushing"
    first: Attachment
    """Place on the first body, with whose axes the directions turn."""
    second: Attachment
    """Place on the second body."""
    stiffness: Along = (0.0, 0.0, 0.0)
    """Stiffness against displacements along the axes of the first body that are those of the ground at the start [N/m];
    one number is that of all three.
    """
    damping: Along = (0.0, 0.0, 0.0)
    """Viscous damping of these displacements [N s/m]."""
    turn_stiffness: NonNegative = 0.0
    """Stiffness against the turn from the start by an angle about any axis, of the torque along that axis [N m/rad]."""
    turn_damping: NonNegative = 0.0
    """Torque against the relative angular velocity [N m s/rad]."""

    @property
    def resists_turns(self) -> bool:
        """Return whether it resists turns."""
        return bool(np.any(self.turn_stiffness) or np.any(self.turn_damping))


class Force(Record):
    """A force at a place, times a function of time and signals."""

    kind: Literal["force"] = "force"
    at: Attachment
    """The place."""
    force: Vector
    """Force along the axes of the ground at the start [N]."""
    follows: bool = False
    """Whether its direction turns with the body."""
    scale: SignalFunction = SignalFunction(number=1.0)
    """Factor as a function of time and signals [1]."""


class Torque(Record):
    """A torque on a body, counter-clockwise."""

    kind: Literal["torque"] = "torque"
    at: Attachment
    """Place on the body."""
    torque: SignalFunction
    """Torque [N m] as a function of time and signals."""
    axis: Axis = Z
    """Axis of the torque in space, as it points at the start [1]. It turns with the body of `reaction`, and is fixed
    for the ground.
    """
    reaction: Direction | None = None
    """The body that takes the reaction; by default the ground."""


class Thrust(Record):
    """A force along the line of a slider on its second body; the first one takes the reaction."""

    kind: Literal["thrust"] = "thrust"
    joint: str
    """Name of the slider."""
    force: SignalFunction
    """Force [N] as a function of time and signals."""
    _guide: Any = PrivateAttr(None)

    def along(self, guide: Any) -> Thrust:
        """Return the same load, which knows its slider where the scene has lost its joints."""
        found = self.model_copy()
        found._guide = guide
        return found

    def guide(self, joints: Mapping[str, Any]) -> Any:
        """Return its slider."""
        return joints[self.joint] if self._guide is None else self._guide


class DistributedForce(Record):
    """A force per length along a whole rod, fixed in direction, times a function of time and signals."""

    kind: Literal["distributed-force"] = "distributed-force"
    body: str
    """Name of the rod."""
    force: Vector
    """Force per length along the axes of the ground [N/m]."""
    scale: SignalFunction = SignalFunction(number=1.0)
    """Factor as a function of time and signals [1]."""


Load = Annotated[
    Spring | TorsionSpring | Bushing | Force | Torque | Thrust | DistributedForce, Field(discriminator="kind")
]
LOAD_KINDS = kinds(Load)
