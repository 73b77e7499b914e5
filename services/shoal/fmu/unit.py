"""A scene as an FMI 2.0 unit for co-simulation: parameters and inputs in, markers and energy out."""

from __future__ import annotations

import json
import math
import re
import uuid
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real

from shoal.errors import InputError
from shoal.fmu.ahead import Ahead
from shoal.scene import Scene

CONTENT = "scene.json"
"""The file among the unit's resources that holds the scene and the names of its parameters."""


def identifier(scene: Scene) -> str:
    """The scene's name as FMI allows it for models: an identifier of C."""
    name = re.sub(r"\W", "_", scene.name, flags=re.ASCII)
    return name if re.match(r"[A-Za-z_]", name) else f"_{name}"


class SceneUnit(Fmi2Slave):  # type: ignore[misc]
    """One instance of an exported scene. Its time is the scene's, which begins at 0 s."""

    def __init__(self, **told: Any) -> None:
        """As pythonfmu calls it; resources: the folder that holds `CONTENT`."""
        super().__init__(**told)
        text = (Path(self.resources) / CONTENT).read_text(encoding="utf-8")
        content = json.loads(text)
        self._scene = Scene.parse(content["scene"], CONTENT)
        self._values: dict[str, float] = content["parameters"]
        self._inputs: dict[str, float] = content["inputs"]
        solver = self._scene.solver
        self._time, self._step = 0.0, math.inf
        self._stop: float | None = None
        self._motion = Ahead(self._scene)
        self.guid = uuid.uuid5(uuid.NAMESPACE_URL, text)
        self.modelName = identifier(self._scene)
        self.description = self._scene.description
        self.default_experiment = DefaultExperiment(0.0, solver.duration, solver.duration / solver.samples)
        self._register()

    def _register(self) -> None:
        for path in self._values:
            self.register_variable(
                Real(
                    path,
                    causality=Fmi2Causality.parameter,
                    variability=Fmi2Variability.fixed,
                    initial=Fmi2Initial.exact,
                    start=self._values[path],
                    description="SI units",
                    getter=partial(self._values.get, path),
                    setter=partial(self._values.__setitem__, path),
                )
            )
        for path in self._inputs:
            self.register_variable(
                Real(
                    path,
                    causality=Fmi2Causality.input,
                    variability=Fmi2Variability.continuous,
                    start=self._inputs[path],
                    description="SI units",
                    getter=partial(self._inputs.get, path),
                    setter=partial(self._inputs.__setitem__, path),
                )
            )
        for marker in self._scene.markers:
            for axis, letter in enumerate("xyz"[: self._scene.dimensions]):
                where = partial(self._point, marker, axis)
                self._output(f"{marker}.{letter}", f"{letter} of marker {marker} [m]", where)
        self._output("energy", "kinetic, elastic and gravitational energy [J]", self._energy)

    def _output(self, name: str, description: str, getter: Any) -> None:
        variable = Real(name, causality=Fmi2Causality.output, initial=Fmi2Initial.calculated, description=description)
        variable.getter = getter
        self.register_variable(variable)

    def _point(self, marker: str, axis: int) -> float:
        return self._motion.point(marker, self._time, self._step)[axis]

    def _energy(self) -> float:
        return self._motion.energy(self._time, self._step)

    def to_xml(self, model_options: dict[str, str] | None = None) -> Element:
        """The model description; names are paths, such as gravity.1, which are not FMI's structured names."""
        description: Element = super().to_xml(model_options or {})
        description.set("variableNamingConvention", "flat")
        structure, outputs = description.find("ModelStructure"), description.find("ModelStructure/Outputs")
        assert structure is not None
        assert outputs is not None
        SubElement(structure, "InitialUnknowns").extend(outputs)
        return description

    def setup_experiment(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        """Where the experiment ends, if that is known. Raises InputError."""
        if start_time != 0.0:
            raise InputError(f"startTime: a scene begins at 0 s, found {start_time:g}")
        self._stop = stop_time

    def exit_initialization_mode(self) -> None:
        """The parameters are known: the machine stands at its start. Raises InputError."""
        self._motion = Ahead(self._scene.with_values(self._values), self._stop, dict(self._inputs))

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Go on to current_time + step_size [s]. Raises InputError, ComputationError: hosts log the line and stop."""
        self._motion.take(current_time, step_size, self._inputs)
        self._time, self._step = current_time + step_size, step_size or self._step
        self._motion.reach(self._time, self._step)
        return True
