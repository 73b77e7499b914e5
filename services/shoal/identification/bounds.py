"""Values that a scene accepts: limits of fields are intervals, so between two accepted values all are accepted."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from shoal.errors import InputError
from shoal.identification.conventions import PRECISION
from shoal.scene import Scene


def accepts(scene: Scene, values: Mapping[str, float]) -> bool:
    """Return whether a scene may have values at paths."""
    try:
        scene.with_values(values)
    except InputError:
        return False
    return True


def possible_bound(
    scene: Scene, path: str, bound: float, fields: Callable[[float], Mapping[str, float]]
) -> float | None:
    """The number nearest to a bound that a scene accepts at a path, to three digits on the side of its own value.

    fields: the values that go with a number at the path. None where the scene has no number there, or where none of
    three digits lies between.
    """
    try:
        inside, outside = float(scene.value(path)), bound
    except (InputError, TypeError, ValueError):
        return None
    while (middle := 0.5 * (inside + outside)) not in (inside, outside):
        inside, outside = (middle, outside) if accepts(scene, fields(middle)) else (inside, middle)
    if abs(inside) < PRECISION * abs(bound):
        return None
    digit = 10.0 ** (np.floor(np.log10(abs(inside))) - 2)
    inwards = np.ceil if bound < inside else np.floor
    nearest = float(f"{inwards(inside / digit) * digit:.3g}")
    return nearest if accepts(scene, fields(nearest)) else None


class Accepted:
    """Cache of the intervals of values that a scene accepts, by path; the scene is asked for what lies beyond."""

    def __init__(self, scene: Scene, known: Mapping[str, tuple[float, float]]) -> None:
        """known: intervals by path that it accepted when it was loaded."""
        self._scene = scene
        self._known = dict(known)

    def __call__(self, path: str, value: float) -> bool:
        """Return whether the scene accepts a value at a path."""
        least, most = self._known.get(path, (np.inf, -np.inf))
        if least <= value <= most:
            return True
        accepted = accepts(self._scene, {path: value})
        if accepted:
            self._known[path] = min(value, least), max(value, most)
        return accepted
