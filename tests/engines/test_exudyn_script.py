"""Exported scripts for Exudyn: run by themselves, against the engine that enters the same and the native one."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.course import Clock
from shoal.engines.exudyn import formulas, timed
from shoal.engines.exudyn.recorder import Recorder, Texts
from shoal.engines.exudyn.script import script
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Function, Scene, load_scene
from shoal.scene.load import scene_names
from shoal.trajectory import Array

pytest.importorskip("exudyn")

GROUND = {"body": "ground", "point": [0.0, 0.0]}
CABLE = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 2700.0, "youngs_modulus": 7e9,
         "element": "ancf-cable", "elements": 4}  # fmt: skip
LINK = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "named_points": {"end": [1.0, 0.0]}}
SOLVER = {"duration": 0.2, "samples": 4, "step": 1e-3}
GUST = "step(t - 0.123)*exp(-t)*sin(9*t)"
TABLE = {"table": [[0.0, 0.0], [0.1, 0.3], [0.25, -0.2], [0.4, 0.1]]}


def scene(**fields: Any) -> Scene:
    return Scene.parse({"name": "of-a-test", "solver": SOLVER, **fields})


def run(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> Array:
    """The table that a script writes, without its first column."""
    file = folder / "machine.py"
    file.write_text(text, encoding="utf-8")
    runpy.run_path(str(file), run_name="__main__")
    assert capsys.readouterr().out.strip().endswith("machine.csv")
    return np.loadtxt(file.with_suffix(".csv"), delimiter=",", skiprows=1, ndmin=2)


def agrees(machine: Scene, folder: Path, capsys: pytest.CaptureFixture[str], within: float) -> None:
    """The script's motion is that of the engine to the digits that it writes, and the native one `within` [m]."""
    table = run(script(machine), folder, capsys)
    engine, ours = get_engine("exudyn").simulate(machine), simulate(machine, table[:, 0])
    assert engine.ok, engine.message
    assert ours.ok, ours.message
    assert np.allclose(table[:, 0], engine.times, rtol=0, atol=1e-11)
    places = table[:, 1:].reshape(len(table), len(ours.markers), -1)
    assert np.max(np.abs(places - engine.points[..., 0])) < 2e-11
    assert np.max(np.abs(places - ours.points[..., 0])) < within


LOADED = scene(
    bodies={"boom": CABLE, "load": {"kind": "point-mass", "mass": 0.5}, "arm": LINK},
    joints={
        "foot": {"kind": "weld", "first": GROUND, "second": {"body": "boom"}},
        "rope": {"kind": "distance", "first": {"body": "boom", "point": "end"}, "second": {"body": "load"}},
        "hinge": {"first": {"body": "ground", "point": [2.0, 0.0]}, "second": {"body": "arm"},
                  "friction": 0.05, "coulomb": 0.1, "coulomb_speed": 0.5},
    },
    loads={
        "gust": {"kind": "force", "at": {"body": "load"}, "force": [1.0, 0.5], "scale": GUST},
        "wind": {"kind": "distributed-force", "body": "boom", "force": [0.0, -1.0], "scale": TABLE},
        "motor": {"kind": "torque", "at": {"body": "arm"}, "torque": {**TABLE, "smooth": False}},
        "spiral": {"kind": "torsion-spring", "first": GROUND, "second": {"body": "arm"}, "stiffness": 1.0,
                   "cubic": 0.4, "damping": 0.01, "elastic": "0.3*tanh(2*t) + abs(t)*t"},
        "coil": {"kind": "spring", "first": {"body": "ground", "point": [2.0, 2.0]},
                 "second": {"body": "arm", "point": "end"}, "stiffness": 3.0,
                 "elastic": {"table": [[-1.0, -0.1], [0.0, 0.0], [1.0, 0.3]]}},
    },
    markers={"tip": {"body": "boom", "point": "end"}, "load": {"body": "load"},
             "hand": {"body": "arm", "point": "end"}},
    initial={"boom": {"angle": 0.4}, "load": {"position": [0.95, 0.1]}, "arm": {"angle": 0.3}},
)  # fmt: skip

