"""Sensors on machines: accelerometers, load cells and strain gauges against closed forms, and in identification."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from newton_euler import NewtonEuler
from scipy.integrate import solve_ivp
from shoal.cli import main
from shoal.engines import get_engine
from shoal.engines.poses import initial_poses
from shoal.errors import InputError
from shoal.identification import Problem, identify, measure
from shoal.identification.recording.observation import Camera, observe
from shoal.identification.recording.source import Channel
from shoal.identification.recording.virtual_sensors import engine_options, from_start, with_sensor_markers
from shoal.mechanics.start.start import complete
from shoal.scene import Scene
from shoal.trajectory import Array
from shoal_validation.coverage.sensed_machines import machine

LENGTH, MASS, GRAVITY, FRICTION = 1.3, 1.3, 9.81, 0.2
INERTIA = MASS * LENGTH**2 / 3
PLACE, TILT = (0.7, 0.1), 0.3
TIMES = np.linspace(0.04, 2.0, 50)
TURNED, RATE = 0.4, 1.0
PIN = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "rod", "point": "start"}}
IMU = tuple(Channel(marker="imu", quantity=axis, tilt=TILT) for axis in ("ax", "ay"))
GYRO = Channel(marker="imu", quantity="rate")


def pendulum(**changes: Any) -> Scene:
    """A rod on a pin with friction, and an IMU beside its axis."""
    rod = {"kind": "rod", "length": LENGTH, "height": 0.02, "width": 0.05, "density": 1000.0, "element": "rigid"}
    data = {
        "name": "pendulum",
        "bodies": {"rod": rod},
        "joints": {"O": {"kind": "revolute", **PIN, "friction": FRICTION}},
        "markers": {"imu": {"body": "rod", "point": [*PLACE]}, "tip": {"body": "rod", "point": "end"}},
        "initial": {"rod": {"angle": TURNED, "rate": RATE}},
        "solver": {"duration": 2.0, "step": 1e-3},
    }
    return Scene.parse({**data, **changes}, "pendulum")


def seen(
    scene: Scene, channels: tuple[Channel, ...], engine: str, times: Array = TIMES, view: Camera | None = None
) -> Array:
    """What the channels show of a motion, (samples, channels)."""
    instants = from_start(times, channels)
    motion = get_engine(engine).simulate(with_sensor_markers(scene, channels), instants)
    assert motion.ok
    return observe(motion, channels, view or Camera(), scene)[0, len(instants) - len(times) :]


@cache
def swing() -> tuple[Array, Array, Array]:
    """Angle, rate and angular acceleration of the pendulum by scipy, (samples,) each."""

    def acceleration(angle: Array, rate: Array) -> Array:
        return (-MASS * GRAVITY * LENGTH / 2 * np.cos(angle) - FRICTION * rate) / INERTIA

    found = solve_ivp(
        lambda _, y: [y[1], acceleration(y[0], y[1])],
        (0.0, TIMES[-1]),
        [TURNED, RATE],
        t_eval=TIMES,
        method="DOP853",
        rtol=1e-11,
        atol=1e-12,
    )
    angle, rate = found.y
    return angle, rate, acceleration(angle, rate)


def specific_force(angle: Array, rate: Array, change: Array, tilt: float) -> Array:
    """Acceleration less gravity at the IMU, along its axes, (samples, 2)."""
    (x, y), c, s = PLACE, np.cos(tilt), np.sin(tilt)
    along = -(rate**2) * x - change * y + GRAVITY * np.sin(angle)
    across = change * x - rate**2 * y + GRAVITY * np.cos(angle)
    return np.stack([c * along + s * across, c * across - s * along], axis=1)


def centre_force(angle: Array, rate: Array, change: Array) -> Array:
    """What holds the centre of mass of the rod on its course, (samples, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return MASS * np.stack(
        [-LENGTH / 2 * (rate**2 * c + change * s), GRAVITY + LENGTH / 2 * (change * c - rate**2 * s)], axis=1
    )


@pytest.mark.parametrize(("engine", "accuracy"), [("gauss", 1e-8), ("exudyn", 2e-4)])
def test_an_imu_shows_acceleration_less_gravity_in_its_own_axes_and_the_rate(engine: str, accuracy: float) -> None:
    found = seen(pendulum(), (*IMU, GYRO), engine)
    np.testing.assert_allclose(found[:, :2], specific_force(*swing(), TILT), atol=accuracy)
    np.testing.assert_allclose(found[:, 2], swing()[1], atol=accuracy)


@pytest.mark.parametrize("flexible", [False, True])
def test_lanes_that_differ_in_a_table_feel_what_each_feels_alone(flexible: bool) -> None:
    table = {"table": [[0.0, 1.0], [2.0, 1.0]], "smooth": False}
    push = {"kind": "torque", "at": {"body": "rod"}, "torque": table}
    scene, times = pendulum(loads={"push": push}), np.array([0.1, 0.2])
    if flexible:
        cable = {"bodies.rod.element": "ancf-cable", "bodies.rod.youngs_modulus": 1e9, "solver.step": 1e-5}
        scene = scene.with_values({"markers.imu.point.1": 0.0, **cable})
    channels = (IMU[0], Channel(joint="O", quantity="fx"))
    values = {"loads.push.torque.table.1.1": np.array([1.0, 2.0])}
    instants, here = from_start(times, channels), with_sensor_markers(scene, channels)
    options = engine_options(get_engine("gauss"), scene, channels)
    motion = get_engine("gauss").simulate_many(here, values, instants, **options)
    assert motion.ok, motion.message
    found = observe(motion, channels, Camera(), scene, values)[:, 1:]
    for lane, height in enumerate(values["loads.push.torque.table.1.1"].tolist()):
        one = scene.with_values({"loads.push.torque.table.1.1": height})
        alone = get_engine("gauss").simulate(with_sensor_markers(one, channels), instants, **options)
        np.testing.assert_allclose(found[lane], observe(alone, channels, Camera(), one)[0, 1:], rtol=1e-12)
    assert np.max(np.abs(found[0] - found[1])) > 1e-3


def test_mounting_turns_an_imu_further_and_biases_are_added() -> None:
    view = Camera(scale=2.0, tilt=0.4, mounting=0.1, bias_ax=0.5, bias_ay=-0.25, bias_rate=0.125)
    found = seen(pendulum(), (*IMU, GYRO), "gauss", view=view)
    wanted = specific_force(*swing(), TILT + 0.1) + np.array([0.5, -0.25])
    np.testing.assert_allclose(found[:, :2], wanted, atol=1e-8)
    np.testing.assert_allclose(found[:, 2], swing()[1] + 0.125, atol=1e-8)


def test_sensors_that_are_mounted_otherwise_share_a_motion() -> None:
    angles = np.array([0.0, 0.1, -0.2])
    motion = get_engine("gauss").simulate(with_sensor_markers(pendulum(), IMU), from_start(TIMES, IMU))
    found = observe(motion, IMU, Camera(mounting=angles, bias_ay=0.1 * angles), pendulum())[:, 1:]
    for one, angle in zip(found, angles.tolist(), strict=True):
        wanted = specific_force(*swing(), TILT + angle) + np.array([0.0, 0.1 * angle])
        np.testing.assert_allclose(one, wanted, atol=1e-8)


def test_a_strain_gauge_beside_a_camera_shows_the_same_to_lanes_that_share_a_motion() -> None:
    """A time limit makes two such lanes ready before its clock begins."""
    channels = (Channel(marker="gauge", quantity="strain"), Channel(marker="tip", quantity="y"))
    scene, heights = cantilever(), np.array([0.0, 0.1])
    motion = get_engine("gauss").simulate(with_sensor_markers(scene, channels), np.array([0.0, 2e-3]))
    found = observe(motion, channels, Camera(y=heights), scene)
    alone = np.concatenate([observe(motion, channels, Camera(y=y), scene) for y in heights.tolist()])
    np.testing.assert_array_equal(found, alone)


def test_an_accelerometer_at_rest_shows_gravity_upwards() -> None:
    block = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.1}
    weld = {"kind": "weld", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "rod"}}
    marker = {"body": "rod", "point": [*PLACE]}
    held = pendulum(bodies={"rod": block}, joints={"O": weld}, markers={"imu": marker}, initial={"rod": {"angle": 0.5}})
    found = seen(held, IMU, "gauss")
    wanted = GRAVITY * np.array([np.sin(0.5 + TILT), np.cos(0.5 + TILT)])
    np.testing.assert_allclose(found, np.broadcast_to(wanted, found.shape), atol=1e-9)


