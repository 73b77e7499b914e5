"""Studies that are kept as files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from shoal.cli import main

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