DRIVEN = scene(
    bodies={"crank": LINK, "rod": LINK, "block": {"kind": "rigid-body", "mass": 0.4, "inertia": 0.01}},
    ground_points={"P": {"x": "0.1*ramp(3*t)", "y": TABLE}},
    joints={
        "drive": {"kind": "driven-angle", "first": GROUND, "second": {"body": "crank"},
                  "angle": "0.5 + t*t/(1 + t) + 0.1*tanh(3*t)**2"},
        "main": {"first": {"body": "ground", "point": "P"}, "second": {"body": "crank"}},
        "pin": {"first": {"body": "crank", "point": "end"}, "second": {"body": "rod"}},
        "wrist": {"first": {"body": "rod", "point": "end"}, "second": {"body": "block"}},
        "rail": {"kind": "slider", "first": GROUND, "second": {"body": "block"}, "rotation": "locked",
                 "friction": 0.1, "coulomb": 0.2, "coulomb_speed": 0.5},
    },
    loads={"push": {"kind": "force", "at": {"body": "block"}, "force": [1.0, 0.0], "scale": "sin(5*t)/t"}},
    markers={"pin": {"body": "rod"}, "block": {"body": "block"}},
    initial={"crank": {"angle": 0.5}, "rod": {"guess": ["angle"], "angle": -0.4}},
)  # fmt: skip

TURNED = Scene.parse({
    "name": "turned", "dimensions": 3, "solver": SOLVER,
    "bodies": {
        "base": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1, 0.2, 0.15],
                 "named_points": {"end": [0.3, 0, 0.1]}},
        "arm": {"kind": "rigid-body", "mass": 0.5, "inertia": 0.05, "centre_of_mass": [0.2, 0, 0],
                "named_points": {"end": [0.5, 0, 0]}},
        "whip": CABLE,
    },
    "joints": {
        "turn": {"kind": "driven-angle", "first": GROUND, "second": {"body": "base"}, "axis": [0, 0, 1],
                 "angle": "0.3*sin(2*t)"},
        "main": {"first": GROUND, "second": {"body": "base"}, "axis": [0, 0, 1]},
        "elbow": {"first": {"body": "base", "point": "end"}, "second": {"body": "arm"}, "axis": [0, 1, 0],
                  "friction": 0.1},
        "held": {"kind": "weld", "first": {"body": "arm", "point": "end"}, "second": {"body": "whip"}},
    },
    "loads": {"motor": {"kind": "torque", "at": {"body": "arm"}, "axis": [0, 1, 0], "torque": "sin(6*t)",
                        "reaction": {"body": "base"}}},
    "markers": {"tip": {"body": "whip", "point": "end"}, "hand": {"body": "arm", "point": "end"}},
})  # fmt: skip


@pytest.mark.parametrize(
    ("machine", "within"),
    [
        pytest.param(LOADED, 2e-4, id="loaded", marks=pytest.mark.slow),
        pytest.param(DRIVEN, 1e-4, id="driven"),
        pytest.param(TURNED, 1e-3, id="in-space", marks=pytest.mark.slow),
    ],
)
def test_scripts_move_as_both_engines(
    machine: Scene, within: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    agrees(machine, tmp_path, capsys, within)


REPRESENTATIVE = "flexible-double-pendulum", "andrews-squeezer"
SINGULAR = "equal-slider-crank", "n-four-bar-2", "n-four-bar-40", "parallelogram"
"""Exudyn does not pass their singular positions."""
REFUSED = {"flexible-slider-crank": "modal", "swinging-strip": "director-rod"}
"""Scenes of which the script has no such element."""


@pytest.mark.parametrize(
    "name",
    [
        name if name in REPRESENTATIVE else pytest.param(name, marks=pytest.mark.slow)
        for name in scene_names()
        if name not in (*SINGULAR, *REFUSED)
    ],
)
def test_built_in_scenes(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    agrees(load_scene(name), tmp_path, capsys, 2e-4)


@pytest.mark.parametrize(("name", "element"), REFUSED.items())
def test_elements_that_it_has_not_are_refused_by_name(name: str, element: str) -> None:
    with pytest.raises(InputError, match=rf"^bodies\.\w+\.element: engine exudyn cannot do {element}$"):
        script(load_scene(name))


def test_a_script_runs_where_there_is_no_shoal(tmp_path: Path) -> None:
    """In a process of its own that refuses to import it."""
    text = script(load_scene("single-pendulum"))
    assert max(map(len, text.splitlines())) <= 120
    assert "shoal" not in text.lower().replace("written by shoal", "")
    (tmp_path / "p.py").write_text(f"import sys\nsys.modules['shoal'] = None\n{text.split(chr(34) * 3, 2)[2]}")
    done = subprocess.run([sys.executable, str(tmp_path / "p.py")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "p.csv").read_text().startswith("t,A.x,A.y\n")


def test_a_script_that_fails_says_until_where(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine = load_scene("parallelogram").with_values({"solver.duration": 4.0, "solver.step": 1e-2})
    with pytest.raises(SystemExit, match=r"gave up at 3\.1"):
        run(script(machine), tmp_path, capsys)


def test_rods_are_loops_and_bodies_have_their_names() -> None:
    text = script(load_scene("flexible-double-pendulum"))
    for line in ("# bodies.AB: rod, ancf-cable, 4 elements", "for k in range(4):", "# joints.A: revolute"):
        assert f"\n{line}" in text
    assert "nodeNumbers=[AB_node[k], AB_node[k + 1]]" in text


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"bodies.OA.element": "ancf-quintic"}, "bodies.OA.element: engine exudyn cannot do ancf-quintic"),
        ({"bodies.OA.element": "ancf-full"}, "bodies.OA.element: engine exudyn cannot do ancf-full"),
    ],
)
def test_what_exudyn_has_not_is_named(values: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}$"):
        script(load_scene("flexible-double-pendulum").with_values(values))