@pytest.mark.parametrize(("engine", "accuracy"), [("gauss", 1e-8), ("exudyn", 3e-4)])
def test_a_load_cell_in_a_pin_shows_what_holds_the_rod(engine: str, accuracy: float) -> None:
    channels = tuple(Channel(joint="O", quantity=axis) for axis in ("fx", "fy", "torque"))
    found = seen(pendulum(), channels, engine)
    np.testing.assert_allclose(found[:, :2], centre_force(*swing()), atol=accuracy)
    np.testing.assert_allclose(found[:, 2], -FRICTION * swing()[1], atol=accuracy)


@pytest.mark.parametrize("engine", ["gauss", pytest.param("exudyn", marks=pytest.mark.slow)])
def test_the_torque_of_a_drive_is_what_turns_the_rod_as_stated(engine: str) -> None:
    drive = {"kind": "driven-angle", "first": PIN["first"], "second": {"body": "rod"}, "angle": "0.4 + sin(3*t)"}
    driven = pendulum(joints={"O": {"kind": "revolute", **PIN, "friction": FRICTION}, "D": drive}, initial={})
    channels = (Channel(joint="D", quantity="torque"), Channel(joint="O", quantity="torque"))
    found = seen(driven, (*channels, Channel(joint="O", quantity="fy")), engine)
    angle, rate, change = 0.4 + np.sin(3 * TIMES), 3 * np.cos(3 * TIMES), -9 * np.sin(3 * TIMES)
    torque = INERTIA * change + MASS * GRAVITY * LENGTH / 2 * np.cos(angle) + FRICTION * rate
    np.testing.assert_allclose(found[:, 0], torque, atol=1e-4)
    np.testing.assert_allclose(found[:, 1], -FRICTION * rate, atol=1e-4)
    np.testing.assert_allclose(found[:, 2], centre_force(angle, rate, change)[:, 1], atol=1e-4)


