"""The same scene with its flexible rods divided more finely."""

from __future__ import annotations

from typing import Any

from shoal.scene.bodies import Rod
from shoal.scene.initial import InitialState
from shoal.scene.scene import Scene


def refined(scene: Scene, times: int) -> dict[str, Any]:
    """Return the fields that multiply the elements or modes of every flexible rod, by their paths.

    New modes start at rest and undeformed.
    """
    values: dict[str, Any] = {}
    for name, body in scene.bodies.items():
        if not isinstance(body, Rod):
            continue
        values |= {f"bodies.{name}.{field}": times * number for field, number in body.mesh.items()}
        start = scene.initial.get(name, InitialState())
        for field, stated in (("modes", start.modes), ("mode_rates", start.mode_rates)):
            if stated:
                across, along = stated[: body.modes], stated[body.modes :]
                more = [*across, *(0.0,) * len(across) * (times - 1), *along, *(0.0,) * len(along) * (times - 1)]
                values[f"initial.{name}.{field}"] = more
    return values


def unbent(scene: Scene, name: str) -> dict[str, Any]:
    """The fields that start a body without the modes that the scene states of it."""
    start = scene.initial.get(name, InitialState())
    return {f"initial.{name}.{field}": [] for field in ("modes", "mode_rates") if getattr(start, field)}
