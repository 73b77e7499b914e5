"""The status of modes and Campbell diagrams, and the kinds of findings that it follows from."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from shoal.findings import Finding, cautions, notes, rejects, worst_implied


class ModesStatus(StrEnum):
    """Status of modes, the worst last. Only `ok` is accepted."""

    OK = "ok"
    BEYOND_THEORY = "beyond-theory"
    COARSE = "coarse-mesh"
    UNTOLD = "cannot-be-told"
    UNSTABLE = "unstable"
    VIOLATED = "requirement-violated"
    MOVING = "moving"
    UNBALANCED = "unbalanced"


def status_of(findings: Iterable[Finding]) -> ModesStatus:
    """Return the worst status that findings imply; ok where none implies any."""
    return worst_implied(findings, ModesStatus)


UNBALANCED = rejects("state-unbalanced", ModesStatus.UNBALANCED, "The forces do not balance in the state of the modes.")
MOVING = rejects(
    "motion-left-out",
    ModesStatus.MOVING,
    "The start moves, and not steadily: the modes are those at rest.",
    "take those at rest as the answer by --speeds 0",
)
NO_STEADY_MOTION = rejects(
    "no-steady-motion",
    ModesStatus.MOVING,
    "At a speed there is no steady motion, and there are no modes.",
)
GROWS = rejects("mode-grows", ModesStatus.UNSTABLE, "A small motion grows.")
INDETERMINATE = rejects(
    "mode-indeterminate", ModesStatus.UNTOLD, "The restoring force of a mode is below the round-off of the others."
)
COARSE = rejects(
    "mode-mesh-coarse",
    ModesStatus.COARSE,
    "The error of the mesh is more than half of an eigenvalue.",
    "take more elements or a smaller --count",
)
BEYOND_THEORY = rejects(
    "mode-beyond-theory",
    ModesStatus.BEYOND_THEORY,
    "What slender rods leave out, shear and rotary inertia, is more than half of an eigenvalue.",
    "take simo-reissner rods or a smaller --count",
)
STEADY_MOTION = notes("about-steady-motion", "The modes are about a steady motion, and which.")
ELSEWHERE = notes("steady-elsewhere", "The steady motion is not where the start states it, but near.")
TURNING_FRAME = notes("turning-frame", "Some frequencies are those in the turning frame.")
ABOUT_DOUBTED = cautions("equilibrium-doubted", "The equilibrium that the modes are about is not stable or not unique.")
FRICTION_LEFT_OUT = cautions("friction-left-out", "Dry friction is not part of small motions.")
UNSTABLE_POLE = cautions("unstable-pole", "A pole of a linear model grows: the machine leaves its rest.")
LOOP_UNSTABLE = rejects("loop-unstable", ModesStatus.UNSTABLE, "The closed loop is not stable: there are no margins.")
NOT_MET = rejects(
    "margin-below", ModesStatus.VIOLATED, "A margin of the loop is not as required.", "change the gains of the loop"
)
ON_A_KINK = cautions("on-a-kink", "A signal of a linear model is where its derivative jumps; one side is taken.")
BY_DIFFERENCES = notes(
    "by-differences", "A linear model about a state that moves or is not in balance is of differences."
)
DIFFERENCES_PART = rejects(
    "differences-disagree",
    ModesStatus.UNTOLD,
    "Differences of two steps disagree: the machine has no linear model there, as at a kink or a jump.",
)
FRICTION_SMOOTHED = cautions("friction-as-slope", "Dry friction is in a linear model by the slope of its smoothed law.")
LOWEST_MODES = notes("lowest-modes", "A linear model is of the lowest modes of a large machine.")
GROWS_AT = notes("grows-at-speeds", "At some speeds of the diagram a small motion grows.")
