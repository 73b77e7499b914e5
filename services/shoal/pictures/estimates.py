"""Known errors of a run, in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from shoal.error_budget import GOOD, ErrorBudget, Grade
from shoal.pictures.numbers import length
from shoal.trajectory import Trajectory

if TYPE_CHECKING:
    from shoal.selection import Selection

REMEDIES = {
    "theory": "neglected shear and rotary inertia of slender rods (rotary_inertia: true counts the latter in rigid "
    "rods, simo-reissner has both)",
    "bending": "modal rods bend only a little; cables may bend far",
    "friction": "dry friction is smoothed below coulomb_speed, so that what should stick creeps, in proportion to it",
}
"""What the sources stand for that are no errors of a computation but of its model, and what avoids them."""


def estimates(trajectory: Trajectory) -> Iterator[str]:
    """Sentences about the error at the markers, the sum of all known ones first, and what its parts are."""
    verification = trajectory.model.get("verification") or {}
    if trajectory.errors.estimates:
        angle = verification.get("angle_error")
        turned = "" if angle is None else f"; angles, by the time step: {angle:.1e} rad"
        yield f"estimated error at the markers: {trajectory.errors}{turned}"
    for source, why in REMEDIES.items():
        if source in trajectory.errors.known:
            yield f"{source}: {why}"


def budget(errors: ErrorBudget) -> str:
    """The sum of the known errors and its parts, as people read lengths: "31 mm (mesh 31 mm, time 19 µm)"."""
    if errors.total is None:
        return "not known"
    parts = [f"{source} {length(error)}" for source, error in errors.known.items()]
    parts += [f"{source} not known" for source in errors.unknown]
    return f"{length(errors.total)} ({', '.join(parts)})"


def grade(trajectory: Trajectory, selection: Selection | None = None) -> Grade:
    """The colour of a run: its known error as a share of the distance to the ground, or of the tolerance asked for."""
    size = (trajectory.model.get("verification") or {}).get("scale")
    if selection is not None:
        size = selection.tolerance / GOOD
    return trajectory.errors.grade(trajectory.ok, size)
