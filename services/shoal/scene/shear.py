"""Rods with shear in the place of slender ones."""

from __future__ import annotations

from typing import Any

from shoal.scene.refined import unbent
from shoal.scene.scene import Scene


def with_shear(scene: Scene) -> Scene | None:
    """The scene with shear and rotary inertia in its slender flexible rods.

    None if there are none, or in space, which has no such element.
    """
    values: dict[str, Any] = {}
    for name, rod in scene.flexible_rods.items():
        if not rod.shears:
            count = rod.modes if rod.element == "modal" else rod.elements
            fields = {**rod.by_elements("simo-reissner", count), "quadrature": "full"}
            values |= {f"bodies.{name}.{field}": value for field, value in fields.items()} | unbent(scene, name)
    return scene.with_values(values) if values and scene.dimensions == 2 else None
