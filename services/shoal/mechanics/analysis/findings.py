"""The status of a search for an equilibrium, and the kinds of findings that it follows from."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from shoal.findings import Finding, cautions, notes, rejects, worst_implied


class EquilibriumStatus(StrEnum):
    """Status of a search for an equilibrium, the worst last. Only `ok` is accepted."""

    OK = "ok"
    UNSTABLE = "unstable"
    UNHELD = "nothing-holds"
    RESTLESS = "no-rest"
    UNTOLD = "cannot-be-told"
    FAILED = "failed"


def status_of(findings: Iterable[Finding]) -> EquilibriumStatus:
    """Return the worst status that findings imply; ok where none implies any."""
    return worst_implied(findings, EquilibriumStatus)


_HOLD = "add what holds it: a joint, a spring, or gravity"

JOINTS_OPEN = rejects(
    "joints-open",
    EquilibriumStatus.FAILED,
    "The joints cannot be closed.",
    "state a start near a position in which the machine can be assembled",
)
NOT_AT_REST = rejects(
    "not-at-rest",
    EquilibriumStatus.FAILED,
    "The search ended before the machine was at rest.",
    "start nearer to the equilibrium",
)
NO_MESH = rejects(
    "no-mesh-within-tolerance",
    EquilibriumStatus.FAILED,
    "No mesh that was tried has an error within the tolerance.",
    "state a larger tolerance",
)
UNBALANCED = rejects(
    "forces-unbalanced", EquilibriumStatus.FAILED, "The search converged, but the forces do not balance."
)
FALLS = rejects("falls-without-end", EquilibriumStatus.UNHELD, "Nothing stops the machine from falling.", _HOLD)
WINDS_UP = rejects("turns-without-end", EquilibriumStatus.UNHELD, "Nothing stops a body from turning.", _HOLD)
RESTLESS = rejects(
    "state-does-not-rest",
    EquilibriumStatus.RESTLESS,
    "A state goes on changing where the machine rests, as an integrator does with an error left.",
    "let the machine reach what the controller wants: check limits, the reference and what holds the machine",
)
LOOSE = rejects(
    "nothing-holds",
    EquilibriumStatus.UNHELD,
    "The stiffness of some displacement vanishes: the machine may rest in other positions as well.",
    _HOLD,
)
INDETERMINATE = rejects(
    "stability-indeterminate",
    EquilibriumStatus.UNTOLD,
    "The stiffness of some displacement is below the round-off of the others.",
)
GROWS = rejects(
    "follower-forces-drive",
    EquilibriumStatus.UNSTABLE,
    "Forces that follow the motion make a small motion grow, or flutter.",
)
UNSTABLE = rejects(
    "unstable", EquilibriumStatus.UNSTABLE, "The forces balance, and a small displacement grows.", "allow it to leave"
)
SNAPPED = notes("snapped", "The machine snapped through or buckled while the loads were applied.")
STICKS = notes(
    "held-by-friction",
    "Dry friction holds the machine where it starts; the share is that of the limit which it takes at most.",
)
LEFT_UNSTABLE = notes("unstable-left", "An unstable equilibrium was met first, and left.")
FREE_SPIN = notes("free-to-spin", "A body may spin about its own axis, which moves nothing.")
NEGLECTED = cautions("effect-neglected", "An effect of the scene is not part of statics: dry friction, driven motion.")
SHEAR = notes("with-shear", "Rods with shear deformation took the place of slender ones.")
