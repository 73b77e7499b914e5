"""Fields of a scene that are taken as known with a standard deviation: weighed masses, what other recordings gave."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shoal.errors import InputError
from shoal.identification.forward import ForwardModel
from shoal.identification.recording.units import unit
from shoal.identification.spread.given import EXACT, Given
from shoal.identification.spread.model_error import difference
from shoal.trajectory import Array

_STEP = 1e-4
"""Of the differences by fields, of the size of each: the whole uncertainty may shift a long motion by turns."""
_NAMED = 3
"""Fields that a sentence lists."""


def uncertain_fields(model: ForwardModel, point: Array, predicted: Mapping[str, Array]) -> Given | None:
    """At a point whose channels by recording are known: two simulations of every recording for each uncertainty.

    None where the problem states none. Raises InputError where the scene cannot have them.
    """
    stated = model.problem.uncertainties
    if not stated:
        return None
    sizes = [f"{path} ({size:.2g} {unit(path)}".rstrip() + ")" for path, size in model.problem.uncertain.items()]
    more = f" and {len(sizes) - _NAMED} more" if len(sizes) > _NAMED else ""
    moved = np.array([_moved(model, point, predicted, entry) for entry in stated])
    return Given(moved, EXACT, f"what is uncertain of {', '.join(sizes[:_NAMED])}{more}")


def _moved(model: ForwardModel, point: Array, predicted: Mapping[str, Array], entry: Mapping[str, float]) -> Array:
    """What one uncertainty changes of the residuals to first order, from both sides, or the one that can be run."""
    at = {path: float(model.scene.value(path)) for path in entry}
    step = min(1.0, _STEP / max(abs(size / (at[path] or 1.0)) for path, size in entry.items()))
    sides = list[Array]()
    for part in (step, -step):
        try:
            scene = model.scene.with_values({path: at[path] + part * size for path, size in entry.items()})
        except InputError:
            continue
        rows = difference(model, point, predicted, scene)
        if rows is not None:
            sides.append(rows / part)
    if not sides:
        raise InputError(
            f"{model.problem.name}: uncertainties: the machine cannot be run with another {', '.join(entry)}; state no "
            "uncertainty of it, or set another value"
        )
    return np.asarray(np.mean(sides, axis=0))