@pytest.mark.parametrize("seed", [9, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (0, 4))])
def test_sensors_of_random_machines_show_what_newton_and_euler_say(seed: int) -> None:
    """A slider-crank, a four-bar linkage and a chain, with friction, springs and motors."""
    drawn = machine(np.random.default_rng(seed))
    joints, times = list(drawn.scene.joints), np.linspace(0.05, 1.0, 20)
    cells = [Channel(joint=joint, quantity=what) for joint in joints for what in ("fx", "fy", "torque")]
    imu = [Channel(marker="imu", quantity=axis, tilt=drawn.tilt) for axis in ("ax", "ay")]
    found = seen(drawn.scene, (*imu, *cells, GYRO), "gauss", times)
    starts = initial_poses(complete(drawn.scene).scene)
    poses = {name: np.array([*starts[name].origin, starts[name].angle]) for name in drawn.scene.bodies}
    rates = {name: np.array([*starts[name].velocity, starts[name].rate]) for name in drawn.scene.bodies}
    oracle, place = NewtonEuler(drawn.data, poses, rates), drawn.data["markers"]["imu"]
    wanted = []
    for q, v, t in oracle.run(times):
        a, exerted = oracle.solve(q, v, t)
        felt = oracle.specific_force(place, drawn.tilt, q, v, a)
        wanted.append([*felt, *np.concatenate([exerted[joint] for joint in joints]), oracle.rate(place, v)])
    np.testing.assert_allclose(found, wanted, atol=2e-8)


SPAN, HEIGHT, WIDTH, YOUNG = 1.0, 0.02, 0.03, 2e9
PUSH, PULL = 0.5, 200.0


def cantilever(element: str = "ancf-cable", **changes: Any) -> Scene:
    """A rod that is clamped at its start and loaded at its end, at rest."""
    rod = {"kind": "rod", "length": SPAN, "height": HEIGHT, "width": WIDTH, "density": 1000.0, "youngs_modulus": YOUNG}
    data = {
        "name": "cantilever",
        "gravity": [0.0, 0.0],
        "bodies": {"rod": {**rod, "element": element, "elements": 8}},
        "joints": {"O": {"kind": "weld", **PIN}},
        "loads": {"tip": {"kind": "force", "at": {"body": "rod", "point": "end"}, "force": [PULL, PUSH]}},
        "markers": {
            "gauge": {"body": "rod", "point": [0.25, 0.0]},
            "root": {"body": "rod", "point": "start"},
            "tip": {"body": "rod", "point": "end"},
        },
        "initial": {"from": "statics"},
        "solver": {"duration": 0.01, "integrator": "generalized-alpha", "step": 1e-3},
    }
    return Scene.parse({**data, **changes}, "cantilever")


