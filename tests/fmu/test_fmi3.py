"""Units of FMI 3.0, run by FMPy: the motion of `shoal simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.fmu.export import export
from shoal.scene import load_scene

builder: Any = pytest.importorskip("pythonfmu3.builder")
pytestmark = pytest.mark.skipif(not builder.FmuBuilder.has_binary(), reason="no library for this platform")


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The flexible double pendulum."""
    return export(load_scene("flexible-double-pendulum"), out=tmp_path_factory.mktemp("fmu") / "tip.fmu", fmi="3")


def test_it_is_a_valid_unit(unit: Path) -> None:
    assert validate_fmu(str(unit)) == []
    found = fmpy.read_model_description(str(unit))
    assert found.fmiVersion == "3.0"
    assert {variable.name: (variable.causality, variable.unit) for variable in found.modelVariables} == {
        **dict.fromkeys(("gravity.0", "gravity.1"), ("parameter", "m/s²")),
        **dict.fromkeys(("initial.OA.angle", "initial.AB.angle"), ("parameter", "rad")),
        **dict.fromkeys(("A.x", "A.y", "B.x", "B.y"), ("output", "m")),
        "energy": ("output", "J"),
        "time": ("independent", "s"),
    }
    assert found.coSimulation.canHandleVariableCommunicationStepSize
    assert found.coSimulation.needsExecutionTool


@pytest.mark.parametrize("step", [0.01, 0.0037])
def test_the_motion_is_the_one_of_simulate(unit: Path, step: float) -> None:
    start = {"gravity.1": -5.0, "initial.AB.angle": 0.2}
    found = fmpy.simulate_fmu(str(unit), stop_time=0.5, step_size=step, output_interval=step, start_values=start)
    scene = load_scene("flexible-double-pendulum").with_values(start)
    tip = get_engine("gauss").simulate(scene, found["time"]).marker("B")
    np.testing.assert_allclose(np.column_stack([found["B.x"], found["B.y"]]), tip, rtol=0, atol=1e-12)


def test_two_units_in_one_process(unit: Path, tmp_path: Path) -> None:
    """Beside one of FMI 2.0 at that, each at its own point of time."""
    ends = [
        fmpy.simulate_fmu(str(one), stop_time=0.2, step_size=0.1, output_interval=0.1)["B.y"][-1]
        for one in (unit, export(load_scene("flexible-double-pendulum"), out=tmp_path / "2.fmu"), unit)
    ]
    assert ends == pytest.approx([ends[0]] * 3, abs=1e-12)
    told = fmpy.read_model_description(str(unit))
    number = next(variable.valueReference for variable in told.modelVariables if variable.name == "B.y")
    pair = []
    for name in ("one", "other"):
        folder = fmpy.extract(str(unit), str(tmp_path / name))
        made = FMU3Slave(
            guid=told.guid, modelIdentifier=told.coSimulation.modelIdentifier, unzipDirectory=folder, instanceName=name
        )
        made.instantiate()
        made.enterInitializationMode(startTime=0.0)
        made.exitInitializationMode()
        pair.append(made)
    for k in range(2):
        pair[0].doStep(k * 0.1, 0.1)
    pair[1].doStep(0.0, 0.1)
    first, second = (made.getFloat64([number])[0] for made in pair)
    assert first == pytest.approx(ends[0], abs=1e-12)
    assert abs(second - first) > 1e-3
    for made in pair:
        made.terminate()
        made.freeInstance()


def test_a_motion_that_cannot_be_trusted_ends_the_run(unit: Path) -> None:
    with pytest.raises(Exception, match="fmi3DoStep failed"):
        fmpy.simulate_fmu(str(unit), stop_time=0.5, step_size=0.1, start_values={"gravity.1": -9e6})


def test_there_are_two_versions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="fmi: there are versions 2 and 3, found 1"):
        export(load_scene("single-pendulum"), out=tmp_path / "a.fmu", fmi="1")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["export-fmu", "spherical-pendulum", "--fmi", "3"])
    assert done.exit_code == 0, done.output
    assert done.stdout == "spherical_pendulum.fmu\n"
    assert fmpy.read_model_description("spherical_pendulum.fmu").fmiVersion == "3.0"
