"""Exported units, run by FMPy: the motion of `shoal simulate`, whatever the communication steps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from fmpy import calloc, free
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.validation import validate_fmu
from pythonfmu.builder import FmuBuilder
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.fmu.ahead import Ahead
from shoal.fmu.export import export
from shoal.fmu.running import UNITS, Running
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
    """The first step is not made, with the reason in the host's log; nothing is passed off as a result."""
    said: list[str] = []

    def hear(_: Any, __: Any, ___: Any, ____: Any, message: bytes) -> None:
        said.append(message.decode())

    with pytest.raises(Exception, match="fmi2GetReal failed"):
        fmpy.simulate_fmu(
            str(unit), stop_time=0.5, step_size=0.1, start_values={"gravity.1": -9e6}, logger=hear, debug_logging=True
        )
    assert any("flexible-double-pendulum: the motion up to 0.5 s: " in line for line in said), said


def slider_crank(**initial: Any) -> Scene:
    """A crank of 0.2 m and a rod of 0.6 m; the piston on the line through the crank's bearing."""
    bar = {"kind": "rod", "height": 0.02, "width": 0.02, "density": 7800.0}
    ground = {"body": "ground", "point": [0.0, 0.0]}
    return Scene.parse({
        "name": "slider-crank",
        "bodies": {
            "crank": bar | {"length": 0.2},
            "rod": bar | {"length": 0.6},
            "piston": {"kind": "rigid-body", "mass": 0.5, "inertia": 0.001},
        },
        "joints": {
            "O": {"first": ground, "second": {"body": "crank", "point": "start"}},
            "P": {"first": {"body": "crank", "point": "end"}, "second": {"body": "rod", "point": "start"}},
            "Q": {"first": {"body": "rod", "point": "end"}, "second": {"body": "piston"}},
            "S": {"kind": "slider", "first": ground, "second": {"body": "piston"}, "rotation": "locked"},
        },
        "markers": {"pin": {"body": "piston"}},
        "initial": initial,
        "solver": {"duration": 0.1},
    })  # fmt: skip


def test_a_machine_starts_as_its_scene_says_and_not_where_unstated_angles_would_be_zero(tmp_path: Path) -> None:
    """By the triangle of crank and rod; and as the host says of the crank where it says anything."""
    unit = export(slider_crank(crank={"angle": 0.6}), out=tmp_path / "c.fmu")
    names = [one.name for one in fmpy.read_model_description(str(unit)).modelVariables if one.causality == "parameter"]
    assert names == ["gravity.0", "gravity.1", "initial.crank.angle"]
    for start in ({}, {"initial.crank.angle": 1.0}):
        angle = start.get("initial.crank.angle", 0.6)
        pin = 0.2 * np.cos(angle) + np.sqrt(0.6**2 - (0.2 * np.sin(angle)) ** 2)
        assert run(unit, 0.02, 0.01, **start)["pin.x"][0] == pytest.approx(pin, abs=1e-9)


def test_start_values_that_a_host_gives_back_change_nothing(tmp_path: Path) -> None:
    """FMI's file rounds them to 16 digits; the guessed rate would else be one of several that may give way."""
    third = 0.1 + 0.2 + 1e-16
    assert float(f"{third:.16g}") != third
    scene = slider_crank(crank={"angle": third}, piston={"velocity": [-0.5, 0.0]}, rod={"rate": 0.4, "guess": ["rate"]})
    unit = export(scene, out=tmp_path / "g.fmu")
    told = {one.name: one.start for one in fmpy.read_model_description(str(unit)).modelVariables}
    names = "gravity.0", "gravity.1", "initial.crank.angle"
    found = run(unit, 0.04, 0.02, **{name: float(told[name]) for name in names})
    np.testing.assert_allclose(found["pin.x"], simulated(scene, found["time"], "pin")[:, 0], rtol=0, atol=1e-12)