@pytest.mark.parametrize("element", ["ancf-cable", "ancf-quintic", "simo-reissner"])
def test_a_strain_gauge_shows_bending_and_stretch_of_a_loaded_cantilever(element: str) -> None:
    """M h / (E I) on the sides and N / (E A) on the axis.

    The pull N makes the rod stiffer: M = P sinh(k (L - s)) / (k cosh(k L)) with k^2 = N / (E I).
    """
    heights = (0.0, HEIGHT / 2, -HEIGHT / 2)
    channels = tuple(
        Channel(marker=marker, quantity="strain", height=height) for marker in ("gauge", "root") for height in heights
    )
    found = seen(cantilever(element), channels, "gauss", np.array([0.0]))[0].reshape(2, 3)
    area, bending = HEIGHT * WIDTH, YOUNG * WIDTH * HEIGHT**3 / 12
    k = np.sqrt(PULL / bending)
    s = np.array([0.25, 0.5e-3 * SPAN])
    curvature = PUSH / bending * np.sinh(k * (SPAN - s)) / (k * np.cosh(k * SPAN))
    axial = PULL / (YOUNG * area)
    wanted = axial - np.outer(curvature, heights)
    # On the upper side, which the push upwards shortens, the strain is smaller.
    assert found[0, 1] < found[0, 0] < found[0, 2]
    np.testing.assert_allclose(found, wanted, atol=0.02 * HEIGHT / 2 * curvature[1])


@cache
def truth() -> dict[str, float]:
    return {"initial.rod.angle": 0.5, "joints.O.friction": 0.15, "bodies.rod.length": 1.4}


def problem(channels: list[dict[str, Any]], **changes: Any) -> dict[str, Any]:
    """Start, friction and length of the pendulum, as a file would state the problem."""
    computed = {"kind": "engine", "engine": "exudyn", "values": truth(), "stop": 1.2, "count": 30, "noise": 1e-2}
    data = {
        "name": "felt",
        "scene": "pendulum.yaml",
        "parameters": {
            "angle": {"path": "initial.rod.angle", "lower": -1.5, "upper": 1.5, "start": 0.3},
            "friction": {"path": "joints.O.friction", "lower": 0.0, "upper": 1.0},
            "length": {"path": "bodies.rod.length", "lower": 1.0, "upper": 2.0, "start": 1.2},
        },
        "channels": channels,
        "source": computed,
    }
    return {**data, **changes}


LENGTH_ALONE = {"length": {"path": "bodies.rod.length", "lower": 1.0, "upper": 2.0, "start": 1.2}}


