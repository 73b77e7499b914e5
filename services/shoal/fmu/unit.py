"""A scene as an FMI 2.0 unit for co-simulation."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, SubElement

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real

from shoal.fmu.running import Running, as_dict, identifier, require_start

KINDS: dict[str, dict[str, Any]] = {
    "parameter": {"variability": Fmi2Variability.fixed, "initial": Fmi2Initial.exact},
    "input": {"variability": Fmi2Variability.continuous},
    "output": {"initial": Fmi2Initial.calculated},
}
"""What FMI says of each kind of variable."""


class SceneUnit(Fmi2Slave):  # type: ignore[misc]
    """One instance of an exported scene."""

    def __init__(self, **told: Any) -> None:
        """As pythonfmu calls it; resources: the folder that holds the scene."""
        super().__init__(**told)
        self._running = Running(self.resources)
        self._stop: float | None = None
        self.guid = self._running.token
        self.modelName = identifier(self._running.scene)
        self.description = self._running.scene.description
        self.default_experiment = DefaultExperiment(*self._running.experiment)
        for one in self._running.variables():
            kind = {"causality": Fmi2Causality[one.causality], **KINDS[one.causality]}
            start = {} if one.causality == "output" else {"start": one.getter()}
            self.register_variable(Real(one.name, **kind, **start, **as_dict(one)))

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
        require_start(start_time)
        self._stop = stop_time

    def exit_initialization_mode(self) -> None:
        """See `Running.begin`."""
        self._running.begin(self._stop)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """See `Running.go_on`."""
        self._running.go_on(current_time, step_size)
        return True
