"""Units whose inputs change during the run: against a scene that has them as a table, and closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from fmpy.validation import validate_fmu
from pythonfmu.builder import FmuBuilder
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.fmu.export import export
from shoal.fmu.inputs import InputSignals
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

pytestmark = pytest.mark.skipif(not FmuBuilder.has_binary(), reason="pythonfmu has no library for this platform")

STEP = 0.05
MOTOR = "loads.motor.torque"
DISC = Scene.parse({
    "name": "disc", "gravity": [0, 0],
    "bodies": {"D": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.5}},
    "joints": {"O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "D"}}},
    "loads": {"motor": {"kind": "torque", "at": {"body": "D"}, "torque": 0.0}},
    "markers": {"P": {"body": "D", "point": [1.0, 0.0]}},
    "solver": {"duration": 1.0},
})  # fmt: skip


def driven_by(unit: Path, path: str, values: Array, stop: float, **start: float) -> Any:
    """FMPy's run with a value from each communication point on; its own interpolation never looks between two."""
    signal = np.array(
        [(k * STEP, value) for k, value in enumerate(values)], dtype=[("time", "f8"), (path, "f8")]
    )  # fmt: skip
    return fmpy.simulate_fmu(
        str(unit), stop_time=stop, step_size=STEP, output_interval=STEP, input=signal, start_values=start
    )


def held(values: Array) -> list[list[float]]:
    """The table that jumps at each communication point."""
    rows = [[0.0, float(values[0])]]
    for k in range(1, len(values)):
        rows += [[k * STEP - 1e-9 * STEP, float(values[k - 1])], [k * STEP, float(values[k])]]
    return rows


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_a_torque_that_changes_every_step_turns_a_disc_as_the_sum_says(fmi: str, tmp_path: Path) -> None:
    unit = export(DISC, out=tmp_path / "disc.fmu", inputs=[MOTOR], fmi=fmi)
    assert validate_fmu(str(unit)) == []
    found = {variable.name: variable for variable in fmpy.read_model_description(str(unit)).modelVariables}
    assert (found[MOTOR].causality, found[MOTOR].variability) == ("input", "continuous")
    assert float(found[MOTOR].start) == 0.0
    torque = np.random.default_rng(1).normal(size=21)
    motion = driven_by(unit, MOTOR, torque, 1.0)
    # J w' = M: w and the angle are sums.
    gains = torque[:-1] / 0.5
    rates = np.concatenate([[0.0], np.cumsum(gains * STEP)])
    angles = np.concatenate([[0.0], np.cumsum(rates[:-1] * STEP + gains * STEP**2 / 2)])
    np.testing.assert_allclose(np.arctan2(motion["P.y"], motion["P.x"]), angles, rtol=0, atol=1e-8)
    np.testing.assert_allclose(motion["energy"], 0.5 * 0.5 * rates**2, rtol=0, atol=1e-8)


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_a_flexible_machine_moves_as_with_the_table(fmi: str, tmp_path: Path) -> None:
    """A follower force at the tip, with a parameter that is set before."""
    scene = load_scene("flexible-double-pendulum")
    data = scene.model_dump(mode="json", exclude_unset=True)
    push = {"kind": "force", "at": {"body": "AB", "point": "end"}, "force": [0.0, 3.0], "follows": True, "scale": 0.0}
    scene = Scene.parse(data | {"loads": {"push": push}})
    unit = export(scene, ["initial.AB.angle"], tmp_path / "f.fmu", inputs=["loads.push.scale"], fmi=fmi)
    scale = np.array([0.0, 0.0, 1.0, 1.0, -2.0, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0])
    motion = driven_by(unit, "loads.push.scale", scale, 0.5, **{"initial.AB.angle": 0.3})
    table = {"loads.push.scale": {"table": held(scale), "smooth": False}, "initial.AB.angle": 0.3}
    run = get_engine("gauss").simulate(scene.with_values(table), motion["time"])
    assert run.ok
    np.testing.assert_allclose(np.column_stack([motion["B.x"], motion["B.y"]]), run.marker("B"), rtol=0, atol=1e-9)


@pytest.mark.slow
def test_a_controller_holds_a_pendulum_upright(tmp_path: Path) -> None:
    """The host computes the torque from the motion: what no table could say ahead."""
    from fmpy.fmi2 import FMU2Slave

    data = load_scene("single-pendulum").model_dump(mode="json", exclude_unset=True)
    motor = {"kind": "torque", "at": {"body": "OA"}, "torque": 0.0}
    scene = Scene.parse(data | {"loads": {"motor": motor}})
    path = export(scene, ["initial.OA.angle"], tmp_path / "up.fmu", inputs=[MOTOR])
    told = fmpy.read_model_description(str(path))
    number = {variable.name: variable.valueReference for variable in told.modelVariables}
    folder = fmpy.extract(str(path), str(tmp_path / "unit"))
    unit = FMU2Slave(guid=told.guid, modelIdentifier=told.coSimulation.modelIdentifier, unzipDirectory=folder)
    unit.instantiate()
    unit.setReal([number["initial.OA.angle"]], [np.pi / 2 - 0.1])
    unit.setupExperiment(startTime=0.0, stopTime=3.0)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    lean, torques, step = [np.pi / 2 - 0.1], [], 0.02
    for k in range(150):
        rate = (lean[-1] - lean[-2]) / step if k else 0.0
        torques.append(40.0 * (np.pi / 2 - lean[-1]) - 10.0 * rate)
        unit.setReal([number[MOTOR]], [torques[-1]])
        unit.doStep(k * step, step)
        x, y = unit.getReal([number["A.x"], number["A.y"]])
        lean.append(float(np.arctan2(y, x)))
    unit.terminate()
    unit.freeInstance()
    assert abs(lean[-1] - np.pi / 2) < 1e-3
    # m l^2 a = M - m g l cos(angle), by scipy from point to point.
    from scipy.integrate import solve_ivp

    state = np.array([np.pi / 2 - 0.1, 0.0])
    for k, torque in enumerate(torques):
        swing = solve_ivp(
            lambda t, s, torque=torque: [s[1], torque - 9.81 * np.cos(s[0])],
            (0.0, step),
            state,
            rtol=1e-11,
            atol=1e-12,
        )
        state = swing.y[:, -1]
        assert lean[k + 1] == pytest.approx(state[0], abs=1e-7)


