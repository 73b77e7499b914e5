"""A scene as any version of FMI runs it: parameters and inputs in, markers and energy out."""

from __future__ import annotations

import json
import math
import re
import uuid
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from shoal.errors import InputError
from shoal.fmu.ahead import Ahead
from shoal.scene import Scene

CONTENT = "scene.json"
"""The file among the unit's resources that holds the scene and the names of its parameters and inputs."""


def identifier(scene: Scene) -> str:
    """The scene's name as FMI allows it for models: an identifier of C."""
    name = re.sub(r"\W", "_", scene.name, flags=re.ASCII)
    return name if re.match(r"[A-Za-z_]", name) else f"_{name}"


class Variable(NamedTuple):
    """A real number of a unit. causality: parameter, input or output."""

    name: str
    causality: str
    description: str
    unit: str
    getter: Callable[[], float]
    setter: Callable[[float], None] | None = None


class Running:
    """One instance of an exported scene. Its time is the scene's, which begins at 0 s."""

    def __init__(self, folder: str) -> None:
        """folder: that of the resources."""
        text = (Path(folder) / CONTENT).read_text(encoding="utf-8")
        content = json.loads(text)
        self.scene = Scene.parse(content["scene"], CONTENT)
        self.values: dict[str, float] = content["parameters"]
        self.inputs: dict[str, float] = content["inputs"]
        self.token = uuid.uuid5(uuid.NAMESPACE_URL, text)
        self.time, self._step = 0.0, math.inf
        self._motion = Ahead(self.scene)

    @property
    def experiment(self) -> tuple[float, float, float]:
        """Where it begins and ends, and its communication step, unless somebody says otherwise [s]."""
        solver = self.scene.solver
        return 0.0, solver.duration, solver.duration / solver.samples

    def variables(self) -> Iterator[Variable]:
        """All there are."""
        for kind, values in (("parameter", self.values), ("input", self.inputs)):
            for path in values:
                yield Variable(
                    path, kind, "SI units", "", partial(values.__getitem__, path), partial(values.__setitem__, path)
                )
        for marker in self.scene.markers:
            for axis, letter in enumerate("xyz"[: self.scene.dimensions]):
                where = partial(self._point, marker, axis)
                yield Variable(f"{marker}.{letter}", "output", f"{letter} of marker {marker} [m]", "m", where)
        yield Variable("energy", "output", "kinetic, elastic and gravitational energy [J]", "J", self._energy)

    def _point(self, marker: str, axis: int) -> float:
        return self._motion.point(marker, self.time, self._step)[axis]

    def _energy(self) -> float:
        return self._motion.energy(self.time, self._step)

    def begin(self, stop: float | None = None) -> None:
        """The parameters are known: the machine stands at its start. Raises InputError."""
        self._motion = Ahead(self.scene.with_values(self.values), stop, dict(self.inputs))

    def go_on(self, time: float, step: float) -> None:
        """Go on to time + step [s]. Raises InputError, ComputationError: hosts log the line and stop."""
        self._motion.take(time, step, self.inputs)
        self.time, self._step = time + step, step or self._step
        self._motion.reach(self.time, self._step)


def require_start(time: float) -> None:
    """Raises InputError for an experiment that begins elsewhere."""
    if time != 0.0:
        raise InputError(f"startTime: a scene begins at 0 s, found {time:g}")


def as_dict(variable: Variable) -> dict[str, Any]:
    """What both libraries take of a variable under the same names."""
    return {"description": variable.description, "getter": variable.getter, "setter": variable.setter}
