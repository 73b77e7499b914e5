"""`python -m shoal_validation.ablation [--only NAME] [--quick | --draw] [--out FOLDER]`: both ablations.

Writes ablation-dynamics.png, ablation-inverse.png and their numbers, ablation.json, into FOLDER (docs/charts), and the
tables into swarm-charts.md beside that folder, if there is one. About ten minutes; quick: one; only: one of
the two anew; draw: from the JSON that is there.
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

from shoal_validation.ablation import dynamics, inverse, report
from shoal_validation.document import publish


def main(arguments: list[str]) -> None:
    """Measure, draw, write."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.ablation", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="2 seeds and 4 time steps")
    parser.add_argument("--out", type=Path, default=Path("docs/charts"))
    parser.add_argument("--only", choices=["dynamics", "inverse"], help="measure this anew, keep the other")
    parser.add_argument("--draw", action="store_true", help="pictures and tables of the last measurement")
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    file = chosen.out / "ablation.json"
    data = json.loads(file.read_text(encoding="utf-8")) if chosen.draw or chosen.only else {}
    if not chosen.draw:
        data |= _measure(chosen.quick, [chosen.only] if chosen.only else ["dynamics", "inverse"])
        file.write_text(json.dumps(data) + "\n", encoding="utf-8")
    stepped = [dynamics.Steps(**_arrays(row, data["seeds"])) for row in data["dynamics"]]
    searched = [inverse.Searches(**_arrays(row, data["seeds"])) for row in data["inverse"]]
    report.draw_dynamics(stepped, chosen.out / "ablation-dynamics.png")
    report.draw_inverse(searched, chosen.out / "ablation-inverse.png")
    tables = {"ablation-dynamics": report.dynamics_table(stepped), "ablation-inverse": report.inverse_table(searched)}
    publish(chosen.out.parent / "swarm-charts.md", tables)


def _measure(quick: bool, which: list[str]) -> dict[str, Any]:
    seeds, steps = (2, 4) if quick else (20, 10)
    found: dict[str, Any] = {"seeds": seeds}
    with Progress(console=Console(stderr=True)) as progress:
        if "dynamics" in which:
            found["dynamics"] = list(map(_plain, _dynamics(progress, seeds, steps)))
        if "inverse" in which:
            found["inverse"] = list(map(_plain, _inverse(progress, seeds)))
    return found


def _dynamics(progress: Progress, seeds: int, steps: int) -> list[dynamics.Steps]:
    swarms = [("flexible-double-pendulum", name) for name in dynamics.SWARMS] + [("rigid-double-pendulum", "iafsa")]
    task = progress.add_task("every time step", total=len(swarms) * 16 * seeds)
    return [
        dynamics.measure(machine, swarm, seeds=seeds, steps=steps, note=lambda: progress.advance(task))
        for machine, swarm in swarms
    ]


def _inverse(progress: Progress, seeds: int) -> list[inverse.Searches]:
    task = progress.add_task("inverse problem", total=len(inverse.SWARMS) * 16 * seeds)
    data = inverse.Data.load()
    return [
        inverse.measure_swarm(swarm, data, seeds=seeds, note=lambda: progress.advance(task)) for swarm in inverse.SWARMS
    ]


def _plain(result: Any) -> dict[str, Any]:
    def rounded(value: Any) -> Any:
        if not isinstance(value, np.ndarray):
            return value
        return [float(f"{x:.4g}") for x in value.ravel()]

    return {name: rounded(value) for name, value in asdict(result).items()}


def _arrays(row: dict[str, Any], seeds: int) -> dict[str, Any]:
    """Arrays that `_plain` flattened, (2, 2, 2, 2, seeds) again."""
    return {
        name: np.reshape(value, (2, 2, 2, 2, seeds)) if isinstance(value, list) else value
        for name, value in row.items()
    }


if __name__ == "__main__":
    main(sys.argv[1:])
