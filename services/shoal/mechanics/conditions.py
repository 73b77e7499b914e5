"""A condition of a joint: what it states of two bodies, of which constraints and reactions follow."""

from __future__ import annotations

from typing import Any

UnitVectors = dict[str, Any]
"""By the name of an unknown force or torque, at every sample, (samples, d) each."""


class JointCondition:
    """A condition of a joint between two places: its residual terms, and the forces that keep it.

    The forces act on the second body at the second place, and oppositely on the first body there, and do no work in any
    motion that the condition permits. A name in both mappings is one unknown, a force and a torque in proportion.
    motion: of the free bodies, an `analysis.free_motion.FreeMotion`
    """

    @property
    def is_of_start(self) -> bool:
        """Return whether it keeps the value that the start has, which is not stated."""
        return False

    def constrain(self, name: str, bodies: Any) -> None:
        """Add the residual terms, which vanish where the condition holds, to `bodies.terms`.

        name: of the joint. bodies: places and directions as vectors of the coordinates, either those of the machine
        (`assembly.coordinates.Placement`) or of separate rigid bodies (`start.closure.Closure`).
        """
        raise unknown(self)

    def pushes(self, motion: Any) -> UnitVectors:
        """Return the forces per unit."""
        return {}

    def twists(self, motion: Any) -> UnitVectors:
        """Return the torques per unit."""
        return {}


def unknown(condition: Any) -> NotImplementedError:
    """Return the error for a condition whose terms or forces are not stated."""
    return NotImplementedError(f"the condition {type(condition).__name__} does not state its residual terms here")