def test_a_drive_goes_straight_to_its_value(tmp_path: Path) -> None:
    data = DISC.model_dump(mode="json", exclude_unset=True)
    drive = {
        "kind": "driven-angle",
        "first": {"body": "ground", "point": [0, 0]},
        "second": {"body": "D"},
        "angle": 0.0,
    }
    scene = Scene.parse(data | {"joints": {**data["joints"], "drive": drive}})
    unit = export(scene, out=tmp_path / "d.fmu", inputs=["joints.drive.angle"])
    wanted = np.sin(np.arange(11) * STEP)
    motion = driven_by(unit, "joints.drive.angle", wanted, 0.5)
    # There at the next communication point.
    np.testing.assert_allclose(np.arctan2(motion["P.y"], motion["P.x"])[1:], wanted[:-1], rtol=0, atol=1e-8)


def test_a_drive_that_changes_later_leaves_the_start_as_it_is(tmp_path: Path) -> None:
    """Of a crank whose angle is a guess beside a rod whose angle is not: by the triangle, then by the table."""
    bar = {"kind": "rod", "height": 0.02, "width": 0.02, "density": 7800.0}
    base, ground = {"body": "ground", "point": "base"}, {"body": "ground", "point": [0.0, 0.0]}
    rod = -np.arcsin(0.2 * np.sin(0.6) / 0.6)
    scene = Scene.parse({
        "name": "slider-crank",
        "gravity": [0.0, 0.0],
        "ground_points": {"base": {"x": 0.0}},
        "bodies": {"crank": bar | {"length": 0.2}, "rod": bar | {"length": 0.6}},
        "joints": {
            "O": {"first": base, "second": {"body": "crank", "point": "start"}},
            "P": {"first": {"body": "crank", "point": "end"}, "second": {"body": "rod", "point": "start"}},
            "S": {"kind": "slider", "first": ground, "second": {"body": "rod", "point": "end"}},
        },
        "markers": {"pin": {"body": "rod", "point": "end"}},
        "initial": {"crank": {"angle": 0.9, "guess": ["angle"]}, "rod": {"angle": rod}},
        "solver": {"duration": 0.2},
    })  # fmt: skip
    unit = export(scene, out=tmp_path / "c.fmu", inputs=["ground_points.base.x"])
    motion = driven_by(unit, "ground_points.base.x", np.array([0.0, 0.0, 0.01, 0.01, 0.01]), 0.2)
    pin = 0.2 * np.cos(0.6) + 0.6 * np.cos(rod)
    np.testing.assert_allclose(motion["pin.x"][:3], pin, rtol=0, atol=1e-9)
    table = {"table": [[0.0, 0.0], [2 * STEP, 0.0], [3 * STEP, 0.01]], "smooth": False}
    stated = Scene.parse(scene.model_dump(mode="json", exclude_unset=True) | {"ground_points": {"base": {"x": table}}})
    expected = get_engine("gauss").simulate(stated, motion["time"]).marker("pin")[:, 0]
    np.testing.assert_allclose(motion["pin.x"], expected, rtol=0, atol=1e-9)


def test_tables_of_inputs() -> None:
    inputs = InputSignals({"loads.a.scale": 1.0, "joints.b.angle": 0.5})
    assert inputs.take(0.0, 0.1, {"loads.a.scale": 2.0, "joints.b.angle": 0.5})
    assert not inputs.take(0.1, 0.1, {"loads.a.scale": 2.0, "joints.b.angle": 0.5})
    assert inputs.take(0.2, 0.1, {"loads.a.scale": 3.0, "joints.b.angle": 0.7})
    assert inputs._rows["loads.a.scale"] == [(0.0, 2.0), (pytest.approx(0.2, abs=1e-9), 2.0), (0.2, 3.0)]
    assert inputs._rows["joints.b.angle"] == [(0.0, 0.5), (0.2, 0.5), (pytest.approx(0.3), 0.7)]


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        (
            ["bodies.D.mass"],
            "input: bodies.D.mass is none; loads have scale and torque, joints and ground_points drives",
        ),
        (["loads.motor.colour"], "loads.motor.colour"),
        (["gravity.1"], "input: gravity.1 is a parameter as well; it can be one of them"),
    ],
)
def test_what_is_no_input(inputs: list[str], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        export(DISC, out=tmp_path / "a.fmu", inputs=inputs)
    assert list(tmp_path.iterdir()) == []


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["export-fmu", "andrews-squeezer", "--input", MOTOR])
    assert done.exit_code == 0, done.output
    found = fmpy.read_model_description("andrews_squeezer.fmu").modelVariables
    assert [variable.name for variable in found if variable.causality == "input"] == [MOTOR]
    refused = CliRunner().invoke(main, ["export-fmu", "single-pendulum", "--input", "bodies.OA.mass"])
    assert (refused.exit_code, len(refused.stderr.splitlines())) == (2, 1)
