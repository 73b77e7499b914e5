"""`shoal export`: files of other tools, compared before they are written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.fmu.running import identifier
from shoal.requests.fmu import Fmu
from shoal.scene import load_scene
from shoal.scene.edited import as_yaml
from shoal_flows.exports import exported


def test_an_exported_script_is_compared_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("exudyn")
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["export", "single-pendulum", "--to", "exudyn", "--set", "solver.duration=0.2"])
    assert done.exit_code == 0, done.output
    assert done.stdout == "single-pendulum.py\n"
    told, distance = done.stderr.split("within ")
    assert told.startswith("exudyn: its motion is ")
    assert 0 < float(distance.split()[0]) < 1e-5
    assert "endTime = 0.2" in (tmp_path / "single-pendulum.py").read_text()


def test_an_exported_machine_is_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["export", "andrews-squeezer", "--to", "mjcf"])
    assert done.exit_code == 0, done.output
    assert done.stdout == "andrews-squeezer.xml\n"
    assert re.fullmatch(r"mjcf: its motion is within \S+e-09 m of `shoal simulate`\n", done.stderr)
    back = CliRunner().invoke(main, ["import", "andrews-squeezer.xml"])
    assert back.exit_code == 0, back.output
    assert [line for line in back.stderr.splitlines() if line.startswith("left out: ")] == [
        "left out: geoms: 15 that are only seen",
        "left out: <option>: integrator, iterations, timestep, tolerance (from line 4)",
        "left out: <flag>: energy (from line 5)",
        "left out: <connect>: 3 x solimp, 3 x solref (from line 71)",
    ]


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        ("single-pendulum --to exudyn --out x.xml", 2, "out: x.xml ends in .xml; exudyn has .py"),
        ("single-pendulum --to adams", 2, "--to: needs one of exudyn, mjcf, found 'adams'"),
        ("flexible-double-pendulum --to exudyn --set bodies.AB.element=ancf-full", 2,
         "bodies.AB.element: engine exudyn cannot do ancf-full$"),
        ("flexible-double-pendulum --to mjcf", 2, "bodies.OA.element: MJCF has no ancf-cable; rigid bodies only$"),
        ("parallelogram --to exudyn --set solver.step=1e-2 --set solver.duration=4", 3,
         "parallelogram: exudyn: .*--no-verify writes the file all the same"),
    ],
)  # fmt: skip
def test_what_is_not_exported(
    arguments: str, status: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("exudyn")
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["export", *arguments.split()])

    assert done.exit_code == status, done.output
    assert re.search(message, done.stderr.strip()), done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("../../evil", "evil"),
        ("/a/b c", "a-b-c"),
        ("..", "scene"),
        ("Greifer \u00fc2.1", "Greifer-\u00fc2.1"),
        ("n" * 300, "n" * 50),
    ],
)
def test_files_that_are_called_after_a_scene_stay_in_the_folder(
    name: str, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the command, by the flow and as a unit; a name is any text."""
    pytest.importorskip("mujoco")
    below = tmp_path / "one" / "two"
    below.mkdir(parents=True)
    monkeypatch.chdir(below)
    scene = load_scene("single-pendulum").model_copy(update={"name": name})
    Path("s.yaml").write_text(as_yaml(scene.model_dump(mode="json", exclude_unset=True)), encoding="utf-8")
    done = CliRunner().invoke(main, ["export", "s.yaml", "--to", "mjcf", "--no-verify"])
    assert (done.exit_code, done.stdout) == (0, f"{file}.xml\n"), done.output
    found = exported(Fmu("s.yaml", set={"solver.duration": 0.01}), ["mjcf", "csv"], verify=False)
    assert {*found.files} == {f"{file}.xml", f"{file}.csv"}
    assert re.fullmatch(r"[A-Za-z_]\w{0,50}", identifier(scene), re.ASCII)
    assert {path.name for path in tmp_path.rglob("*") if path.is_file()} == {"s.yaml", f"{file}.xml"}
