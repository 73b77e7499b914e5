"""The command line: what it prints, and with which exit status it leaves."""

import json
import math
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from shoal.cli import main
from shoal.engines.compare import compared
from shoal.scene import Scene, load_scene


def shoal(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments))


def answer(*arguments: str) -> dict[str, object]:
    """The one JSON object a command prints on standard output."""
    result = shoal(*arguments, "--json")
    assert result.exit_code == 0, result.stderr
    found: dict[str, object] = json.loads(result.stdout)
    return found


def test_simulate_prints_the_contract() -> None:
    found = answer("simulate", "flexible-double-pendulum", "--at", "0.25,0.5")
    assert found["status"] == "ok"
    assert found["engine"] == "gauss"
    markers = found["markers"]
    assert isinstance(markers, dict)
    assert markers["B"]["t"] == [0.25, 0.5]
    # CasADi's time-converged tip on this mesh; leapfrog at 5e-4 s is 6e-6 m away.
    assert found["final"]["B"] == pytest.approx([2.6761612551, 0.5786753311], abs=1e-5)  # type: ignore[index]
    assert {"energy_drift", "constraint_drift", "steps", "wall_s", "model"} <= set(found)


def test_identify_prints_the_contract() -> None:
    found = answer("identify", "paper-case-1", "--method", "least-squares")
    assert found["verdict"] == "identified"
    theta1 = found["parameters"]["theta1"]  # type: ignore[index]
    assert {"value", "std", "lower", "upper", "identifiable"} <= set(theta1)
    assert theta1["value"] == pytest.approx(0.785398, abs=1e-3)
    assert {"status", "method", "fitness", "rms", "evaluations", "wall_s"} <= set(found)


def test_sweep_table_and_csv(tmp_path: Path) -> None:
    out = tmp_path / "figure4.csv"
    found = answer("sweep", "flexible-double-pendulum", "--vary", "initial.OA.angle=0:1.5:4", "--out", str(out))
    rows = found["rows"]
    assert isinstance(rows, list)
    assert [row["initial.OA.angle"] for row in rows] == [0.0, 0.5, 1.0, 1.5]
    assert len(out.read_text().splitlines()) == 5


def test_compare_shows_three_engines_close_together() -> None:
    found = answer("compare", "single-pendulum", "--at", "0.5,1")
    assert set(found["engines"]) == {"gauss", "exudyn", "casadi"}  # type: ignore[call-overload]
    assert all(row["largest"] < 1e-5 for row in found["differences"])  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("scene", "engines"),
    [
        ("single-pendulum", ["gauss", "exudyn", "casadi"]),
        ("parallelogram", ["gauss", "exudyn"]),
        ("rigid-double-pendulum", ["gauss", "exudyn", "casadi"]),
        (load_scene("rigid-double-pendulum").with_values({"dimensions": 3}), ["gauss", "exudyn", "tree"]),
        ("bricard", ["gauss", "exudyn"]),
    ],
)
def test_engines_that_cannot_run_a_scene_are_not_compared_unless_named(scene: str | Scene, engines: list[str]) -> None:
    assert compared(load_scene(scene) if isinstance(scene, str) else scene) == engines


def test_a_scene_and_a_problem_of_one_name_are_both_printed() -> None:
    scene, problem = shoal("scenes", "ibm-double-pendulum"), shoal("problems", "ibm-double-pendulum")
    assert "bodies:" in scene.stdout
    assert "shoal problems ibm-double-pendulum" in scene.stderr
    assert "parameters:" in problem.stdout
    assert shoal("scenes", "paper-case-1").stdout == shoal("problems", "paper-case-1").stdout
    assert "kaheman-double" in shoal("problems").stdout


def test_lists_mappings_and_nothing_can_be_set() -> None:
    fields = ("gravity=[0, 0]", "initial.OA={angle: 0.6}", "solver.max_step=null")
    options = [part for field in fields for part in ("--set", field)]
    found = answer("simulate", "single-pendulum", "--no-verify", *options)
    assert found["final"]["A"] == pytest.approx([math.cos(0.6), math.sin(0.6)], abs=1e-12)  # type: ignore[index]


def test_a_planar_scene_moves_as_well_in_space() -> None:
    flat = answer("simulate", "single-pendulum", "--no-verify", "--at", "0.3")["final"]["A"]  # type: ignore[index]
    found = answer("simulate", "single-pendulum", "--no-verify", "--at", "0.3", "--set", "dimensions=3")
    assert found["final"]["A"] == pytest.approx([*flat, 0.0], abs=1e-9)  # type: ignore[index]


def test_scenes_lists_and_prints() -> None:
    assert "flexible-double-pendulum" in shoal("scenes").stdout
    assert shoal("scenes", "single-pendulum").stdout.startswith("name: single-pendulum")


