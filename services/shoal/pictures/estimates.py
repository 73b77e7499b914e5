"""What second runs say about a run, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any


def estimates(verification: Mapping[str, Any]) -> Iterator[str]:
    """Sentences about the errors at the markers and about what the model leaves out; `asdict` of a Verification."""
    errors = {"time": verification["time_error"], "mesh": verification["mesh_error"]}
    parts = [f"{name} {error:.1e} m" for name, error in errors.items() if error is not None]
    if verification.get("angle_error") is not None:
        parts.insert(1, f"{verification['angle_error']:.1e} rad")
    if known := ", ".join(parts):
        yield f"estimated error at the markers: {known}"
    if verification["note"]:
        yield verification["note"]
    if verification.get("theory_error") is not None:
        yield (
            "left out by the theory of slender rods: shear and rotary inertia of the section, about "
            f"{verification['theory_error']:.1e} m (rotary_inertia: true counts it in rigid rods, "
            "simo-reissner has both)"
        )
    if verification.get("bending_error") is not None:
        yield (
            "modal rods bend only a little: cables, which may bend far, come out about "
            f"{verification['bending_error']:.1e} m away at the markers"
        )
    if verification.get("friction_error") is not None:
        yield (
            f"dry friction is smoothed below coulomb_speed, so that what should stick creeps: about "
            f"{verification['friction_error']:.1e} m at the markers (proportional to coulomb_speed)"
        )
