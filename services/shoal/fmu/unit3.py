"""A scene as an FMI 3.0 unit for co-simulation."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element

from pythonfmu3 import (
    DefaultExperiment,
    Float64,
    Fmi3Causality,
    Fmi3Initial,
    Fmi3Slave,
    Fmi3Status,
    Fmi3StepResult,
    Fmi3Variability,
    Unit,
)

from shoal.fmu.running import UNITS, Running, as_dict, identifier

KINDS: dict[str, dict[str, Any]] = {
    "parameter": {"variability": Fmi3Variability.fixed, "initial": Fmi3Initial.exact},
    "input": {"variability": Fmi3Variability.continuous},
    "output": {"variability": Fmi3Variability.continuous, "initial": Fmi3Initial.calculated},
}
"""What FMI says of each kind of variable."""


class SceneUnit3(Fmi3Slave):  # type: ignore[misc]
    """One instance of an exported scene."""

    def __init__(self, **told: Any) -> None:
        """Make an instance for pythonfmu3; resources: the folder with the scene."""
        super().__init__(**told)
        self._running = Running(self.resources, lambda line: self.log(line, Fmi3Status.error))
        self.guid = self._running.token
        self.modelName = identifier(self._running.scene)
        self.description = self._running.scene.description
        self.default_experiment = DefaultExperiment(*self._running.experiment)
        self.register_units([Unit(name, **powers) for name, powers in UNITS.items()])
        for one in self._running.variables():
            kind = {"causality": Fmi3Causality[one.causality], **KINDS[one.causality]}
            start = {} if one.causality == "output" else {"start": one.getter()}
            self.register_variable(Float64(one.name, unit=one.unit or None, **kind, **start, **as_dict(one)))

        clock = {"causality": Fmi3Causality.independent, "variability": Fmi3Variability.continuous}
        self.register_variable(Float64("time", unit="s", getter=lambda: self._running.time, **clock))

    def to_xml(self, model_options: dict[str, str] | None = None) -> Element:
        """The model description; names are paths, such as gravity.1, which are not FMI's structured names."""
        description: Element = super().to_xml(model_options or {})
        description.set("variableNamingConvention", "flat")
        unit = description.find("CoSimulation")
        assert unit is not None
        # pythonfmu3 (0.3.4) says of it what it has just said of the option before.
        unit.set("canHandleVariableCommunicationStepSize", "true")
        return description

    def setup_experiment(self, start_time: float) -> None:
        """The library does not pass on where the experiment ends."""
        self._running.require_start(start_time)

    def exit_initialization_mode(self) -> None:
        """See `Running.begin`."""
        self._running.begin()

    def do_step(self, current_time: float, step_size: float) -> Fmi3StepResult:
        """See `Running.go_on`."""
        made = self._running.go_on(current_time, step_size)
        return Fmi3StepResult(status=Fmi3Status.ok if made else Fmi3Status.error)

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        """The library would set the inputs back and say that all is."""
        self._running.refuse("the state of the unit cannot be set back")
