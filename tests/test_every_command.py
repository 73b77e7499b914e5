"""Every command on machines drawn at random: an answer, or a refusal that names a field that the scene states."""

from __future__ import annotations

import contextlib
import io
import json
import re
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import random_scenes
import yaml
from shoal.cli import main

PATH = re.compile(r"\b(?:bodies|joints|loads|markers|initial|ground_points|gravity|solver|dimensions)(?:\.[\w-]+)*")
FAST, ALL = (13,), range(40)
"""Planar machines of cables, rigid bodies and point masses, whose kernels are compiled beforehand; and of all kinds."""


class Said(NamedTuple):
    status: int
    out: str
    err: str


def run(*words: str) -> Said:
    """Run the program in this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as left:
        main(list(words))
    return Said(int(left.value.code or 0), out.getvalue(), err.getvalue())


def commands(scene: dict[str, Any], folder: Path) -> dict[str, list[str]]:
    """Return the words of every command for a scene, which is written to a folder."""
    file, table, problem = folder / "scene.yaml", folder / "motion.csv", folder / "problem.yaml"
    file.write_text(yaml.safe_dump(scene, sort_keys=False))
    first, body = next(iter(scene["bodies"].items()))
    field = "density" if body["kind"] == "rod" else "mass"
    path, value = f"bodies.{first}.{field}", body[field]
    axes = "xyz"[: scene["dimensions"]]
    stated = {
        "name": "problem",
        "scene": str(file),
        "parameters": {"p": {"path": path, "lower": 0.5 * value, "upper": 2.0 * value}},
        "channels": [{"marker": "tip", "quantity": x, "column": f"tip.{x}", "noise": 1e-4} for x in axes],
        "source": {"kind": "file", "path": str(table)},
    }
    problem.write_text(yaml.safe_dump(stated, sort_keys=False))
    # A start at rest takes each run a tenth of a second, and what varies by round-off only takes as many as there are.
    name, few = str(file), ("--runs", "300")
    return {
        "simulate": ["simulate", name, "--json"],
        "table": ["simulate", name, "--out", str(table)],
        "page": ["simulate", name, "--out", str(folder / "motion.html")],
        "tolerance": ["simulate", name, "--tolerance", "1e-2", "--json"],
        "statics": ["statics", name, "--json"],
        "modes": ["modes", name, "--count", "2", "--json"],
        "modes about the start": ["modes", name, "--count", "2", "--about", "start", "--json"],
        "reactions": ["reactions", name, "--at", "0,0.05", "--json"],
        "sweep": ["sweep", name, "--vary", f"{path}={0.9 * value}:{1.1 * value}:3", "--json"],
        "bounds": ["uncertain", name, "--vary", f"{path}=-2%:2%", "--limit", "tip.y < 5", *few, "--json"],
        "statistics": ["uncertain", name, "--vary", f"{path}~normal({value},{0.01 * value})", *few, "--json"],
        "compare": ["compare", name, "--json"],
        "export to Exudyn": ["export", name, "--to", "exudyn", "--out", str(folder / "machine.py")],
        "export to MuJoCo": ["export", name, "--to", "mjcf", "--out", str(folder / "machine.xml")],
        "export as FMU": ["export-fmu", name, "--out", str(folder / "machine.fmu")],
        "identify": ["identify", str(problem), "--json", "--time-limit", "100"],
        "design": ["design", str(problem), "--about", "start", "--json"],
    }


def is_stated(path: str, scene: Any) -> bool:
    """Return whether a scene states what holds the field of a path, so that its user knows it."""
    for part in path.split(".")[:-1]:
        if not isinstance(scene, dict) or part not in scene:
            return False
        scene = scene[part]
    return True


def fault(said: Said, scene: dict[str, Any], with_json: bool) -> str:
    """Return what is wrong with what a command did; empty if nothing is."""
    if "Traceback" in said.err or said.status not in (0, 2, 3):
        return f"exit status {said.status}: {said.err[-2000:]}"
    if said.status == 0:
        return "" if not with_json or json.loads(said.out) else "no JSON"
    lines = [line for line in said.err.splitlines() if line.startswith("shoal: ")]
    if not lines:
        return f"no line says why: {said.err[-500:]}"
    unknown = [path for path in PATH.findall(lines[-1]) if not is_stated(path, scene)]
    return f"names what nobody stated: {lines[-1]}" if said.status == 2 and unknown else ""


@pytest.mark.parametrize(
    "seed", [*FAST, *(pytest.param(seed, marks=pytest.mark.slow) for seed in ALL if seed not in FAST)]
)
def test_every_command_answers_or_names_a_stated_field(seed: int, tmp_path: Path) -> None:
    scene = random_scenes.scene(seed)
    faults = {}
    for name, words in commands(scene, tmp_path).items():
        if wrong := fault(run(*words), scene, "--json" in words):
            faults[name] = wrong
    assert not faults, faults
