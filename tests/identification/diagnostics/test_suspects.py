"""Which property of a measurement explains a misfit: the right one, with its value, and none where none is wrong."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pandas as pd
import pytest
import shoal
import yaml
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem, Verdict, identify, load_problem
from shoal.identification.diagnostics.suspects import Suspect, suspects
from shoal.identification.diagnostics.suspects.of_machine import of_machine
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import differentiate, least_squares
from shoal_validation.coverage.cases import tip
from shoal_validation.coverage.sensed_machines import machine
from shoal_validation.suspects.study import trial

RECORDINGS = Path(__file__).parents[4] / "shared" / "data" / "multiarm_kaheman"
ANGLE = {"lower": -np.pi, "upper": np.pi}


def found(points: np.ndarray, times: np.ndarray, gravity: float = -9.81) -> dict[str, Suspect]:
    """Suspects of both angles fitted to a tip's path, which has 1 mm of noise."""
    data = {
        "name": "suspects",
        "scene": "rigid-double-pendulum",
        "parameters": {
            "theta1": {"path": "initial.OA.angle", **ANGLE},
            "theta2": {"path": "initial.AB.angle", **ANGLE},
        },
        "channels": [{"marker": "B", "quantity": q, "column": q} for q in ("x", "y")],
        "source": {"kind": "file"},
    }
    problem = Problem.parse(data, "suspects")
    noisy = points + 1e-3 * np.random.default_rng(1).standard_normal(points.shape)
    scene = problem.load_scene({"gravity.1": gravity})
    measurement = Measurement.single(times, tuple(problem.channels), noisy, "scipy DOP853")
    model = ForwardModel(problem, scene, get_engine("gauss"), measurement)
    outcome = least_squares(model, np.random.default_rng(0), lambda *_: None)
    return {
        suspect.name: suspect
        for suspect in suspects(model, outcome.point, *differentiate(model, outcome.point), 1e-3).suspects
    }


TIMES = np.arange(1, 151) / 100
TIP = tip(TIMES, np.pi / 4, np.pi / 6)


def test_nothing_is_suspect_where_the_model_is_right() -> None:
    assert found(TIP, TIMES) == {}


def test_every_suspect_of_a_machine_has_a_name_of_its_own() -> None:
    """Both coordinates of a centre of mass beside the axes, among others."""
    scene = machine(np.random.default_rng(40)).scene
    seen = [SimpleNamespace(marker=marker, is_position=True) for marker in scene.markers]
    measurement = SimpleNamespace(recordings={"one": SimpleNamespace(channels=seen)})
    candidates = [*of_machine(cast("ForwardModel", SimpleNamespace(scene=scene, measurement=measurement)))]
    names = [candidate.name for candidate in candidates]
    assert {"x of the centre of mass of crank", "y of the centre of mass of crank"} <= {*names}
    assert len({*names}) == len(names)


@pytest.mark.slow
def test_a_wrong_clock() -> None:
    """The recording shows 1.26 s for each second; gravity explains a free swing as well, by the square of that."""
    named = found(tip(TIMES / 1.26, np.pi / 4, np.pi / 6), TIMES)
    assert named["clock"].value == pytest.approx(1.26, rel=2e-3)
    assert named["clock"].after < 2e-3 < 0.1 < named["clock"].before
    assert named["gravity"].value == pytest.approx(-9.81 / 1.26**2, rel=4e-3)
    assert "the clock: a factor of 1.26 would lower the misfit from" in str(named["clock"])


@pytest.mark.slow
def test_a_wrong_scale() -> None:
    named = found(TIP / 1.1, TIMES)
    assert named["scale"].value == pytest.approx(1.1, rel=2e-3)
    assert next(iter(named)) == "scale"


@pytest.mark.slow
def test_a_tilted_camera() -> None:
    c, s = np.cos(0.2), np.sin(0.2)
    named = found(TIP @ np.array([[c, -s], [s, c]]), TIMES)
    assert next(iter(named)) == "tilt"
    assert named["tilt"].value == pytest.approx(0.2, abs=2e-3)


def test_a_shifted_origin() -> None:
    named = found(TIP - [0.15, 0.0], TIMES)
    assert next(iter(named)) == "x"
    assert named["x"].value == pytest.approx(0.15, abs=2e-3)


@pytest.mark.slow
def test_a_late_start() -> None:
    """Recorded time 0 is 0.1 s after the release."""
    named = found(tip(TIMES + 0.1, np.pi / 4, np.pi / 6), TIMES)
    assert named["delay"].value == pytest.approx(0.1, abs=2e-3)


@pytest.mark.slow
def test_a_release_after_the_recording_began() -> None:
    """The machine is held for 0.3 s."""
    times = np.arange(1, 181) / 100
    held = np.concatenate([np.repeat(tip(np.array([1e-9]), np.pi / 4, np.pi / 6), 30, axis=0), TIP])
    named = found(held, times)
    assert next(iter(named)) == "delay"
    assert named["delay"].value == pytest.approx(-0.3, abs=2e-3)


