"""Which values a scene accepts: limits of fields are intervals, so between two that it accepts it accepts all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shoal.identification.bounds import accepts
from shoal.identification.problem import Parameter
from shoal.scene import Scene


class Accepted:
    """What a scene has been seen to accept; it is asked again for what lies beyond."""

    def __init__(self, scene: Scene, parameters: Sequence[Parameter]) -> None:
        """parameters: whose bounds it accepted when it was loaded."""
        self._scene = scene
        self._known = {parameter.path: (parameter.lower, parameter.upper) for parameter in parameters}

    def __call__(self, path: str, value: float) -> bool:
        """Return whether it may have a value at a path."""
        least, most = self._known.get(path, (np.inf, -np.inf))
        if least <= value <= most:
            return True
        told = accepts(self._scene, {path: value})
        if told:
            self._known[path] = min(value, least), max(value, most)
        return told
