"""Starts at the end of another run: two runs in a row are one, and what is let go moves as the closed forms say."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from scipy.optimize import brentq
from shoal.cli import main
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.fmu.energy import energies
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene, load_scene
from shoal.serialization import packed, unpacked

GROUND = {"body": "ground", "point": [0.0, 0.0]}


def wheel(**fields: Any) -> Scene:
    """A wheel that a torque turns round and round, against a torsion spring and the friction of its bearing."""
    return Scene.parse(
        {
            "name": "wheel",
            "gravity": [0.0, 0.0],
            "bodies": {"wheel": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.5}},
            "joints": {"pin": {"kind": "revolute", "first": GROUND, "second": {"body": "wheel"}, "friction": 0.1}},
            "loads": {"spring": {"kind": "torsion-spring", "first": GROUND, "second": {"body": "wheel"},
                                 "stiffness": 0.3},
                      "motor": {"kind": "torque", "at": {"body": "wheel"}, "torque": 4.0}},
            "markers": {"hub": {"body": "wheel"}},
            "solver": {"duration": 4.0, "samples": 8, "integrator": "dop853"},
        }
        | fields
    )  # fmt: skip


def oscillator(force: float, **fields: Any) -> Scene:
    """A mass on a spring of 100 N/m that a constant force pulls."""
    pull = {"pull": {"kind": "force", "at": {"body": "mass"}, "force": [force, 0.0]}} if force else {}
    spring = {"kind": "spring", "first": {"body": "ground", "point": [-1.0, 0.0]}, "second": {"body": "mass"},
              "stiffness": 100.0, "length": 1.0}  # fmt: skip
    return Scene.parse(
        {
            "name": "oscillator",
            "gravity": [0.0, 0.0],
            "bodies": {"mass": {"kind": "point-mass", "mass": 2.0}},
            "loads": {"spring": spring} | pull,
            "markers": {"mass": {"body": "mass"}},
            "initial": {"mass": {"position": [0.0, 0.0]}},
            "solver": {"duration": 0.3, "samples": 6, "integrator": "dop853"},
        }
        | fields
    )


def end_of(scene: Scene, time: float) -> Any:
    """What the JSON of a run tells of its end."""
    run = get_engine("gauss").simulate(scene, [0.0, time])
    assert run.ok, run.message
    return json.loads(json.dumps(run.to_json()))["end"]


MACHINES = {
    "rigid": (lambda: load_scene("rigid-double-pendulum").with_values({"solver.integrator": "dop853"}), 0.4, 1e-9),
    "flexible": (
        lambda: load_scene("flexible-double-pendulum").with_values({"solver.integrator": "leapfrog"}), 0.1, 1e-9,
    ),
    "closed loop": (lambda: load_scene("parallelogram"), 0.3, 1e-9),
    "in space": (lambda: load_scene("spherical-pendulum"), 0.4, 1e-9),
    "spring and friction": (wheel, 3.0, 1e-9),
}  # fmt: skip


@pytest.mark.parametrize("name", MACHINES)
def test_two_runs_in_a_row_are_one(name: str) -> None:
    make, half, close = MACHINES[name]
    scene, engine = make(), get_engine("gauss")
    whole = engine.simulate(scene, [half, 2 * half])
    on = scene.with_values({"initial.from": end_of(scene, half)})
    again = engine.simulate(on, [0.0, half])
    assert again.ok, again.message
    assert np.ptp(whole.points[:, :, :, 0], axis=0).max() > 0.01 or np.ptp(whole.angles) > 1.0
    for field in ("points", "angles", "velocities", "rates"):
        one, other = getattr(whole, field), getattr(again, field)
        assert other == pytest.approx(one, abs=close * max(1.0, np.max(np.abs(one)))), field
    assert again.model["initial_changes"] == {}
    kept = energies(scene, np.array([0.0, half]))[-1]
    assert energies(on, np.array([0.0, 1e-3]))[0] == pytest.approx(kept, abs=1e-9 * max(1.0, abs(kept)))


def test_turns_are_counted_on() -> None:
    """The wheel has turned by more than once, which its spring and its marker remember."""
    end = end_of(wheel(), 3.0)
    assert end["angles"]["hub"] > 2 * np.pi
    assert end["turns"]["spring"] == pytest.approx([end["angles"]["hub"]])
    without = wheel().model_dump(mode="json")
    del without["loads"]["motor"]
    rate = get_engine("gauss").simulate(wheel(), [3.0]).rates[-1, 0, 0]
    accelerated = -(0.3 * end["angles"]["hub"] + 0.1 * rate) / 0.5
    later = get_engine("gauss").simulate(Scene.parse(without | {"initial_from": end}), [0.0, 1e-4])
    assert (later.rates[1, 0, 0] - rate) / 1e-4 == pytest.approx(accelerated, rel=1e-3)


def test_a_mass_that_is_let_go_swings_as_the_closed_form_says() -> None:
    force, half, w = 7.0, 0.3, np.sqrt(100.0 / 2.0)
    end = end_of(oscillator(force), half)
    run = get_engine("gauss").simulate(oscillator(0.0, initial={"from": end, "mass": {"position": [0.0, 0.0]}}))
    assert run.ok, run.message
    place, speed = force / 100.0 * (1 - np.cos(w * half)), force / 100.0 * w * np.sin(w * half)
    known = place * np.cos(w * run.times) + speed / w * np.sin(w * run.times)
    assert run.marker("mass")[:, 0] == pytest.approx(known, abs=1e-10)


def test_lanes_go_on_from_one_end() -> None:
    end = end_of(oscillator(7.0), 0.3)
    scene = oscillator(7.0).with_values({"initial.from": end})
    stiffness = np.array([50.0, 100.0, 200.0])
    run = get_engine("gauss").simulate_many(scene, {"loads.spring.stiffness": stiffness}, [0.0, 0.2])
    x, v = end["bodies"]["mass"]["vectors"][0][0], end["bodies"]["mass"]["rates"][0][0]
    for lane, k in enumerate(stiffness):
        w, rest = np.sqrt(k / 2.0), 7.0 / k
        known = rest + (x - rest) * np.cos(0.2 * w) + v / w * np.sin(0.2 * w)
        assert run.marker("mass", lane)[:, 0] == pytest.approx([x, known], abs=1e-10)


def test_more_elements_take_the_same_curve() -> None:
    """Markers and energy of a bent machine are those of the run, on twice as many elements too."""
    scene = load_scene("flexible-double-pendulum").with_values({"solver.integrator": "leapfrog"})
    end = end_of(scene, 0.1)
    finer = {f"bodies.{name}.elements": 2 * body.elements for name, body in scene.bodies.items()}
    on = scene.with_values({"initial.from": end})
    both = [one.with_values({"solver.step": 5e-5}) for one in (on, on.with_values(finer))]
    runs = [get_engine("gauss").simulate(one, [0.0, 0.01]) for one in both]
    assert all(run.ok for run in runs)
    for field in ("points", "velocities"):
        one, other = (getattr(run, field)[0] for run in runs)
        assert other == pytest.approx(one, abs=1e-12)
    one, other = (energies(scene, np.array([0.0, 1e-3]))[0] for scene in both)
    assert other == pytest.approx(one, rel=1e-4)
    run = verified(get_engine("gauss"), on.with_values({"solver.duration": 0.02}))
    assert run.model["verification"]["mesh_error"] is not None


def test_what_is_written_can_be_read() -> None:
    run = get_engine("gauss").simulate(wheel(), [0.0, 1.0])
    assert run.end is not None
    end = dict(run.end)
    scene = wheel().with_values({"initial.from": end})
    assert Scene.parse(scene.model_dump(mode="json")) == scene
    assert scene.fingerprint != wheel().fingerprint
    assert scene.with_values({"initial.from": None}) == wheel()
    assert pickle.loads(pickle.dumps(run)).end == end
    assert dict(unpacked(packed(run)).end) == end


def test_a_file_beside_the_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the command line, in a scene's file, and in the library, which keeps the file."""
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path / "home"))
    data = oscillator(7.0).model_dump(mode="json", exclude_none=True)
    (tmp_path / "pulled.yaml").write_text(yaml.safe_dump(data))
    data["initial"]["from"] = "end.json"
    (tmp_path / "on.yaml").write_text(yaml.safe_dump(data))
    run, end = CliRunner().invoke, tmp_path / "end.json"
    pulled = str(tmp_path / "pulled.yaml")
    assert run(main, ["simulate", pulled, "--out", str(end), "--no-verify"]).exit_code == 0
    found = []
    for command in ([pulled, "--set", f"initial.from={end}"], [str(tmp_path / "on.yaml")], ["kept"]):
        if command == ["kept"]:
            added = run(main, ["library", "add", str(tmp_path / "on.yaml"), "--name", "kept"])
            assert added.exit_code == 0, added.output
            end.unlink()
        answer = run(main, ["simulate", *command, "--json", "--no-verify"])
        assert answer.exit_code == 0, answer.output
        found.append(json.loads(answer.stdout)["markers"]["mass"]["x"])
    assert found[0][1] == pytest.approx(0.07 * (1 - np.cos((0.3 + 0.3 / 6) * np.sqrt(50.0))), abs=1e-10)
    assert found[0] == found[1] == found[2]


