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

from shoal.atomic_write import LONGEST
from shoal.errors import ComputationError, ShoalError
from shoal.fmu.ahead import Ahead
from shoal.identification.recording.units import unit as unit_of
from shoal.scene import Scene

CONTENT = "scene.json"
"""The file among the unit's resources that holds the scene and the names of its parameters and inputs."""

UNITS = {
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s²": {"m": 1, "s": -2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "kg": {"kg": 1},
    "kg m²": {"kg": 1, "m": 2},
    "kg/m³": {"kg": 1, "m": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
}
"""Units that variables have, as powers of FMI's base units."""
SAME = 1e-15
"""The libraries write a start value with 16 digits, which may not be all of it: a host gives it back so closely."""


def identifier(scene: Scene) -> str:
    """The scene's name as FMI allows it for models, and any folder for files: an identifier of C."""
    name = re.sub(r"\W", "_", scene.name, flags=re.ASCII)[:LONGEST]
    return name if re.match(r"[A-Za-z_]", name) else f"_{name}"


class Variable(NamedTuple):
    """A real number of a unit. causality: parameter, input or output; unit: one of `UNITS`, or empty."""

    name: str
    causality: str
    description: str
    unit: str
    getter: Callable[[], float]
    setter: Callable[[float], None] | None = None


class Running:
    """One instance of an exported scene. Its time is the scene's, which begins at 0 s.

    An invalid request is reported in a line, and no further step is made until the unit is reset. The libraries turn
    every exception into a fatal error, after which a host may not even reset; so only outputs, which are unknown then,
    raise one: no host takes them for a result.
    """

    def __init__(self, folder: str, tell: Callable[[str], None] = lambda line: None) -> None:
        """folder: that of the resources; tell: takes a line for the host's log."""
        text = (Path(folder) / CONTENT).read_text(encoding="utf-8")
        content = json.loads(text)
        self.scene = Scene.parse(content["scene"], CONTENT)
        self.values: dict[str, float] = content["parameters"]
        self.inputs: dict[str, float] = content["inputs"]
        self.token = uuid.uuid5(uuid.NAMESPACE_URL, text)
        self.time, self._step = 0.0, math.inf
        self.refused = ""
        self._tell, self._starts, self._begun = tell, dict(self.values), False
        self._motion = Ahead(self.scene)

    @property
    def experiment(self) -> tuple[float, float, float]:
        """Return the default start, end and communication step [s]."""
        solver = self.scene.solver
        return 0.0, solver.duration, solver.duration / solver.samples

    def variables(self) -> Iterator[Variable]:
        """All there are."""
        setters = {"parameter": self._set_parameter, "input": self.inputs.__setitem__}
        for kind, values in (("parameter", self.values), ("input", self.inputs)):
            for path in values:
                unit = unit_of(path) if unit_of(path) in UNITS else ""
                yield Variable(
                    path, kind, "SI units", unit, partial(values.__getitem__, path), partial(setters[kind], path)
                )
        for marker in self.scene.markers:
            for axis, letter in enumerate("xyz"[: self.scene.dimensions]):
                where = partial(self._read, partial(self._point, marker, axis))
                yield Variable(f"{marker}.{letter}", "output", f"{letter} of marker {marker} [m]", "m", where)
        energy = partial(self._read, self._energy)
        yield Variable("energy", "output", "kinetic, elastic and gravitational energy [J]", "J", energy)

    def _point(self, marker: str, axis: int) -> float:
        return self._motion.point(marker, self.time, self._step)[axis]

    def _energy(self) -> float:
        return self._motion.energy(self.time, self._step)

    def _read(self, getter: Callable[[], float]) -> float:
        if self.refused:
            raise ComputationError(self.refused)
        return getter()

    def _set_parameter(self, path: str, value: float) -> None:
        if self._begun and value != self.values[path]:
            self.refuse(f"{path}: is fixed since the initialisation has ended; reset the unit to change it")
        self.values[path] = value

    def refuse(self, why: str) -> None:
        """From now on nothing goes."""
        self.refused = self.refused or why
        self._tell(why)

    def require_start(self, time: float) -> None:
        """Refuses an experiment that begins elsewhere."""
        if time != 0.0:
            self.refuse(f"startTime: a scene begins at 0 s, found {time:g}")

    def begin(self, stop: float | None = None) -> None:
        """The parameters are known: the machine stands at its start, which those move that a host has changed."""
        changed = {
            path: value
            for path, value in self.values.items()
            if not math.isclose(value, self._starts[path], rel_tol=SAME)
        }
        self._begun = True
        try:
            self._motion = Ahead(self.scene.with_values(changed), stop, dict(self.inputs))
        except ShoalError as error:
            self.refuse(str(error))

    def go_on(self, time: float, step: float) -> bool:
        """Go on to time + step [s]; whether it does."""
        if not self._begun:
            self.refuse("the initialisation has not ended")
        elif not (0.0 <= time < math.inf and 0.0 <= step < math.inf):
            self.refuse(f"a step goes on from 0 s or later and not back, found {step:g} s from {time:g} s")
        if self.refused:
            return False
        try:
            self._motion.take(time, step, self.inputs)
            self.time, self._step = time + step, step or self._step
            self._motion.reach(self.time, self._step)
        except ShoalError as error:
            self.refuse(str(error))
        return not self.refused


def as_dict(variable: Variable) -> dict[str, Any]:
    """Return the attributes of a variable that both libraries share."""
    return {"description": variable.description, "getter": variable.getter, "setter": variable.setter}
