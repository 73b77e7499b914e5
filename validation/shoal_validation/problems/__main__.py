"""`python -m shoal_validation.problems [NAME ...]`: recomputes the references of flexible problems.

Each takes about a minute; the files are part of the sources.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from rich.console import Console

from shoal_validation.problems import PROBLEMS, beams, compute, get_problem
from shoal_validation.problems.contract import Problem


def main(names: list[str]) -> None:
    """Write computed/NAME.json of the named problems, or of all flexible ones."""
    console = Console(stderr=True, highlight=False)
    folder = Path(__file__).parent / "computed"
    folder.mkdir(exist_ok=True)
    for name in names or [problem.name for problem in PROBLEMS.values() if problem.flexible]:
        data = _computed(get_problem(name))
        file = folder / f"{name}.json"
        file.write_text(json.dumps(data, indent=None, separators=(",", ": ")) + "\n", encoding="utf-8")
        console.print(f"{file.name}: own error {data['error']:.1e} m, {data['agreement']:.1e} m from our rods")


def _computed(problem: Problem) -> dict[str, Any]:
    twisted = any(body.element == "director-rod" for body in problem.scene().bodies.values())
    return beams.compute(problem) if twisted else compute.compute(problem)


if __name__ == "__main__":
    main(sys.argv[1:])