def _cut(end: Any) -> None:
    end["bodies"]["wheel"]["vectors"].pop()


def _moved(end: Any) -> None:
    end["bodies"]["wheel"]["vectors"][0][0] += 0.01


def _flying(end: Any) -> None:
    end["bodies"]["wheel"]["rates"][0][0] += 0.01


def _stretched(end: Any) -> None:
    end["bodies"]["wheel"]["vectors"][1] = [2 * part for part in end["bodies"]["wheel"]["vectors"][1]]


def _renamed(end: Any) -> None:
    end["bodies"]["disc"] = end["bodies"].pop("wheel")


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (_cut, r"initial\.from: bodies\.wheel\.vectors: a body of this kind has 2 of 2 components, found 1"),
        (_moved, r"initial\.from: the joints hold wheel 0\.01 m away from where the run left it"),
        (_flying, r"initial\.from: the joints hold wheel 0\.01 m/s away from where the run left it"),
        (_stretched, r"initial\.from: wheel is off by 0\.\d+ m"),
        (_renamed, r"initial\.from: bodies\.(wheel|disc): only the (scene|run) has such a body"),
    ],
)
def test_an_end_of_something_else_is_refused(spoil: Any, told: str) -> None:
    end = end_of(wheel(), 1.0)
    spoil(end)
    with pytest.raises(InputError, match=told):
        get_engine("gauss").simulate(wheel().with_values({"initial.from": end}))


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"initial.from": "end.json"}, r"initial\.from: `statics` or the `end` of a run's JSON, found 'end\.json'$"),
        ({"initial.from": {"t": 1.0}}, r"initial\.from: bodies: Field required"),
        ({"initial.OA.angle": 0.3}, r"^initial\.OA\.angle: the machine starts at the end of a run; take initial\.from"),
        ({"bodies.OA.length": 1.5}, r"initial\.from: bodies\.OA\.length: 1\.5 in the scene, 1\.0 in the run$"),
        ({"bodies.OA.elements": 3}, r"initial\.from: bodies\.OA\.elements: 3 in the scene, 2 in the run$"),
        ({"bodies.OA.element": "ancf-quintic"}, r"bodies\.OA\.element: ancf-quintic in the scene, ancf-cable in the"),
    ],
)
def test_what_does_not_fit_is_refused(values: dict[str, Any], told: str) -> None:
    scene = load_scene("flexible-double-pendulum")
    scene = scene.with_values({"initial.from": end_of(scene, 0.01)})
    with pytest.raises(InputError, match=told):
        scene.with_values(values)


