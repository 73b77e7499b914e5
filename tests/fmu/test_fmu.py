"""Exported units, run by FMPy: the motion of `shoal simulate`, whatever the communication steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu
from pythonfmu.builder import FmuBuilder
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.fmu.export import export
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

pytestmark = pytest.mark.skipif(not FmuBuilder.has_binary(), reason="pythonfmu has no library for this platform")


def run(unit: Path, stop: float, step: float, **start: float) -> Any:
    """What FMPy records, by name and time."""
    return fmpy.simulate_fmu(str(unit), stop_time=stop, step_size=step, output_interval=step, start_values=start)


def simulated(scene: Scene, times: Array, marker: str) -> Array:
    return get_engine("gauss").simulate(scene, times).marker(marker)


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The flexible double pendulum."""
    return export(load_scene("flexible-double-pendulum"), out=tmp_path_factory.mktemp("fmu") / "tip.fmu")


def test_it_is_a_valid_unit(unit: Path) -> None:
    assert validate_fmu(str(unit)) == []
    found = fmpy.read_model_description(str(unit))
    causality = {variable.name: variable.causality for variable in found.modelVariables}
    parameters = ("gravity.0", "gravity.1", "initial.OA.angle", "initial.AB.angle")
    outputs = ("A.x", "A.y", "B.x", "B.y", "energy")
    assert causality == dict.fromkeys(parameters, "parameter") | dict.fromkeys(outputs, "output")
    assert found.coSimulation.needsExecutionTool == "true" or found.coSimulation.needsExecutionTool is True


@pytest.mark.parametrize("step", [0.01, 0.0037, 0.3])
def test_the_motion_is_the_one_of_simulate(unit: Path, step: float) -> None:
    """Steps that are multiples of the solver's and steps that are not: the same numbers, not only close ones."""
    found = run(unit, 0.5, step, **{"gravity.1": -5.0, "initial.AB.angle": 0.2})
    scene = load_scene("flexible-double-pendulum").with_values({"gravity.1": -5.0, "initial.AB.angle": 0.2})
    tip = simulated(scene, found["time"], "B")
    np.testing.assert_allclose(np.column_stack([found["B.x"], found["B.y"]]), tip, rtol=0, atol=1e-12)
    assert np.ptp(found["energy"]) < 1e-5 * np.max(np.abs(found["energy"]))


@pytest.mark.parametrize("name", ["spherical-pendulum", "bricard", "flexible-spherical-double-pendulum"])
def test_machines_in_space_tell_three_coordinates_and_keep_their_energy(name: str, tmp_path: Path) -> None:
    unit, scene = export(load_scene(name), out=tmp_path / "space.fmu"), load_scene(name)
    found = run(unit, 0.3, 0.1, **{"gravity.0": 0.5})
    marker = list(scene.markers)[-1]
    tip = simulated(scene.with_values({"gravity.0": 0.5}), found["time"], marker)
    recorded = np.column_stack([found[f"{marker}.{axis}"] for axis in "xyz"])
    np.testing.assert_allclose(recorded, tip, rtol=0, atol=1e-12)
    assert np.max(np.abs(tip[-1] - tip[0])) > 0.05
    assert np.ptp(found["energy"]) < 1e-5 * np.max(np.abs(found["energy"]))


def test_steps_of_any_length(unit: Path) -> None:
    """Steps that nobody could foresee, beyond the stated end as well, two units side by side."""
    description = fmpy.read_model_description(str(unit))
    number = {v.name: v.valueReference for v in description.modelVariables}["B.x"]
    folder = fmpy.extract(str(unit))
    about = {"guid": description.guid, "modelIdentifier": description.modelName, "unzipDirectory": folder}
    slaves = [FMU2Slave(**about, instanceName=f"unit{k}") for k in range(2)]
    for slave in slaves:
        slave.instantiate()
        slave.setupExperiment(stopTime=0.2)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
    time, found = 0.0, []
    steps = [0.01, 0.01, 0.0123, 1e-6, 0.1, 0.3, 0.3]
    for step in steps:
        for slave in slaves:
            slave.doStep(time, step)
        time += step
        found.append([slave.getReal([number])[0] for slave in slaves])
    for slave in slaves:
        slave.terminate()
        slave.freeInstance()
    expected = simulated(load_scene("flexible-double-pendulum"), np.cumsum(steps), "B")[:, 0]
    np.testing.assert_allclose(found, np.column_stack([expected, expected]), rtol=0, atol=1e-9)