def test_a_drive_whose_rate_jumps_is_named() -> None:
    jumping = DRIVEN.with_values({"joints.drive.angle": "0.5 + abs(t - 0.1) - 0.1"})
    with pytest.raises(InputError, match=r"joints.drive.angle: .* a drive whose rate jumps, at t = 0.1$"):
        script(jumping)


EXPRESSIONS = (
    "2*t - (1 - t) - (t - 3)", "t**3/(1 + t)/(2 + t)", "-t**2", "(-t)**2", "2**-t", "(1 + t)**(t + 0.5)",
    "exp(-t)*log(1 + t)",
    "sqrt(1 + t*t) - tan(0.3*t)", "min(t, 0.3, 1 - t) + max(sin(9*t), 0)", "abs(t - 0.4)*ramp(2*t)", "step(sin(30*t))",
    "tanh(t - 0.2)/cos(t)", "sin(t)/t",
)  # fmt: skip


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_functions_of_time_as_python(text: str) -> None:
    """The text of the function and of its slope against the engine's, and the slope against differences."""
    f, clock = Function(expression=text), Clock(1.0, 1e-3)
    course = clock.course(f)
    known = {"np": np, "clock": {"until": np.inf}, **vars(timed)}
    texts = Texts(Recorder(None, None, (0.0,), clock, fields={id(course): (course, "loads.f.scale")}), None)
    value, slope = (eval(texts._definition(course, which), known) for which in ("value", "slope"))
    away = [t for t in np.linspace(0.0, 0.99, 34) if np.min(np.abs(course.kinks - t), initial=1.0) > 1e-3]
    for t in away:
        assert value(t) == pytest.approx(course.value(t), rel=1e-12, abs=1e-12)
        assert slope(t) == pytest.approx(course.slope(t), rel=1e-9, abs=1e-9)
        if t > 0.01:
            assert slope(t) == pytest.approx((value(t + 1e-6) - value(t - 1e-6)) / 2e-6, rel=1e-6, abs=1e-6)
    if f.formula is not None and "/t" not in text:
        raw = eval(f"lambda t: {formulas.text(f.formula)}", known)
        assert [float(raw(np.float64(t))) for t in away] == pytest.approx([course.value(t) for t in away], rel=1e-13)


@pytest.mark.parametrize("smooth", [True, False])
def test_tables_as_python(smooth: bool) -> None:
    clock = Clock(1.0, 1e-3)
    course = clock.course(Function(table=((0.1, 1.0), (0.3, -1.0), (0.4, 2.0), (0.7, 0.5)), smooth=smooth))
    texts = Texts(Recorder(None, None, (0.0,), clock, fields={id(course): (course, "loads.f.scale")}), None)
    known = {"np": np, "clock": {"until": np.inf}, **vars(timed)}
    value, slope = (eval(texts._definition(course, which), known) for which in ("value", "slope"))
    for t in np.linspace(0.0, 1.0, 41):
        assert value(t) == pytest.approx(course.value(t), abs=1e-13)
        assert slope(t) == pytest.approx(course.slope(t), abs=1e-11)


def test_a_load_that_grows_from_zero(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The engine and its script end Newton's iteration by the same tolerance, that of the machine's own forces."""
    stiff = {**CABLE, "youngs_modulus": 2e12}
    push = {"kind": "force", "at": {"body": "arm", "point": "end"}, "force": [0.0, 0.1], "scale": "sin(3*t)"}
    arm = {"O": {"first": GROUND, "second": {"body": "arm"}}}
    machine = scene(gravity=[0.0, 0.0], bodies={"arm": stiff}, joints=arm, loads={"push": push},
                    markers={"tip": {"body": "arm", "point": "end"}})  # fmt: skip
    agrees(machine, tmp_path, capsys, within=1e-6)
