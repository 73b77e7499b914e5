"""Machines in space that tests and studies share."""

from __future__ import annotations

from typing import Any

from shoal.scene import Scene, load_scene

FINE = {"integrator": "dop853", "relative_tolerance": 1e-11, "absolute_tolerance": 1e-12}
PUBLISHED = (0.5105014612, -1.6491675994, 0.1401231146)
"""P3 of Bricard's mechanism at 1 s [m], by its closed closure."""


def bricard() -> Scene:
    """The scene of the library (IFToMM's benchmark A04; Gonzalez, Dopico, Luaces and Cuadrado), followed closely."""
    return load_scene("bricard").with_values({f"solver.{name}": value for name, value in FINE.items()})


def cable(length: float, elements: int, modulus: float, **more: Any) -> dict[str, Any]:
    """A rod as those of the flexible pendulum are, 3 cm square. length [m], modulus [Pa]; more: other fields."""
    return {"kind": "rod", "length": length, "height": 0.03, "width": 0.03, "density": 5540.0,
            "youngs_modulus": modulus, "element": "ancf-cable", "elements": elements} | more  # fmt: skip


def flexible_pendulum(**more: Any) -> Scene:
    """The flexible spherical double pendulum of the library in steps of 10 us. more: parts that replace its own."""
    stated = load_scene("flexible-spherical-double-pendulum").model_dump(mode="json", exclude_unset=True)
    fine = {"integrator": "leapfrog", "step": 1e-5, "duration": stated["solver"]["duration"]}
    return Scene.parse({**stated, "solver": fine, **more})
