"""`python -m shoal_validation.selection`: is the chosen model within its tolerance, and what did it cost too much.

Draws random machines, lets Shoal choose a model for each, and judges by a finer one; for one and two rods all cheaper
models are run, too. Writes docs/charts/selection.json and .png and the section of docs/model-choice.md.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from shoal.json_values import plain
from shoal.selection.refine import PATIENCE

from shoal_validation.document import rewrite
from shoal_validation.selection.chart import draw_chart
from shoal_validation.selection.machines import draw
from shoal_validation.selection.report import section
from shoal_validation.selection.study import Case, study

DOCS = Path(__file__).parents[3] / "docs"
EXHAUSTIVE = 2
"""Rods up to which every cheaper combination of levels is run."""


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.selection", description=__doc__)
    parser.add_argument("--machines", type=int, default=200, help="how many random machines (default: 200)")
    parser.add_argument("--first", type=int, default=0, help="seed of the first (default: 0)")
    parser.add_argument(
        "--patience", type=float, default=PATIENCE, help=f"seconds a refinement may take (default: {PATIENCE:g})"
    )
    parser.add_argument("--resume", action="store_true", help="keep the machines that selection.json holds already")
    parser.add_argument("--out", type=Path, default=DOCS / "charts", help="folder of chart and data")
    asked = parser.parse_args()
    if not asked.patience > 0:
        parser.error(f"--patience: needs a time above 0 s, found {asked.patience:g}")
    if asked.machines < 1:
        parser.error(f"--machines: needs one or more, found {asked.machines}")
    asked.out.mkdir(parents=True, exist_ok=True)
    record = asked.out / "selection.json"
    seeds = range(asked.first, asked.first + asked.machines)
    cases = [case for case in load(record) if case.seed in seeds] if asked.resume and record.exists() else []
    left = [seed for seed in seeds if seed not in {case.seed for case in cases}]
    for case in cases_of(left, asked.patience):
        cases.append(case)
        save(cases, record)
    draw_chart(cases, asked.out / "selection.png")
    text = section(cases)
    if asked.out == DOCS / "charts":
        rewrite(DOCS / "model-choice.md", "selection", text)
    Console(highlight=False).print(text)


def save(cases: Sequence[Case], record: Path) -> None:
    """All cases so far, so that a study that was stopped can go on."""
    data = plain([asdict(case) for case in sorted(cases, key=lambda case: case.seed)])
    record.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def load(record: Path) -> list[Case]:
    """The cases that `save` wrote, where null stands for what is not known."""
    rows = json.loads(record.read_text(encoding="utf-8"))
    known: list[dict[str, Any]] = [{k: np.nan if value is None else value for k, value in row.items()} for row in rows]
    return [Case(**row) for row in known]


def cases_of(seeds: Sequence[int], patience: float = PATIENCE) -> Iterator[Case]:
    """Yield the cases of the machines of these seeds, with progress on standard error."""
    for seed in track(seeds, "machines", console=Console(stderr=True)):
        machine = draw(seed)
        with np.errstate(invalid="ignore"):
            yield study(machine, exhaustive=len(machine.scene.bodies) <= EXHAUSTIVE, patience=patience)


if __name__ == "__main__":
    main()
