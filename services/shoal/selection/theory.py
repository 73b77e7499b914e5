"""What the rods' theory leaves out of the model that was chosen."""

from __future__ import annotations

from shoal.engines.gauss import GaussEngine
from shoal.engines.theory import left_out
from shoal.selection.run import Rung


def neglected(chosen: Rung) -> float:
    """Displacement of the markers that shear and rotary inertia would cause, by order of magnitude [m]."""
    return left_out(chosen.trajectory, chosen.scene, GaussEngine()) or 0.0
