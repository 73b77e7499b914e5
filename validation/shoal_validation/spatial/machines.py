"""Machines in space that tests and studies share."""

from __future__ import annotations

from shoal.scene import Scene, load_scene

FINE = {"integrator": "dop853", "relative_tolerance": 1e-11, "absolute_tolerance": 1e-12}
PUBLISHED = (0.5105014612, -1.6491675994, 0.1401231146)
"""P3 of Bricard's mechanism at 1 s [m], by its closed closure."""


def bricard() -> Scene:
    """The scene of the library (IFToMM's benchmark A04; Gonzalez, Dopico, Luaces and Cuadrado), followed closely."""
    return load_scene("bricard").with_values({f"solver.{name}": value for name, value in FINE.items()})
