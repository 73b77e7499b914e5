"""Rods with shear in the place of slender ones."""

from __future__ import annotations

from shoal.scene.bodies import Rod
from shoal.scene.scene import Scene


def with_shear(scene: Scene) -> Scene | None:
    """The scene with shear and rotary inertia in its slender flexible rods.

    None if there are none, or in space, which has no such element.
    """
    flexible = {name: rod for name, rod in scene.bodies.items() if isinstance(rod, Rod) and rod.element != "rigid"}
    rods = [name for name, rod in flexible.items() if not rod.shears]
    fields = {"element": "simo-reissner", "quadrature": "full"}
    values = {f"bodies.{name}.{field}": value for name in rods for field, value in fields.items()}
    return scene.with_values(values) if rods and scene.dimensions == 2 else None
