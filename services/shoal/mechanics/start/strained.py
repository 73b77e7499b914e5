"""Starts from where forces balance, or from where a run ended: elastic rods go there strained."""

from __future__ import annotations

from collections.abc import Iterator

from shoal.errors import InputError
from shoal.mechanics.joints import Apart, Turned, of_scene
from shoal.scene import FRAMED, Scene, Weld


def gives_way(scene: Scene) -> bool:
    """Return whether a machine starts with elastic rods strained, so that their joints need not close without
    strain.
    """
    elastic = any(body.element not in FRAMED for body in scene.bodies.values())
    return scene.initial_from is not None and elastic


def numbers_of_start(scene: Scene) -> Iterator[tuple[str, str]]:
    """Yield fields of joints and loads that take a number from the start, or its side, and the field to state instead.

    In space axes and welded rotations follow from the stated rotations, and need no start that closes.
    """
    for name, one in of_scene(scene):
        if isinstance(one, Turned) and one.angle is None and scene.dimensions == 2:
            weld = isinstance(scene.joints[name], Weld)
            yield f"joints.{name}", "state its `angle`" if weld else "a weld with an `angle` can take its place"
        elif isinstance(one, Apart) and one.length is None:
            yield f"joints.{name}", "state its `length`"
        elif not isinstance(one, Turned | Apart) and one.is_of_start:
            yield f"joints.{name}", "state a start of rigid bodies and rods that closes all joints"
    for name, load in scene.loads.items():
        if load.kind == "spring" and load.length is None:
            yield f"loads.{name}", "state its `length`"
        elif load.kind == "torsion-spring" and load.angle is None:
            yield f"loads.{name}", "state its `angle`"


def require_numbers(scene: Scene) -> None:
    """Raises InputError where a number is taken from a start in which unstrained rods do not fit their joints."""
    for field, instead in numbers_of_start(scene):
        raise InputError(
            f"{field}: takes a number from the start, and there is none in which the unstrained rods fit their joints; "
            + instead
        )
