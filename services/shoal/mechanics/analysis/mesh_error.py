"""How far what is computed of a machine is off for its mesh: by the same once more, on twice as many of all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.modes import Modes, modes
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene
from shoal.scene.refined import refined


def finer(scene: Scene) -> Scene | None:
    """The scene with twice the elements or modes of its flexible rods; None if there are none."""
    twice = refined(scene, 2)
    return scene.with_values(twice) if twice else None


def of_equilibrium(found: Equilibrium, scene: Scene) -> Equilibrium:
    """A place of rest of a scene with the largest distance of a marker from where the finer mesh has it [m]."""
    second = None if not found.ok or (fine := finer(scene)) is None else statics(fine, found.time)
    if second is None or not second.ok:
        return found
    return replace(found, mesh_error=float(np.max(np.linalg.norm(found.points - second.points, axis=1))))


def of_modes(found: Modes, scene: Scene) -> Modes:
    """Modes of a scene, each with how much its eigenvalue differs on the finer mesh, relative to its size."""
    if not found.ok or (fine := finer(scene)) is None:
        return found
    second = modes(fine, about="start" if found.about == "start" else "equilibrium", count=len(found.modes))
    if not second.ok or len(second.modes) < len(found.modes):
        return found
    pairs = zip(found.modes, second.modes, strict=False)
    errors = (abs(one.eigenvalue - other.eigenvalue) / (abs(other.eigenvalue) or 1.0) for one, other in pairs)
    return replace(found, mesh_errors=tuple(map(float, errors)))
