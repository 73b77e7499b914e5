"""Inputs of a host during a run, as tables over time in the simulated scene."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.errors import InputError
from shoal.scene import Scene
from shoal.scene.function import Function

AT_ONCE = 1e-9
"""Part of a communication step in which a value that is held changes to the next."""
HELD = "scale", "torque"
"""Fields of loads, which may jump; prescribed positions and angles may not."""


@dataclass
class InputSignals:
    """Values by path, from time zero on.

    A load's is held from one communication point to the next. A prescribed position goes straight to its value and is
    there at the next communication point, as it may not jump.
    """

    values: dict[str, float]
    _rows: dict[str, list[tuple[float, float]]] = field(init=False)

    def __post_init__(self) -> None:
        self._rows = {path: [(0.0, value)] for path, value in self.values.items()}

    def take(self, time: float, step: float, values: dict[str, float]) -> bool:
        """Take the inputs from a time on [s] to the next communication point; return whether any change."""
        changed = [path for path, value in values.items() if value != self._rows[path][-1][1]]
        for path in changed:
            rows, value = self._rows[path], values[path]
            if not jumps(path):
                if rows[-1][0] < time:
                    rows.append((time, rows[-1][1]))
                rows.append((time + step, value))
            elif time == 0.0:
                rows[:] = [(0.0, value)]
            else:
                rows += [(time - max(AT_ONCE * step, 4 * float(np.spacing(time))), rows[-1][1]), (time, value)]
        return bool(changed)

    def applied(self, scene: Scene) -> Scene:
        """Return the scene with the inputs so far, constant after that. Raises InputError."""
        known = {
            path: rows[0][1] if len(rows) == 1 else {"table": rows, "smooth": False}
            for path, rows in self._rows.items()
        }
        return scene.with_values(known) if known else scene


def jumps(path: str) -> bool:
    """Return whether the value of an input may jump."""
    return path.startswith("loads.")


def require_input(scene: Scene, path: str) -> None:
    """Raises InputError for what no host may change while a machine moves."""
    parts = path.split(".")
    if not isinstance(scene.value(path), Function) or (jumps(path) and parts[-1] not in HELD):
        raise InputError(f"input: {path} is none; loads have {' and '.join(HELD)}, joints and ground_points drives")
