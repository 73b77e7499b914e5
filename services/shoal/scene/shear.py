"""Rods with shear in the place of slender ones, and the size of what slender ones leave out (Timoshenko 1921)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from shoal.scene.bodies import Rod
from shoal.scene.refined import unbent
from shoal.scene.scene import Scene


def with_shear(scene: Scene) -> Scene | None:
    """The scene with shear and rotary inertia in its slender flexible rods.

    None if there are none or one's section has no numbers for it, or in space, which has no such element.
    """
    values: dict[str, Any] = {}
    for name, rod in scene.flexible_rods.items():
        if not rod.shears:
            if rod.lacking("simo-reissner"):
                return None
            count = rod.modes if rod.element == "modal" else rod.elements
            fields = {**rod.by_elements("simo-reissner", count), "quadrature": "full"}
            values |= {f"bodies.{name}.{field}": value for field, value in fields.items()} | unbent(scene, name)
    return scene.with_values(values) if values and scene.dimensions == 2 else None


def stouter(scene: Scene, *, exact: bool = True) -> Scene | None:
    """The scene with what slender rods leave out: shear and rotary inertia; None where nothing is left out.

    Flexible rods are those of `with_shear` where it has them, else softer by their share of it; rigid rods have the
    rotary inertia of their section. exact: whether `with_shear` is asked at all, whose rods need an implicit method
    """
    stout = with_shear(scene) if exact else None
    rods = {name: rod for name, rod in scene.bodies.items() if isinstance(rod, Rod) and not rod.shears}
    values = like_stout({name: rod for name, rod in rods.items() if stout is None or rod.element == "rigid"})
    if not values:
        return stout
    return (stout or scene).with_values(values)


def like_stout(rods: Mapping[str, Rod]) -> dict[str, Any]:
    """Values of a scene, by path, with which slender rods move like stout ones: rigid ones exactly, with the rotary
    inertia of their sections, flexible ones by order of magnitude, softer by the share that shear and inertia have.
    """
    values: dict[str, Any] = {}
    for name, rod in rods.items():
        if rod.element == "rigid" and not rod.rotary_inertia:
            values[f"bodies.{name}.rotary_inertia"] = True
            if rod.section == "numbers" and rod.rho_I is None:
                values[f"bodies.{name}.rho_I"] = rod.masses_at(0.0)[1].bending
        elif rod.element != "rigid" and rod.modulus is not None:
            soft = 1.0 + slender_share(rod)
            values |= {f"bodies.{name}.{field}": getattr(rod, field) / soft for field in rod.bending_fields}
    return values


def slender_share(rod: Rod) -> float:
    """By how much shear and rotary inertia lower the stiffness of a rod in bending, over its mass."""
    nu = rod.poisson_ratio
    section = rod.section_at(0.0)
    _, heavy = rod.masses_at(0.0)
    slenderness = np.pi * np.sqrt(section.bending / section.area) / rod.length
    turning = heavy.bending / heavy.area / (section.bending / section.area)
    return float(slenderness**2 * (2 * (1 + nu) / section.shear(nu) + turning))