def test_energy_of_a_pendulum(tmp_path: Path) -> None:
    """Against the closed form: kinetic and potential energy of a mass point on a massless rod of 1 m."""
    scene = load_scene("single-pendulum").with_values({"initial.OA.rate": 2.0, "initial.OA.angle": 0.3})
    found = run(export(scene, out=tmp_path / "p.fmu"), 1.0, 0.05)
    np.testing.assert_allclose(found["energy"], 0.5 * 2.0**2 + 9.81 * np.sin(0.3), atol=1e-6)


def test_energy_counts_the_turns_of_a_spring(tmp_path: Path) -> None:
    """A torsion spring that is wound up by turns between two communication points keeps its energy."""
    data = load_scene("single-pendulum").model_dump(mode="json")
    ends = {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "OA", "point": "start"}}
    data["loads"] = {"s": {"kind": "torsion-spring", **ends, "stiffness": 0.1}}
    data["initial"] = {"OA": {"angle": 0.0, "rate": 12.0}}
    scene = Scene.parse(data | {"gravity": [0.0, 0.0]})
    found = run(export(scene, out=tmp_path / "s.fmu"), 2.0, 0.5)
    assert get_engine("gauss").simulate(scene, [2.0]).angle("A")[0] > 2 * np.pi
    np.testing.assert_allclose(found["energy"], 72.0, rtol=1e-5)


def test_a_torque_as_a_parameter(tmp_path: Path) -> None:
    data = load_scene("single-pendulum").model_dump(mode="json")
    scene = Scene.parse(
        data | {"loads": {"m": {"kind": "torque", "at": {"body": "OA", "point": "end"}, "torque": 0.0}}}
    )
    found = run(export(scene, ["loads.m.torque"], tmp_path / "t.fmu"), 0.5, 0.1, **{"loads.m.torque": 9.81})
    # What its weight needs at the horizontal holds it there; without the torque it would fall.
    tip = simulated(scene.with_values({"loads.m.torque": 9.81}), found["time"], "A")
    np.testing.assert_allclose(found["A.y"], tip[:, 1], atol=1e-12)
    assert found["A.y"][-1] == pytest.approx(0.0, abs=1e-9)


def test_a_motion_that_cannot_be_trusted_ends_the_run(unit: Path) -> None:
    """The first step fails with the reason in the host's log; nothing is passed off as a result."""
    said: list[str] = []

    def hear(_: Any, __: Any, ___: Any, ____: Any, message: bytes) -> None:
        said.append(message.decode())

    with pytest.raises(Exception, match="fmi2DoStep failed"):
        fmpy.simulate_fmu(
            str(unit), stop_time=0.5, step_size=0.1, start_values={"gravity.1": -9e6}, logger=hear, debug_logging=True
        )
    assert any("flexible-double-pendulum: the motion up to 0.5 s: " in line for line in said), said


@pytest.mark.parametrize(
    ("paths", "values", "word"),
    [
        (["bodies.AB.elements"], {}, "bodies.AB.elements is not a real number"),
        (["bodies.AB.colour"], {}, "colour"),
        (["name"], {}, "name is not a real number"),
        ([], {"solver.acceleration": "afsa"}, "solver.acceleration"),
    ],
)
def test_what_cannot_be_exported(paths: list[str], values: dict[str, str], word: str, tmp_path: Path) -> None:
    scene = load_scene("flexible-double-pendulum").with_values(values)
    with pytest.raises(InputError, match=word):
        export(scene, paths, tmp_path / "a.fmu")
    assert list(tmp_path.iterdir()) == []


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["export-fmu", "n-four-bar-2", "--set", "solver.duration=0.1"])
    assert result.exit_code == 0, result.stderr
    assert result.stdout == "n_four_bar_2.fmu\n"
    assert fmpy.read_model_description("n_four_bar_2.fmu").defaultExperiment.stopTime == "0.1"
    refused = CliRunner().invoke(main, ["export-fmu", "single-pendulum", "--parameter", "mass"])
    assert refused.exit_code == 2
    assert len(refused.stderr.splitlines()) == 1
