"""Rods with shear in the place of slender ones."""

from __future__ import annotations

from shoal.scene.scene import Scene

SLENDER = ("ancf-cable", "ancf-quintic")
"""Elements that leave shear and the rotary inertia of sections out."""


def with_shear(scene: Scene) -> Scene | None:
    """The scene with shear and rotary inertia in its slender flexible rods.

    None if there are none, or in space, which has no such element.
    """
    rods = [name for name, body in scene.bodies.items() if body.element in SLENDER]
    fields = {"element": "simo-reissner", "quadrature": "full"}
    values = {f"bodies.{name}.{field}": value for name in rods for field, value in fields.items()}
    return scene.with_values(values) if rods and scene.dimensions == 2 else None
