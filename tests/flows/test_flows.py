"""Flows on a server of their own, and what they leave in MLflow."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from shoal import library, simulate
from shoal.cli import main
from shoal.errors import InputError
from shoal.shelf import shelf
from shoal_flows import run
from shoal_flows.rerun import rerun
from shoal_flows.results import Compared
from shoal_flows.terminal import show
from shoal_flows.tracking.record import LOCAL


@pytest.fixture(scope="module")
def study() -> Any:
    """One identification by two methods."""
    parameters = {"problem": "paper-case-1", "methods": "least-squares,iafsa-unseeded", "seeds": "[0]"}
    return run.run_flow("identify", parameters)


def _client() -> Any:
    from mlflow import MlflowClient

    return MlflowClient()


def _children(parent: str) -> list[Any]:
    client = _client()
    experiment = client.get_run(parent).info.experiment_id
    found = client.search_runs([experiment], f"tags.`mlflow.parentRunId` = '{parent}'")
    return list(found)


def test_a_study_is_a_parent_run_with_a_child_per_method(study: Any) -> None:
    assert study.trusted
    children = {child.data.params["method"]: child for child in _children(study.run_id)}
    assert set(children) == {"least-squares", "iafsa-unseeded"}
    assert all(child.info.status == "FINISHED" for child in children.values())
    metrics = children["least-squares"].data.metrics
    assert metrics["final/theta1"] == pytest.approx(0.785398, abs=1e-3)
    assert metrics["final/evaluations"] <= 30
    assert abs(metrics["error/theta1"]) < 1e-3


def test_fitness_and_trajectory_are_series(study: Any) -> None:
    (swarm,) = [c for c in _children(study.run_id) if c.data.params["method"] == "iafsa-unseeded"]
    best = [m.value for m in _client().get_metric_history(swarm.info.run_id, "fitness/best")]
    assert len(best) == swarm.data.metrics["final/evaluations"] / 40 <= 101
    assert best == sorted(best, reverse=True)
    tip = _client().get_metric_history(swarm.info.run_id, "tip/x")
    assert 50 <= len(tip) <= 300
    assert max(m.step for m in tip) == 500


def test_artifacts_hold_the_full_trajectory_and_pictures(study: Any) -> None:
    (child,) = [c for c in _children(study.run_id) if c.data.params["method"] == "least-squares"]
    names = {Path(item.path).name for item in _client().list_artifacts(child.info.run_id)}
    assert any(name.endswith((".csv", ".parquet")) for name in names)
    assert any(name.endswith(".png") for name in names)
    assert "report.html" in names
    of_study = {Path(item.path).name for item in _client().list_artifacts(study.run_id)}
    assert {"convergence.png", "residuals.png", "trajectory.png", "report.html", "model"} <= of_study


@pytest.mark.slow
def test_windows_are_held_out_and_the_posterior_is_drawn_on_the_dashboard() -> None:
    """What the command line can do beside the fit, a flow can too; the data are Exudyn's."""
    wishes = {"hold_out": "0.3 to 0.4", "sample": "100", "methods": "least-squares"}
    found = run.run_flow("identify", {"problem": "paper-case-1", **wishes})
    (child,) = _children(found.run_id)
    metrics = child.data.metrics
    held = {name: value for name, value in metrics.items() if name.startswith("held out/recording/0.3 to 0.4 s/")}
    assert len(held) == 4
    for name in ("B.x", "B.y"):
        at = f"held out/recording/0.3 to 0.4 s/{name}"
        assert held[f"{at}/rms"] <= held[f"{at}/limit"]
    assert metrics["posterior/effective"] >= 100
    for name in ("theta1", "theta2"):
        assert metrics[f"posterior/{name}/r_hat"] < 1.05
        inside = metrics[f"posterior/{name}/lower"], metrics[f"posterior/{name}/upper"]
        assert inside[0] < metrics[f"final/{name}"] < inside[1]
    names = {Path(item.path).name for item in _client().list_artifacts(child.info.run_id)}
    assert {"draws.nc", "posterior.png", "prediction.png"} <= names


