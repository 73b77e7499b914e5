"""`python -m shoal_validation.inverse_precision [--only NAME ...] [--quick | --draw] [--out FOLDER]`.

Charts of identification: one per case (`paper-case-1`, ...), and the map `horizon-noise`. Each writes a picture and
its numbers, identification-NAME.png and .json, into FOLDER (docs/charts); the tables go to standard output and into
identification-charts.md beside that folder, if there is one. The cases take five to ten minutes and so does the map;
quick: two; draw: from the JSON that is there.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from shoal_validation.document import publish
from shoal_validation.inverse_precision import charts, horizon_noise, report
from shoal_validation.inverse_precision.cases import BUDGET, CASES, Case
from shoal_validation.inverse_precision.contenders import contenders
from shoal_validation.inverse_precision.measure import Run, run

MAP = "horizon-noise"


def main(arguments: list[str]) -> None:
    """Measure, draw, write."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.inverse_precision", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=[*CASES, MAP], default=[*CASES, MAP], metavar="NAME")
    parser.add_argument("--quick", action="store_true", help="one seed, 400 evaluations, four cells of the map")
    parser.add_argument("--draw", action="store_true", help="pictures and tables of the last measurement")
    parser.add_argument("--out", type=Path, default=Path("docs/charts"))
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    with Progress(console=Console(stderr=True)) as progress:
        for name in chosen.only:
            file = chosen.out / f"identification-{name}.json"
            if not chosen.draw:
                rows = _map(progress, chosen.quick) if name == MAP else _case(progress, CASES[name], chosen.quick)
                file.write_text(json.dumps(rows, default=_rounded) + "\n", encoding="utf-8")
    _report(chosen.out)


def _report(out: Path) -> None:
    """Pictures and tables of all measurements that are there."""
    tables = {}
    runs: dict[str, list[Run]] = {}
    for name, case in CASES.items():
        if (file := out / f"identification-{name}.json").exists():
            runs[name] = [_run(row) for row in json.loads(file.read_text(encoding="utf-8"))]
            charts.draw_case(case, runs[name], file.with_suffix(".png"))
    if runs:
        tables["identification-precision"] = report.precision_table(runs)
    if (file := out / f"identification-{MAP}.json").exists():
        cells = [horizon_noise.Cell(**row) for row in json.loads(file.read_text(encoding="utf-8"))]
        panels = list(dict.fromkeys(cell.panel for cell in cells))
        charts.draw_map(panels, cells, file.with_suffix(".png"))
        tables[MAP] = report.map_table(panels, cells)
    publish(out.parent / "identification-charts.md", tables)


def _case(progress: Progress, case: Case, quick: bool) -> list[dict[str, Any]]:
    seeds, budget = (1, 400) if quick else (5, BUDGET)
    everyone = contenders()
    task = progress.add_task(case.name, total=len(everyone))
    data = case.data(case.problem)
    # Not counted: compiles and loads what every method needs.
    run(case, data, next(c for c in everyone if c.name == "least-squares"), 0, budget)
    rows = []
    for contender in everyone:
        lots = range(seeds if contender.seeded else 1)
        rows += [asdict(run(case, data, contender, seed, budget)) for seed in lots]
        progress.advance(task)
    return rows


def _map(progress: Progress, quick: bool) -> list[dict[str, Any]]:
    size: dict[str, Any] = {"horizons": (0.5, 2.0), "noises": (1e-3, 1e-1)} if quick else {}
    panels = horizon_noise.panels()
    task = progress.add_task(MAP, total=len(panels))
    rows = []
    for panel in panels:
        rows += [asdict(cell) for cell in horizon_noise.measure_panel(panel, **size)]
        progress.advance(task)
    return rows


def _run(row: dict[str, Any]) -> Run:
    arrays = {name: np.array(row[name]) for name in ("evaluations", "seconds", "errors")}
    return Run(**{**row, **arrays})


def _rounded(value: Any) -> list[float]:
    return [float(f"{x:.4g}") for x in np.ravel(value)]


if __name__ == "__main__":
    main(sys.argv[1:])
