"""Record of a run: one JSON file of machine, versions, references and points, which can be drawn again."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from shoal.home import processor
from shoal.json_values import plain
from shoal.versions import versions

from shoal_validation.problems import get_problem
from shoal_validation.work_precision.contract import Point
from shoal_validation.work_precision.measure import Study

PACKAGES = ("shoal", "numpy", "scipy", "numba", "exudyn", "casadi", "mujoco")
NAME = "work-precision"


def machine_facts() -> dict[str, str]:
    """Facts about the machine that the times depend on."""
    return {"processor": processor(), "cores": str(os.cpu_count()), **versions(PACKAGES)}


def save(folder: Path, studies: list[Study], machine: dict[str, str], name: str = NAME) -> None:
    """Write the data of a run as NAME.json."""
    data = {
        "machine": machine,
        "problems": {
            one.problem.name: {
                "reference": {"source": one.problem.reference.source, "error": one.problem.reference.error},
                "left_out": one.left_out,
                "points": [_short(asdict(point)) for point in one.points],
            }
            for one in studies
        },
    }
    text = json.dumps(plain(data), separators=(",", ":")).replace('{"family"', '\n{"family"')
    (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def load(folder: Path, name: str = NAME) -> tuple[list[Study], dict[str, str]]:
    """The studies of an earlier run and its machine."""
    data = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    empty = {"mesh": "", "error": float("nan")}
    return [
        Study(get_problem(name), [Point(**{**empty, **point}) for point in one["points"]], one["left_out"])
        for name, one in data["problems"].items()
    ], data["machine"]


def _short(point: dict[str, Any]) -> dict[str, Any]:
    """A point as it is stored: four digits, no empty fields."""
    rounded = {key: float(f"{value:.4g}") if isinstance(value, float) else value for key, value in point.items()}
    if point["status"] == "refused":
        del rounded["message"]
    return {key: value for key, value in plain(rounded).items() if value not in (None, "")}
