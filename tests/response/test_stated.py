"""Studies that are kept as files."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from shoal import library
from shoal.cli import main
from shoal.errors import InputError
from shoal.response import uncertain
from shoal.response.stated import built_in_studies, load_study

STUDY = """
description: A pendulum that must not rise.
uncertain:
  scene: single-pendulum
  vary: {initial.OA.angle: "-1.3:-1.2", bodies.OA.mass: "-1%:1%"}
  set: {gravity: [0.0, -9.0]}
  limit: A.y > -0.95
  at: [0.5, 1.0]
  verify: false
  seed: 3
"""


def run(*words: str) -> Result:
    return CliRunner().invoke(main, ["uncertain", *words, "--json"])


def test_a_file_says_what_options_say(tmp_path: Path) -> None:
    """The same answer; what stands on the command line comes before what stands in the file."""
    (tmp_path / "study.yaml").write_text(STUDY)
    kept = run(str(tmp_path / "study.yaml"))
    assert kept.exit_code == 0, kept.output
    words = ["--vary", "initial.OA.angle=-1.3:-1.2", "--vary", "bodies.OA.mass=-1%:1%", "--set", "gravity=[0.0, -9.0]"]
    words += ["--limit", "A.y > -0.95", "--at", "0.5,1.0", "--no-verify", "--seed", "3"]
    stated = run("single-pendulum", *words)
    one, other = json.loads(kept.stdout), json.loads(stated.stdout)
    assert one["limits"]
    assert one["bounds"] == other["bounds"]
    assert {**one, "wall_s": 0} == {**other, "wall_s": 0}
    changed = json.loads(run(str(tmp_path / "study.yaml"), "--at", "0.25", "--seed", "4").stdout)
    assert changed["bounds"]["A"]["x"]["t"] == [0.25]
    assert changed["seed"] == 4


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("uncertain: {scene: single-pendulum, vari: {}}", "no field 'vari'"),
        ("uncertain: {vary: {}}", "name of a scene"),
        ("uncertain: {scene: single-pendulum}\nbodies: {}", "bodies does not belong"),
        ("uncertain: {scene: single-pendulum, vary: {bodies.OA.mass: '1:2'}, seed: many}", "many"),
        ("uncertain: {scene: single-pendulum}", "--vary"),
    ],
)
def test_wrong_files_are_named(text: str, names: str, tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text(text)
    found = run(str(tmp_path / "study.yaml"))
    assert found.exit_code == 2
    assert names in found.output


def test_a_file_is_read_the_same_way_without_the_command(tmp_path: Path) -> None:
    """As flows do: the answer is that of the command."""
    (tmp_path / "study.yaml").write_text(STUDY)
    told = json.loads(run(str(tmp_path / "study.yaml")).stdout)
    study = load_study(str(tmp_path / "study.yaml"))
    found = uncertain(study, study.machine()).to_json()
    assert {**found, "wall_s": 0} == {**told, "wall_s": 0}
    assert "pendulum-tolerances" in built_in_studies()
    assert load_study("pendulum-tolerances").machine().name == "flexible-double-pendulum"
    with pytest.raises(InputError, match="study: nowhere"):
        load_study("nowhere")


def test_a_study_is_kept_with_its_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the library, under a name that the command takes; a wrong one is refused."""
    monkeypatch.setenv("SHOAL_LIBRARY", str(tmp_path / "library"))
    (tmp_path / "study.yaml").write_text(STUDY.replace("single-pendulum", "arm.yaml"))
    (tmp_path / "arm.yaml").write_text((files("shoal.scene") / "library" / "single-pendulum.yaml").read_text())
    kept = library.add(tmp_path / "study.yaml", "rise")
    assert (kept.kind, set(kept.files())) == ("studies", {"rise.yaml", "arm.yaml"})
    one, other = (json.loads(run(name).stdout) for name in ("rise", str(tmp_path / "study.yaml")))
    assert {**one, "wall_s": 0} == {**other, "wall_s": 0}
    (tmp_path / "wrong.yaml").write_text(STUDY.replace("A.y", "Q.y"))
    with pytest.raises(InputError, match="no marker 'Q'"):
        library.add(tmp_path / "wrong.yaml")