def test_a_drive_begins_anew() -> None:
    """Where the drive at time 0 is not where the run ended, the joint would jump; its time is added by hand."""

    def driven(angle: str) -> Scene:
        data = wheel().model_dump(mode="json")
        data["joints"]["drive"] = {"kind": "driven-angle", "first": GROUND, "second": {"body": "wheel"}, "angle": angle}
        return Scene.parse(data | {"loads": {}})

    end = end_of(driven("0.5 * t"), 1.0)
    with pytest.raises(InputError, match=r"drives at time 0"):
        get_engine("gauss").simulate(driven("0.5 * t").with_values({"initial.from": end}))
    run = get_engine("gauss").simulate(driven("0.5 * (t + 1)").with_values({"initial.from": end}), [0.0, 1.0])
    assert run.angle("hub") == pytest.approx([0.5, 1.0], abs=1e-9)


def test_a_rod_goes_on_with_the_clamp_that_moves_it() -> None:
    """The end's rates are those of its free nodes; a clamp of the ground was said to turn."""

    def shaken(height: str) -> Scene:
        rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 1000.0, "youngs_modulus": 2e7}
        base = {"body": "ground", "point": "base"}
        return Scene.parse(
            {
                "name": "shaken",
                "bodies": {"A": {**rod, "element": "ancf-cable", "elements": 2}},
                "joints": {"clamp": {"kind": "weld", "first": base, "second": {"body": "A"}}},
                "ground_points": {"base": {"y": height}},
                "markers": {"tip": {"body": "A", "point": "end"}},
                "initial": {"A": {"angle": 0.5}},
            }
        )

    engine, scene = get_engine("gauss"), shaken("0.2 * t * sin(5*t)")
    whole, end = engine.simulate(scene, [0.02, 0.04]), end_of(scene, 0.02)
    later = shaken("0.2 * (t + 0.02) * sin(5*(t + 0.02))").with_values({"initial.from": end})
    assert engine.simulate(later, [0.0, 0.02]).points == pytest.approx(whole.points, abs=1e-12)