def test_a_printed_scene_can_be_simulated_again(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(shoal("scenes", "rigid-double-pendulum").stdout)
    assert answer("simulate", str(path))["status"] == "ok"


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["simulate", "nothing"], "nothing"),
        (["simulate", "nothing.yaml"], "nothing.yaml"),
        (["simulate", "single-pendulum", "--set", "bodies.OA.mass=-1"], "bodies.OA.mass"),
        (["simulate", "single-pendulum", "--set", "bodies.OA.mass"], "PATH=VALUE"),
        (["simulate", "single-pendulum", "--set", "dimensions=4"], "dimensions: Input should be 2 or 3, found '4'"),
        (["simulate", "single-pendulum", "--set", "dimensions=[3]"], "dimensions: Input should be 2 or 3"),
        (["simulate", "single-pendulum", "--at", "0.2,0.1"], "increase"),
        (["simulate", "single-pendulum", "--at", "soon"], "soon"),
        (["simulate", "single-pendulum", "--engine", "magic"], "magic"),
        (["simulate", "flexible-double-pendulum", "--set", "solver.step=1e-3"], "6.635e-04"),
        (["simulate", "single-pendulum", "--out", "here.doc"], "here.doc"),
        (["simulate", "single-pendulum", "--out", "/no/such/folder/a.csv"], "folder"),
        (["sweep", "single-pendulum", "--vary", "initial.OA.angle=0:1"], "LOW:HIGH:COUNT"),
        (["sweep", "single-pendulum", "--vary", "initial.OA.colour=0:1:3"], "colour"),
        (["sweep", "single-pendulum", "--vary", "bodies.OA.mass=1:2:2", "--vary", "bodies.OA.mass=3:4:2"],
         "bodies.OA.mass is given twice, as 1:2:2 and as 3:4:2"),
        (["sweep", "single-pendulum", "--vary", "bodies.OA.mass=1:2:2", "--set", "bodies.OA.mass=3"],
         "bodies.OA.mass: is set to '3' and varied as well"),
        (["sweep", "single-pendulum", "--vary", "bodies.OA.mass=1:2:1"], "1:2:1: one value is not at both ends"),
        (["simulate", "single-pendulum", "--set", "bodies.OA.mass=1", "--set", "bodies.OA.mass=2"],
         "bodies.OA.mass is given twice, as 1 and as 2"),
        (["simulate", "single-pendulum", "--at", "0.1", "--at", "0.2"], "--at: is given 2 times"),
        (["sweep", "single-pendulum", "--vary", "bodies.OA.mass=1:2:2", "--at", "1", "--at", "2"], "is given 2 times"),
        (["run", "sweep", "--param", "engine=gauss", "--param", "engine=exudyn"], "engine is given twice"),
        (["run", "sweep", "--param", "scene="], "'scene=' is not K=V; there is nothing after the ="),
        (["uncertain", "single-pendulum", "--vary", "gravity.0=1:2", *("--cost", "a=1") * 2], "cost: a is given twice"),
        (["uncertain", "single-pendulum", "--vary", "gravity.0=1:2", "--correlate", "a,b=0", "--correlate", "b,a=1"],
         "correlate: b, a: is given twice"),
        (["simulate", f"{'a' * 300}.yaml"], "aaa.yaml: File name too long"),
        (["import", f"{'a' * 300}.xml"], "aaa.xml: File name too long"),
        (["simulate", "-"], "-: a scene is read from a file whose name ends in .yaml; save it as one"),
        (["simulate", "/dev/null"], "/dev/null: a scene is read from a file whose name ends in .yaml"),
        (["identify", "/dev/null"], "/dev/null: a problem is read from a file whose name ends in .yaml"),
        (["simulate", "single-pendulum", "--out", f"{'a' * 300}.csv"], "File name too long"),
        (["compare", "single-pendulum", "--engines", "gauss,magic"], "magic"),
        (["identify", "paper-case-1", "--method", "magic"], "magic"),
        (["identify", "kaheman-double"], "--data"),
        (["identify", "kaheman-double", "--data", "nowhere.csv"], "nowhere.csv"),
        (["scenes", "nothing"], "nothing"),
        (["scenes", "singel-pendulum"], "did you mean single-pendulum"),
        (["problems", "kaheman"], "did you mean kaheman-single or kaheman-double"),
        (["simulate", "rigid-pendulum"], "rigid-double-pendulum"),
        (["simulate", "single-pendulum", "--set", "gravity=[0"], "gravity: '[0' is neither a list"),
        (["simulate", "single-pendulum", "--set", "gravity=[0]"], "gravity"),
        (["simulate", "single-pendulum", "--set", "bodies.OA.mass=[1]"], "bodies.OA.mass"),
        (["simulate"], "SCENE"),
        (["dance"], "dance"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line_and_status_two(arguments: list[str], word: str) -> None:
    result = shoal(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert word in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_an_answer_that_cannot_be_trusted_has_status_three() -> None:
    result = shoal("simulate", "single-pendulum", "--set", "solver.energy_tolerance=1e-30", "--json")
    assert result.exit_code == 3
    assert json.loads(result.stdout)["status"] == "energy-check-failed"


def test_doctor_finds_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    # A flow that a test has run before leaves the address of a server of its own, which has no nights.
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    found = answer("doctor")
    assert found["status"] == "ok"