@pytest.fixture
def stated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the scene of the pendulum, where the work is done."""
    (tmp_path / "pendulum.yaml").write_text(yaml.safe_dump(pendulum().model_dump(mode="json")))
    monkeypatch.chdir(tmp_path)
    return tmp_path


FELT = [{"marker": "imu", "quantity": axis, "tilt": TILT, "column": axis} for axis in ("ax", "ay")]
ALL = [
    *FELT,
    {"marker": "imu", "quantity": "rate", "column": "gyro"},
    {"joint": "O", "quantity": "fx", "column": "load"},
]


@pytest.mark.slow
@pytest.mark.usefixtures("stated")
def test_an_imu_of_another_engine_identifies_the_machine() -> None:
    found = identify(Problem.parse(problem(FELT), "felt"))
    assert found.verdict.trusted
    assert {name.quantity for name in found.measurement.first.channels} == {"ax", "ay"}
    for name, value in found.parameters.items():
        assert value.lower - value.std < found.truth[name] < value.upper + value.std


@pytest.mark.slow
def test_the_command_reads_a_table_of_sensors_in_their_units(stated: Path) -> None:
    """g, degrees per second and kilonewtons, with a bias of the gyro that is sought."""
    computed = Problem.parse(problem(ALL), "felt")
    shown = measure(computed, computed.load_scene()).first
    ax, ay, gyro, load = shown.values.T
    table = np.column_stack([shown.times, ax / 9.80665, ay, np.degrees(gyro + 0.05), load / 1e3])
    rows = [",".join(map(repr, row)) for row in table.tolist()]
    (stated / "run.csv").write_text("\n".join(["t,ax,ay,gyro,load", "s,g,m/s²,deg/s,kN", *rows]))
    bias = {"path": "measurement.bias_rate", "lower": -0.5, "upper": 0.5, "start": 0.0}
    known = {"initial.rod.angle": 0.5, "joints.O.friction": 0.15}
    changes = {"values": known, "source": {"kind": "file", "start": 0.0}, "parameters": {**LENGTH_ALONE, "bias": bias}}
    text = yaml.safe_dump(problem(ALL, **changes))
    (stated / "felt.yaml").write_text(text)
    result = CliRunner().invoke(main, ["identify", "felt.yaml", "--data", "run.csv", "--hold-out", "0.9:1", "--json"])
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    assert answer["parameters"]["bias"]["value"] == pytest.approx(0.05, abs=0.01)
    assert answer["parameters"]["length"]["value"] == pytest.approx(1.4, abs=0.02)
    assert {"marker": "O", "quantity": "fx"}.items() <= answer["prediction"][0]["channels"][3].items()
    assert all(one["inside"] for one in answer["prediction"][0]["channels"])


@pytest.mark.slow
def test_the_page_of_an_answer_shows_sensors_without_a_marker(stated: Path) -> None:
    computed = {"kind": "engine", "values": {"bodies.rod.length": 1.4}, "stop": 1.0, "count": 30, "noise": 1e-2}
    text = yaml.safe_dump(problem([ALL[-1], *FELT[:1]], parameters=LENGTH_ALONE, source=computed))
    (stated / "felt.yaml").write_text(text)
    result = CliRunner().invoke(main, ["identify", "felt.yaml", "--out", "felt.html"])
    assert result.exit_code == 0, result.output
    assert 'class="animation"' in (stated / "felt.html").read_text()


@pytest.mark.usefixtures("stated")
@pytest.mark.parametrize(
    ("channel", "words"),
    [
        ({"marker": "imu", "quantity": "acceleration"}, "quantity"),
        ({"marker": "imu", "quantity": "az"}, "az is measured in space; "),
        ({"marker": "post", "quantity": "ax"}, "no marker 'post'; there are imu, tip"),
        ({"quantity": "ay"}, "ay is measured at a marker; name it, and no joint"),
        ({"joint": "O", "quantity": "ay"}, "ay is measured at a marker; name it, and no joint"),
        ({"joint": "P", "quantity": "fx"}, "no joint 'P'; there are O"),
        ({"marker": "imu", "quantity": "torque"}, "torque is measured in a joint; name it, and no marker"),
        ({"marker": "imu", "quantity": "rate", "tilt": 0.1}, "tilt: of the axes of ax and ay, found rate"),
        ({"marker": "imu", "quantity": "ax", "height": 0.1}, "height: of a strain gauge above the axis"),
        ({"marker": "imu", "quantity": "ax", "to": "tip"}, "an angle or a rate is measured between two markers"),
        ({"marker": "imu", "quantity": "ax", "unit": "N"}, "ax is measured in one of m/s^2, g, found 'N'"),
        ({"marker": "imu", "quantity": "strain"}, "strain is measured on a flexible rod; rod, with marker imu"),
    ],
)
def test_a_sensor_that_the_machine_cannot_carry_is_refused_in_one_line(channel: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)) as refusal:
        Problem.parse(problem([channel]), "felt").load_scene()
    assert "\n" not in str(refusal.value)


def of_cantilever(**channel: Any) -> dict[str, Any]:
    modulus = {"path": "bodies.rod.youngs_modulus", "lower": 1e9, "upper": 4e9}
    return problem([channel], scene="cantilever.yaml", parameters={"modulus": modulus})


@pytest.mark.parametrize(
    ("channel", "words"),
    [
        ({"marker": "tip", "quantity": "ax", "tilt": [0.1, 0.0, 0.0]}, "tilt: "),
        ({"joint": "O", "quantity": "fz"}, "fz is measured in space; "),
        (
            {"marker": "gauge", "quantity": "strain", "height": 0.02},
            "height: 0.02 m is off the rod; at marker gauge it reaches from -0.01 to 0.01 m",
        ),
    ],
)
def test_a_gauge_beside_its_rod_and_sensors_of_space_on_a_rod_are_refused(
    stated: Path, channel: dict[str, Any], words: str
) -> None:
    (stated / "cantilever.yaml").write_text(yaml.safe_dump(cantilever().model_dump(mode="json")))
    with pytest.raises(InputError, match=re.escape(words)) as refusal:
        Problem.parse(of_cantilever(**channel), "felt").load_scene()
    assert "\n" not in str(refusal.value)


@pytest.mark.slow
def test_a_strain_gauge_of_a_stick_that_is_let_go_tells_its_modulus(stated: Path) -> None:
    """Cables of Exudyn, that swing about the clamp after the load is gone."""
    free = cantilever(
        loads={}, gravity=[0.0, -9.81], initial={"rod": {"angle": 0.0}}, solver={"duration": 0.4, "step": 1e-3}
    )
    (stated / "cantilever.yaml").write_text(yaml.safe_dump(free.model_dump(mode="json")))
    computed = {"kind": "engine", "values": {"bodies.rod.youngs_modulus": 2.4e9}, "stop": 0.3, "count": 60}
    stated_problem = of_cantilever(marker="gauge", quantity="strain", height=0.01)
    found = identify(Problem.parse({**stated_problem, "source": {**computed, "noise": 1e-5}}, "felt"))
    modulus = found.parameters["modulus"]
    assert modulus.lower - modulus.std < 2.4e9 < modulus.upper + modulus.std