def test_friction() -> None:
    """Of Lagrange's equations, at the ground."""
    named = found(tip(TIMES, np.pi / 4, np.pi / 6, friction=0.3), TIMES)
    assert next(iter(named)) == "friction of O"
    assert named["friction of O"].value == pytest.approx(0.3, rel=2e-2)
    assert named["friction of O"].kind == "machine"


@pytest.mark.slow
def test_a_heavier_rod() -> None:
    named = found(tip(TIMES, np.pi / 4, np.pi / 6, density=1500.0), TIMES)
    heavier = {"mass of AB": 1500.0, "mass of OA": 1000.0 / 1.5}
    assert next(iter(named)) in heavier
    for name, density in heavier.items():
        assert named[name].value == pytest.approx(density, rel=2e-2)


@pytest.mark.slow
def test_millimetres() -> None:
    named = found(1e3 * TIP, TIMES)
    assert next(iter(named)) == "unit of the positions"
    assert named["unit of the positions"].value == pytest.approx(1e-3)


@pytest.mark.slow
def test_causes_are_named_first() -> None:
    """Random faults of random machines, recorded by Exudyn; the whole study has 200."""
    wrong = [trial(seed) for seed in range(1000, 1040)]
    assert sum(t.first for t in wrong) >= 0.85 * sum(t.noticed for t in wrong)
    right = [trial(seed, "right") for seed in range(40)]
    assert sum(t.verdict == Verdict.REJECTED for t in right) <= 1


def test_what_is_sought_is_no_suspect() -> None:
    """A clock among the parameters finds its own value."""
    data = {
        "name": "clock",
        "scene": "rigid-double-pendulum",
        "parameters": {
            "theta1": {"path": "initial.OA.angle", **ANGLE},
            "theta2": {"path": "initial.AB.angle", **ANGLE},
            "clock": {"path": "measurement.clock", "lower": 0.5, "upper": 2.0, "start": 1.2},
        },
        "channels": [{"marker": "B", "quantity": q, "column": q} for q in ("x", "y")],
        "source": {"kind": "file"},
    }
    problem = Problem.parse(data, "clock")
    points = tip(TIMES / 1.26, np.pi / 4, np.pi / 6) + 1e-3 * np.random.default_rng(1).standard_normal(TIP.shape)
    measurement = Measurement.single(TIMES, tuple(problem.channels), points, "scipy DOP853")
    estimate = identify(problem, method="least-squares", measurement=measurement)
    assert estimate.suspects == []
    assert estimate.parameters["clock"].lower <= 1.26 <= estimate.parameters["clock"].upper


@pytest.mark.slow
@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the recordings are not here")
def test_the_zero_of_a_real_encoder() -> None:
    """Most of the residual of the real single pendulum is a vertical that is off by 1.4 mrad."""
    data = str(RECORDINGS / "single_1kHz.csv.gz")
    estimate = identify(load_problem("kaheman-single"), method="least-squares", data=data)
    named = {suspect.name: suspect for suspect in estimate.suspects}
    assert named["tilt"].value == pytest.approx(-1.4e-3, abs=2e-4)
    assert named["tilt"].after < 6e-4


@pytest.mark.slow
def test_a_place_beside_the_axis_of_a_rigid_rod_keeps_it_rigid(tmp_path: Path) -> None:
    """Outliers in a pendulum by scipy are rejected, though the rod, with a place beside its axis, cannot be bent."""
    rod = {"kind": "rod", "length": 0.8, "height": 0.02, "width": 0.02, "density": 6250.0}
    hinge = {"kind": "revolute", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "b"}}
    scene = {
        "name": "pendulum", "bodies": {"b": rod}, "joints": {"O": hinge}, "initial": {"b": {"angle": 0.3, "rate": 0.0}},
        "markers": {"imu": {"body": "b", "point": [0.6, 0.1]}, "tip": {"body": "b", "point": "end"}},
    }  # fmt: skip
    t = np.linspace(0.0, 1.0, 101)
    swing = solve_ivp(lambda _, y: (y[1], -1.5 * 9.81 / 0.8 * np.cos(y[0])), (0, 1), (0.4, 0.0), t_eval=t, rtol=1e-10)
    x, y = 0.8 * np.cos(swing.y[0]), 0.8 * np.sin(swing.y[0])
    x[::30] += 0.3
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene))
    problem = {
        "name": "beside", "scene": str(tmp_path / "scene.yaml"), "noise": 1e-3,
        "source": {"kind": "file", "path": "run.csv"},
        "parameters": {"angle": {"path": "initial.b.angle", "lower": -1.0, "upper": 1.0}},
        "channels": [{"marker": "tip", "quantity": q, "column": q} for q in "xy"],
    }  # fmt: skip
    run = pd.DataFrame({"t": t, "x": x, "y": y})
    told = shoal.identify(Problem.parse(problem, "beside"), run, method="least-squares")
    assert told.verdict is Verdict.REJECTED
