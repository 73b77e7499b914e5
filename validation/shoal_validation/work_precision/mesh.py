"""Short names of meshes: `2Q/14R` is a first rod of 2 quintic elements and a second of 14 reduced cables."""

from __future__ import annotations

import re

from shoal.scene import Scene

KINDS: dict[str, dict[str, object]] = {
    "C": {"element": "ancf-cable", "quadrature": "full"},
    "R": {"element": "ancf-cable", "quadrature": "reduced"},
    "Q": {"element": "ancf-quintic"},
    "E": {"element": "ancf-full", "law": "enhanced"},
    "G": {"element": "ancf-cable"},
    "D": {"element": "director-rod"},
}
"""C and R cables of full and reduced quadrature, Q quintic, E fully parameterised with the enhanced law, D director
rod. G stands for Exudyn's geometrically exact beam in place of each cable; two of them stand for a director rod."""


def twisted(scene: Scene) -> bool:
    """Return whether its rods are director rods, which bend about two axes and twist."""
    return any(body.element == "director-rod" for body in scene.bodies.values())


def with_mesh(scene: Scene, mesh: str) -> Scene:
    """The scene with its flexible rods, in their order, meshed so; an empty name leaves it alone."""
    if not mesh:
        return scene
    values: dict[str, object] = {}
    for name, part in zip(scene.flexible_rods, mesh.split("/"), strict=True):
        count, kind = re.fullmatch(r"(\d+)([A-Z])", part).groups()  # type: ignore[union-attr]
        fields = {"elements": int(count), **KINDS[kind]}
        values |= {f"bodies.{name}.{field}": value for field, value in fields.items()}
    return scene.with_values(values)
