"""Starts from where forces balance, or from where a run ended: elastic rods go there strained."""

from __future__ import annotations

from shoal.scene import Scene


def gives_way(scene: Scene) -> bool:
    """Whether a machine starts with elastic rods strained, so that their joints need not close without strain."""
    elastic = any(body.element not in ("rigid", "modal") for body in scene.bodies.values())
    return scene.initial_from is not None and elastic