def test_a_study_says_what_it_found_and_its_best_is_a_model(study: Any) -> None:
    run = _client().get_run(study.run_id)
    assert run.data.tags["verdict"] == "identified"
    assert "| least-squares · seed 0 | theta1 = 0.786015" in run.data.tags["mlflow.note.content"]
    (version,) = _client().search_model_versions(f"run_id = '{study.run_id}'")
    assert version.name == "paper-case-1"
    assert version.tags["champion"] == "passed"
    assert version.tags["second engine"].startswith("exudyn confirms the motion")


def test_an_identification_without_any_answer_is_one_line_and_a_failed_run() -> None:
    with pytest.raises(InputError, match=r"solver\.step: 0\.01 s is beyond") as refusal:
        run.run_flow("identify", {"methods": "least-squares", "set": "{solver.step: 0.01}"})
    assert "\n" not in str(refusal.value)
    experiment = _client().get_experiment_by_name("Identification")
    (latest,) = _client().search_runs([experiment.experiment_id], "tags.kind = 'study'", max_results=1)
    assert latest.info.status == "FAILED"
    assert latest.data.metrics["study/failed"] == 1


def test_the_answer_is_plain_json(study: Any) -> None:
    found = json.loads(json.dumps(study.to_json(), allow_nan=False, default=str))
    assert found["status"] == "ok"


def test_a_result_that_is_not_to_be_trusted_comes_back_as_it_is() -> None:
    """Prefect shows a state of that name; who called the flow gets the result."""
    found = run.run_flow("compare", {"scene": "n-four-bar-2", "engines": "gauss,casadi"})
    assert not found.trusted
    assert list(found.answer.refused) == ["casadi"]


REJECTED = ["scene=single-pendulum", "set={solver.energy_tolerance: 1.0e-18}"]
"""No arithmetic conserves energy so well: the run is rejected, whatever the solver."""


def told(*command: str) -> tuple[int, str, str]:
    found = CliRunner().invoke(main, command)
    return found.exit_code, " ".join(found.stdout.split()), " ".join(found.stderr.split())


def test_a_rejected_motion_is_told_as_the_command_tells_it_and_so_is_its_repetition() -> None:
    """No places, its status and the reason, exit status 3; figures of a rejected run that agree are no good news."""
    status, out, err = told("run", "forward", *(part for one in REJECTED for part in ("--param", one)))
    alone = told("simulate", "single-pendulum", "--set", "solver.energy_tolerance=1e-18")
    assert status == alone[0] == 3
    for said in ("no places are shown, as the run is rejected", "status energy-check-failed"):
        assert said in out
        assert said in alone[1]
    assert "not to be trusted: energy-check-failed: energy is off by" in err
    run_id = out.partition("MLflow run ")[2].partition(";")[0]
    assert _client().get_run(run_id).data.tags["verdict"] == "energy-check-failed"
    status, out, err = told("rerun", run_id)
    assert status == 3
    assert "verdict: energy-check-failed" in out
    assert "the figures agree, but are not to be trusted: energy-check-failed: energy is off by" in err


def test_a_motion_that_is_refused_leaves_a_failed_run() -> None:
    with pytest.raises(InputError, match="casadi") as refusal:
        run.run_flow("forward", {"scene": "n-four-bar-2", "engine": "casadi"})
    experiment = _client().get_experiment_by_name("Forward").experiment_id
    (latest,) = _client().search_runs([experiment], "tags.scene = 'n-four-bar-2'", max_results=1)
    assert (latest.info.status, latest.data.tags["verdict"]) == ("FAILED", "refused")
    assert str(refusal.value) in latest.data.tags["mlflow.note.content"]


def test_a_comparison_tells_the_largest_distance_with_its_marker(comparison: Any, capsys: Any) -> None:
    """Not that of the last marker: a difference at another one would be hidden."""
    motion = comparison.trajectories["gauss"]
    points = motion.points.copy()
    points[:, 0, 0] += 1.0
    moved = replace(comparison, trajectories={"gauss": motion, "casadi": replace(motion, points=points)})
    show(Compared(moved, LOCAL, (b"", b"")))
    assert f"gauss-casadi 1000000.0 µm at {motion.markers[0]}" in capsys.readouterr().out