def test_another_engine_refuses_it() -> None:
    scene = wheel().with_values({"initial.from": end_of(wheel(), 0.1)})
    with pytest.raises(
        InputError, match=r"^initial.from: engine exudyn cannot do starts at the end of a run; use gauss$"
    ):
        get_engine("exudyn").simulate(scene)


def leaning(initial: Any) -> Scene:
    """An arm above its joint that a spring holds too weakly to stand: it leans to one side or to the other."""
    return Scene.parse(
        {
            "name": "leaning",
            "bodies": {"arm": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01, "centre_of_mass": [0.3, 0.0]}},
            "joints": {"pin": {"first": GROUND, "second": {"body": "arm"}, "friction": 0.5}},
            "loads": {"coil": {"kind": "torsion-spring", "first": GROUND, "second": {"body": "arm"}, "stiffness": 1.0,
                               "angle": np.pi / 2}},
            "markers": {"middle": {"body": "arm", "point": [0.3, 0.0]}},
            "initial": initial,
            "solver": {"duration": 8.0, "samples": 2},
        }
    )  # fmt: skip


def test_statics_and_modes_begin_where_the_run_ended() -> None:
    """Not at the angles beside `from`, from which the arm falls to the other side."""
    turn, weight, inertia = 2.0, 9.81 * 0.3, 0.01 + 0.3**2
    end = end_of(leaning({"arm": {"angle": np.pi / 2 + turn}}), 8.0)
    scene = leaning({"arm": {"angle": np.pi / 2 - turn}}).with_values({"initial.from": end})
    lean = brentq(lambda a: weight * np.sin(a) - a, 1.0, 3.0)
    rest = statics(scene)
    assert rest.ok, rest.message
    assert rest.marker("middle") == pytest.approx(0.3 * np.array([-np.sin(lean), np.cos(lean)]), abs=1e-7)
    assert rest.angle("middle") == pytest.approx(np.pi / 2 + lean, abs=1e-7)
    for about in ("start", "equilibrium"):
        (mode,) = modes(scene, about=about).modes
        assert mode.angular_frequency**2 == pytest.approx((1.0 - weight * np.cos(lean)) / inertia, rel=1e-6)


def test_modes_about_a_start_at_rest_are_those_of_the_place_of_rest() -> None:
    scene = leaning({"from": "statics", "arm": {"angle": 0.3}})
    (start,), (rest,) = (modes(scene, about=about).modes for about in ("start", "equilibrium"))
    assert start.eigenvalue == pytest.approx(rest.eigenvalue, rel=1e-9)