def test_a_unit_that_would_stand_elsewhere_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene("single-pendulum")
    monkeypatch.setattr(Running, "begin", lambda unit, stop: setattr(unit, "_motion", moved_ahead(unit.scene)))

    def moved_ahead(scene: Scene) -> Ahead:
        return Ahead(scene.with_values({"initial.OA.angle": 0.5}))

    monkeypatch.setattr(Running, "go_on", lambda unit, time, step: True)
    with pytest.raises(
        ComputationError, match=r"single-pendulum: the unit would be off by 0\.\d+ m from `shoal simulate`"
    ):
        export(scene, out=tmp_path / "a.fmu")
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def pendulum(tmp_path: Path) -> Iterator[tuple[FMU2Slave, dict[str, int], list[str]]]:
    """A unit as a host holds it, the numbers of its variables, and the host's log."""
    data = load_scene("single-pendulum").model_dump(mode="json", exclude_unset=True)
    motor = {"kind": "torque", "at": {"body": "OA"}, "torque": 0.0}
    scene = Scene.parse(data | {"loads": {"motor": motor}})
    paths = ["initial.OA.angle", "bodies.OA.mass"]
    path = export(scene, paths, tmp_path / "p.fmu", inputs=["loads.motor.torque"])
    told, log = fmpy.read_model_description(str(path)), list[str]()
    numbers = {one.name: one.valueReference for one in told.modelVariables}
    folder = fmpy.extract(str(path), str(tmp_path / "unit"))
    unit = FMU2Slave(guid=told.guid, modelIdentifier=told.modelName, unzipDirectory=folder, instanceName="one")
    calls = fmi2CallbackFunctions()
    calls.logger = fmi2CallbackLoggerTYPE(lambda _, __, ___, ____, message: log.append(message.decode()))
    calls.allocateMemory, calls.freeMemory = fmi2CallbackAllocateMemoryTYPE(calloc), fmi2CallbackFreeMemoryTYPE(free)
    unit.instantiate(callbacks=calls, loggingOn=True)
    yield unit, numbers, log
    unit.freeInstance()


def begin(unit: FMU2Slave) -> None:
    unit.setupExperiment(startTime=0.0, stopTime=0.2)
    unit.enterInitializationMode()
    unit.exitInitializationMode()


@pytest.mark.parametrize(
    ("path", "value", "initial", "line"),
    [
        ("bodies.OA.mass", -1.0, True, "single-pendulum: bodies.OA.mass: Input should be greater than 0, found -1.0"),
        ("initial.OA.angle", np.nan, True, "initial.OA.angle: Input should be a finite number, found nan"),
        ("loads.motor.torque", np.nan, False, "loads.motor.torque.number: Input should be a finite number, found nan"),
        ("bodies.OA.mass", 2.0, False, "bodies.OA.mass: is fixed since the initialisation has ended; reset the unit"),
    ],
)
def test_bad_values_discard_the_step_and_a_reset_goes_on(
    pendulum: Any, path: str, value: float, initial: bool, line: str
) -> None:
    """With the reason in the log; no fatal error, after which a host may not reset and would crash if it went on."""
    unit, numbers, log = pendulum
    if not initial:
        begin(unit)
    unit.setReal([numbers[path]], [value])
    if initial:
        begin(unit)
    for _ in range(2):
        with pytest.raises(FMICallException, match=r"fmi2DoStep failed with status 2 \(discard\)"):
            unit.doStep(0.0, 0.1)
    assert any(line in said for said in log), log
    unit.reset()
    begin(unit)
    unit.doStep(0.0, 0.1)
    expected = simulated(load_scene("single-pendulum"), np.array([0.1]), "A")[0, 1]
    assert unit.getReal([numbers["A.y"]])[0] == pytest.approx(expected, abs=1e-9)


def test_variables_have_their_units(unit: Path) -> None:
    found = {one.name: one.unit for one in fmpy.read_model_description(str(unit)).modelVariables}
    assert found["gravity.1"] == "m/s²"
    assert (found["initial.OA.angle"], found["B.x"], found["energy"]) == ("rad", "m", "J")
    for name, powers in UNITS.items():
        assert {"s", "m", "kg", "rad"} >= set(powers), name


@pytest.mark.parametrize(
    ("paths", "values", "word"),
    [
        (["bodies.AB.elements"], {}, "bodies.AB.elements is not a real number"),
        (["bodies.AB.colour"], {}, "colour"),
        (["name"], {}, "name is not a real number"),
        (["initial.AB.rate"], {}, "initial.AB.rate: the scene does not state it"),
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


@pytest.mark.compiles("kernels of contacts, which few machines need")
def test_a_unit_with_a_stop_strikes_it_as_simulate_does(tmp_path: Path) -> None:
    """Its motion is that of the events, whatever the communication step, and its energy falls at each impact."""
    pendulum = load_scene("single-pendulum")
    data = pendulum.model_dump(mode="json", exclude_unset=True)
    (joint,) = data["joints"].values()
    joint["stops"] = {"min": -np.pi / 2 - 0.2, "restitution": 0.5}
    scene = Scene.parse(data)
    found = run(export(scene, out=tmp_path / "stop.fmu"), 2.0, 0.02)
    right = get_engine("gauss").simulate(scene, found["time"])
    (marker, *_) = scene.markers
    assert found[f"{marker}.x"] == pytest.approx(right.marker(marker)[:, 0], abs=1e-12)
    impacts = [event["time"] for event in right.model["events"] if event["kind"] == "impact"]
    assert len(impacts) > 1
    before, after = (found["energy"][np.searchsorted(found["time"], impacts[0]) + k] for k in (-1, 0))
    assert after < before - 1e-3
    assert np.ptp(found["energy"][found["time"] < impacts[0]]) < 1e-8