def test_forward_sweep_and_compare_are_logged() -> None:
    forward = run.run_flow("forward", {"scene": "single-pendulum"})
    sweep = run.run_flow("sweep", {"scene": "single-pendulum", "vary": "{initial.OA.angle: [0, 1, 3]}"})
    compare = run.run_flow("compare", {"scene": "single-pendulum", "engines": "gauss,casadi"})
    for result in (forward, sweep, compare):
        assert result.trusted
        assert _client().get_run(result.run_id).info.status == "FINISHED"
    # A second run says how far the first may be off, as on the command line.
    assert 0 < _client().get_run(forward.run_id).data.metrics["final/time_error"] < 1e-9


def test_a_night_is_a_run_with_a_metric_per_line(capsys: pytest.CaptureFixture[str]) -> None:
    # Not `trusted`: this machine may be busy, and a line then takes longer than it should.
    night = run.run_flow("nightly", {"only": "four-bar-2", "quick": "true"})
    metrics = _client().get_run(night.run_id).data.metrics
    lines = {"/".join(line.key).replace(",", "") for line in night.night.lines if line.error is not None}
    assert lines
    assert {name.partition("/")[2] for name in metrics if name.startswith("error/")} == lines
    assert metrics["lines/passed"] == night.night.counts["passed"]
    names = {item.path for item in _client().list_artifacts(night.run_id)}
    assert {"index.html", "night.json", "call.json"} <= names
    show(night)
    assert f"{night.night.counts['passed']} of {len(lines)} lines passed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("flow", "parameters", "word"),
    [
        ("dance", {}, "dance"),
        ("forward", {"colour": "red"}, "colour"),
        pytest.param(*("forward", {"scene": "nothing"}, "nothing"), marks=pytest.mark.slow),
        ("sweep", {"scene": "single-pendulum", "vary": "{initial.OA.angle: [0, 1]}"}, "vary"),
        pytest.param(
            *("sweep", {"scene": "single-pendulum", "vary": "{initial.OA.angle: [0, 1, 2.5]}"}, "vary"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("sweep", {"scene": "single-pendulum", "vary": "{initial.OA.angle: [0, 1, 0]}"}, "vary"),
            marks=pytest.mark.slow,
        ),
        pytest.param(*("sweep", {"scene": "single-pendulum", "vary": "{}"}, "vary"), marks=pytest.mark.slow),
        pytest.param(*("sweep", {"vary": "7"}, "vary"), marks=pytest.mark.slow),
        ("identify", {"methods": "[guess]"}, "guess"),
        pytest.param(
            *("identify", {"methods": "[afsa, afsa]"}, "methods.* afsa is given twice"), marks=pytest.mark.slow
        ),
        pytest.param(*("identify", {"seeds": "0,1,0"}, "seeds.* 0 is given twice"), marks=pytest.mark.slow),
        pytest.param(*("compare", {"scene": "single-pendulum", "engines": "gauss"}, "engines"), marks=pytest.mark.slow),
        pytest.param(
            *("compare", {"scene": "single-pendulum", "engines": "[gauss, gauss]"}, "two different"),
            marks=pytest.mark.slow,
        ),
        ("export", {"scene": "single-pendulum", "to": "csv,step"}, "to: no form 'step'; there are exudyn, mjcf, fmu"),
        pytest.param(
            *("export", {"scene": "single-pendulum", "to": "csv", "input": "gravity.1"}, "`to` has no fmu"),
            marks=pytest.mark.slow,
        ),
        ("sweep", {"vary": "{gravity.1: [-9, 0, 1]}"}, "one value is not at both ends"),
        pytest.param(
            *("sweep", {"vary": "{gravity.1: [-9, 0, 2], gravity.1: [0, 9, 2]}"}, "the key 'gravity.1' stands twice"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("export", {"scene": "flexible-double-pendulum", "to": "csv,mjcf"}, "MJCF has no ancf-cable"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_bad_parameters_are_refused_in_one_line(flow: str, parameters: dict[str, str], word: str) -> None:
    with pytest.raises(InputError, match=word) as refusal:
        run.run_flow(flow, parameters)
    assert "\n" not in str(refusal.value)


@pytest.mark.slow
def test_a_study_is_repeated_from_its_run_alone(tmp_path: Path) -> None:
    scene = tmp_path / "mine.yaml"
    scene.write_text((files("shoal.scene") / "library" / "single-pendulum.yaml").read_text())
    first = run.run_flow("forward", {"scene": str(scene), "set": "{initial.OA.angle: 0.4}"})
    scene.unlink()
    again = rerun(first.run_id)
    assert again.now != first.run_id
    assert not again.different
    assert again.figures["final/x"][0] == first.answer.marker(first.answer.markers[-1])[-1, 0]
    assert len(again.figures) >= 5
    # As if the first had found something else.
    _client().log_metric(first.run_id, "final/x", 0.0)
    assert set(rerun(first.run_id).different) == {"final/x"}


@pytest.mark.slow
def test_what_is_taken_from_the_library_is_kept_with_the_run(tmp_path: Path) -> None:
    """The problem, the scene that it names, and the recording: the library may change and be emptied."""
    machine = yaml.safe_load((files("shoal.scene") / "library" / "single-pendulum.yaml").read_text())
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(machine))
    library.add(tmp_path / "arm.yaml")
    motion = simulate("arm", np.linspace(0.0, 0.5, 11), set={"initial.OA.angle": 0.3}, verify=False)
    rows = np.column_stack([motion.times, *motion.marker("A").T])
    (tmp_path / "swing.csv").write_text("t,x,y\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()) + "\n")
    library.add(tmp_path / "swing.csv")
    problem = {
        "name": "start of the arm",
        "scene": "arm",
        "parameters": {"theta": {"path": "initial.OA.angle", "lower": -1.5, "upper": 1.5}},
        "channels": [{"marker": "A", "quantity": axis, "column": axis} for axis in ("x", "y")],
        "source": {"kind": "file"},
    }
    (tmp_path / "start.yaml").write_text(yaml.safe_dump(problem))
    library.add(tmp_path / "start.yaml")
    found = run.run_flow("identify", {"problem": "start", "methods": "least-squares", "data": "swing"})
    assert found.fits[0].estimate.parameters["theta"].value == pytest.approx(0.3, abs=1e-9)
    tags = _client().get_run(found.run_id).data.tags
    assert (tags["problem"], tags["mlflow.runName"]) == ("start of the arm", "start of the arm · identify")
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump({**machine, "gravity": [0.0, -1.62]}))
    library.add(tmp_path / "arm.yaml")
    for entry in library.entries():
        shelf().remove(entry.kind, entry.name)
    again = rerun(found.run_id)
    assert not again.different
    assert len(again.figures) > 5


@pytest.mark.slow
def test_a_scene_may_be_given_as_yaml() -> None:
    text = (files("shoal.scene") / "library" / "single-pendulum.yaml").read_text()
    found = run.run_flow("forward", {"scene": json.dumps(text)})
    assert found.trusted
    from prefect.client.orchestration import get_client

    with get_client(sync_client=True) as client:
        assert "forward single-pendulum" in {one.name for one in client.read_flow_runs()}
    assert {"scene.yaml", "call.json", "inputs"} <= {item.path for item in _client().list_artifacts(found.run_id)}
    with pytest.raises(InputError, match=r"^scene: bodies\.OA\.mass: .* found -1"):
        run.run_flow("forward", {"scene": json.dumps(text.replace("mass: 1.0", "mass: -1.0"))})
    with get_client(sync_client=True) as client:
        messages = {one.state.message for one in client.read_flow_runs() if one.state and one.state.is_failed()}
    assert any("InputError: scene: bodies.OA.mass: " in str(message) for message in messages), messages


def test_exports_are_artifacts_of_their_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a machine in space, byte for byte what the commands write."""
    monkeypatch.chdir(tmp_path)
    short = {"set": "{solver.duration: 0.2}"}
    found = run.run_flow("export", {"scene": "spherical-pendulum", "to": "exudyn,csv,nc,fmu", **short})
    assert found.trusted
    (tmp_path / "kept").mkdir()
    _client().download_artifacts(found.run_id, "export", str(tmp_path / "kept"))
    kept = {file.name: file for file in (tmp_path / "kept" / "export").iterdir()}
    assert {*kept} == {f"spherical-pendulum.{ending}" for ending in ("py", "csv", "nc")} | {"spherical_pendulum.fmu"}
    spherical = ["spherical-pendulum", "--set", "solver.duration=0.2"]
    for command in (["export", "--to", "exudyn"], ["simulate", "--out", "spherical-pendulum.csv"]):
        assert CliRunner().invoke(main, [command[0], *spherical, *command[1:]]).exit_code == 0
    for name in ("spherical-pendulum.py", "spherical-pendulum.csv"):
        assert kept[name].read_bytes() == (tmp_path / name).read_bytes()
    metrics = _client().get_run(found.run_id).data.metrics
    last = simulate("spherical-pendulum", set={"solver.duration": 0.2}).marker("A")[-1]
    np.testing.assert_allclose([metrics[f"final/{axis}"] for axis in "xyz"], last, atol=1e-12)
    assert 0 < metrics["final/distance/exudyn"] < 1e-3
    description = zipfile.ZipFile(kept["spherical_pendulum.fmu"]).read("modelDescription.xml").decode()
    assert 'name="gravity.2"' in description
    assert not rerun(found.run_id).different


def test_machines_in_space_are_logged_with_all_their_coordinates() -> None:
    """A pendulum at rest hangs below; engines and motions have three components."""
    short, still = "{solver.duration: 0.1}", "{initial.A.position: [0.6, 0, -0.8], initial.A.velocity: [0, 0, 0]}"
    compared = run.run_flow("compare", {"scene": "spherical-pendulum", "engines": "gauss,exudyn", "set": short})
    assert compared.trusted
    tips = [_client().get_metric_history(child.info.run_id, "tip/z") for child in _children(compared.run_id)]
    assert [len(tip) > 5 for tip in tips] == [True, True]
    rest = run.run_flow("statics", {"scene": "spherical-pendulum", "set": still})
    metrics = _client().get_run(rest.run_id).data.metrics
    np.testing.assert_allclose([metrics[f"final/A/{axis}"] for axis in "xyz"], [0.0, 0.0, -1.0], atol=1e-9)


def test_a_place_of_rest_within_a_tolerance_has_its_error() -> None:
    """The mesh of the strip is refined until the error at its end is told and small."""
    asked = {"scene": "swinging-strip", "tolerance": "5e-3", "set": "{bodies.strip.elements: 2}"}
    metrics = _client().get_run(run.run_flow("statics", asked).run_id).data.metrics
    assert 0.0 < metrics["final/mesh_error"] <= 2.5e-3


def strip() -> str:
    """YAML of the swinging strip with few elements, for a moment."""
    machine = yaml.safe_load((files("shoal.scene") / "library" / "swinging-strip.yaml").read_text())
    machine["bodies"]["strip"]["elements"] = 2
    machine["solver"]["duration"] = 0.01
    return json.dumps(yaml.safe_dump(machine))


def modal() -> str:
    """YAML of a slider-crank with a modal rod, a loop and a drive that was recorded."""
    machine = yaml.safe_load((files("shoal.scene") / "library" / "flexible-slider-crank.yaml").read_text())
    table = [[t, 150 * t] for t in np.linspace(0.0, 0.02, 21).tolist()]
    machine["joints"]["drive"]["angle"] = {"table": table, "smooth": True}
    machine["solver"] |= {"duration": 0.01, "relative_tolerance": 1e-8, "absolute_tolerance": 1e-8}
    return json.dumps(yaml.safe_dump(machine))


PASSED: list[tuple[str, dict[str, str], set[str]]] = [
    ("forward", {}, {"trajectory.csv", "scene.yaml", "motion.html", "poses.png", "paths.png"}),
    ("select", {"tolerance": "1e-3"}, {"trajectory.csv", "ladder.png", "motion.html", "poses.png"}),
    ("statics", {}, {"equilibrium.json", "rest.png"}),
    ("compare", {}, {"engines.png", "differences.json"}),
    ("sweep", {"vary": "{gravity.1: [-1, 0, 2]}", "time": "0.01"}, {"sweep.csv"}),
    ("export", {"to": "csv"}, {"export", "trajectory.csv"}),
]
"""Flows, what they are asked, and what they keep."""


@pytest.mark.parametrize(
    ("scene", "axes", "flow", "asked", "artifacts"),
    [
        # By day the strip passes through all but the sweep, whose lanes take a loop of their own, and the modal rod
        # through that.
        pytest.param(scene, axes, *passed, marks=[pytest.mark.slow] * ((scene is strip) == (passed[0] == "sweep")))
        for scene, axes in ((strip, "xyz"), (modal, "xy"))
        for passed in PASSED
    ],
)
@pytest.mark.by_day(2)
def test_unusual_machines_pass_through_every_flow(
    scene: Callable[[], str],
    axes: str,
    flow: str,
    asked: dict[str, str],
    artifacts: set[str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Told with every coordinate, on the terminal too; who has nothing to compare with hears why."""
    found = run.run_flow(flow, {"scene": scene(), **asked})
    assert found.trusted == (flow != "compare")
    show(found)
    told = capsys.readouterr().out
    if flow == "compare":
        assert ("only gauss ran: name exudyn-ge too" if scene is strip else "no other engine can run") in told
    json.dumps(found.to_json(), allow_nan=False, default=str)
    assert artifacts <= {item.path for item in _client().list_artifacts(found.run_id)}
    metrics = (
        _client().get_run(_children(found.run_id)[0].info.run_id if flow == "compare" else found.run_id).data.metrics
    )
    if flow != "sweep":
        assert axes == "".join(axis for axis in "xyz" if any(name.endswith(f"/{axis}") for name in metrics))


STUDY = """
uncertain: {scene: single-pendulum, vary: {initial.OA.angle: "-0.1:0.1"}, at: [0.5], limit: A.y > 0.5, verify: false}
"""


@pytest.mark.slow
def test_what_else_there_is_of_a_machine_is_logged() -> None:
    """The cheapest model within a tolerance, its place of rest, a design of a measurement; each can be repeated."""
    duration = "{solver.duration: 0.1}"
    asked = {
        "select": {"scene": "flexible-double-pendulum", "tolerance": "1e-3", "set": duration},
        "statics": {"scene": "rigid-double-pendulum"},
        "design": {"problem": "paper-case-1", "about": "start", "noise": "1e-3"},
        "uncertain": {"study": json.dumps(STUDY)},
    }
    for flow, parameters in asked.items():
        found = run.run_flow(flow, parameters)
        assert found.trusted
        assert found.to_json()["run_id"] == found.run_id
        there = _client().get_run(found.run_id)
        assert (there.info.status, there.data.tags["kind"]) == ("FINISHED", {"select": "selection"}.get(flow, flow))
        assert not rerun(found.run_id).different
    with pytest.raises(InputError, match="theta3"):
        run.run_flow("design", {**asked["design"], "parameter": "theta3"})


@pytest.mark.slow
def test_forms_follow_the_library(tmp_path: Path, study: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a server that runs: names come and go with `shoal library`, and nothing else of the form changes."""
    from prefect.client.orchestration import get_client
    from prefect.utilities.callables import parameter_schema
    from shoal_flows import choices
    from shoal_flows.flows import FLOWS

    monkeypatch.setattr(choices, "SECONDS", 60.0)  # a busy machine's server is slow
    before = parameter_schema(FLOWS["forward"])
    with get_client(sync_client=True) as client:
        flow = client.create_flow_from_name("forward")
        made = client.create_deployment(flow, "form", parameter_openapi_schema=before.model_dump_for_openapi())

        def offered() -> list[str]:
            properties = client.read_deployment(made).parameter_openapi_schema["properties"]
            found: list[str] = properties["scene"]["anyOf"][1].pop("enum")
            kept = before.model_dump_for_openapi()["properties"]
            del kept["scene"]["anyOf"][1]["enum"]
            assert properties == kept
            return found

        (tmp_path / "lever.yaml").write_text((files("shoal.scene") / "library" / "single-pendulum.yaml").read_text())
        for command in (["add", str(tmp_path / "lever.yaml")], ["remove", "lever"]):
            assert CliRunner().invoke(main, ["library", *command]).exit_code == 0
            assert ("lever" in offered()) == (command[0] == "add")


@pytest.mark.slow
def test_an_identification_is_repeated_with_all_its_figures(study: Any) -> None:
    again = rerun(study.run_id)
    assert not again.different
    assert any(name.endswith("final/theta1") for name in again.figures)
