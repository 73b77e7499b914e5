"""A scene as an FMI 2.0 unit for co-simulation."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, SubElement

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

from shoal.fmu.running import UNITS, Running, as_dict, identifier

KINDS: dict[str, dict[str, Any]] = {
    "parameter": {"variability": Fmi2Variability.fixed, "initial": Fmi2Initial.exact},
    "input": {"variability": Fmi2Variability.continuous},
    "output": {"initial": Fmi2Initial.calculated},
}
"""What FMI says of each kind of variable."""


class SceneUnit(Fmi2Slave):  # type: ignore[misc]
    """One instance of an exported scene."""

    def __init__(self, **told: Any) -> None:
        """Make an instance for pythonfmu; resources: the folder with the scene."""
        super().__init__(**told)
        self._running = Running(self.resources, lambda line: self.log(line, Fmi2Status.error))
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
        self._add_units(description)
        structure, outputs = description.find("ModelStructure"), description.find("ModelStructure/Outputs")
        assert structure is not None
        assert outputs is not None
        SubElement(structure, "InitialUnknowns").extend(outputs)
        return description

    def _add_units(self, description: Element) -> None:
        """Those of the variables, which pythonfmu knows nothing of."""
        used = {one.name: one.unit for one in self._running.variables() if one.unit}
        places = {child.tag: k for k, child in enumerate(description)}
        definitions = Element("UnitDefinitions")
        description.insert(places["CoSimulation"] + 1, definitions)
        for unit in dict.fromkeys(used.values()):
            powers = {base: str(power) for base, power in UNITS[unit].items()}
            SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", powers)
        for variable in description.iterfind("ModelVariables/ScalarVariable"):
            real, name = variable.find("Real"), variable.get("name")
            if real is not None and name in used:
                real.set("unit", used[name])

    def setup_experiment(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        """Take the end of the experiment, if it is known."""
        self._running.require_start(start_time)
        self._stop = stop_time

    def exit_initialization_mode(self) -> None:
        """See `Running.begin`."""
        self._running.begin(self._stop)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """See `Running.go_on`; a step that is not made is fmi2Discard, as pythonfmu has no fmi2Error."""
        return self._running.go_on(current_time, step_size)

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        """The library would set the inputs back and say that all is."""
        self._running.refuse("the state of the unit cannot be set back")
