"""`python -m shoal_validation.uncertain [--studies N] [--quick] [--page FILE]`: methods for uncertain parameters.

Prints accuracy by number of runs of every method for intervals on every problem, and N random studies by `auto` whose
bounds 100 000 random runs try to leave; writes both into FILE (docs/uncertain.md). Five minutes; quick: 20 studies and
the problems of one parameter.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from shoal.response.methods import METHODS

from shoal_validation.document import publish, table
from shoal_validation.uncertain.measure import Line, Study, measured, random_study
from shoal_validation.uncertain.problems import PROBLEMS

NOT_FOR_INTERVALS = {"chaos", "maximum-entropy", "nested"}


def main(arguments: list[str]) -> bool:
    """Measure, print, write; whether nothing is wrong in silence where `auto` told it."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.uncertain", description=__doc__)
    parser.add_argument("--studies", type=int, default=200)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--page", type=Path, default=Path("docs/uncertain.md"))
    chosen = parser.parse_args(arguments)
    lines = []
    for problem in PROBLEMS:
        if chosen.quick and problem.parameters > 1:
            continue
        low, high = problem.reference()
        lines += [measured(problem, method, low, high) for method in METHODS if method not in NOT_FOR_INTERVALS]
    studies = [random_study(seed) for seed in range(20 if chosen.quick else chosen.studies)]
    publish(chosen.page, {"uncertain-methods": methods_table(lines), "uncertain-studies": studies_text(studies)})
    ours = all(line.verdict != "silent" for line in lines if line.method == "auto")
    return ours and all(study.kept for study in studies)


def methods_table(lines: Sequence[Line]) -> str:
    """A row for each method, a column for each problem."""
    problems = list(dict.fromkeys(line.problem for line in lines))
    rows = []
    for method in dict.fromkeys(line.method for line in lines):
        found = {line.problem: line for line in lines if line.method == method}
        rows.append([method, *(_cell(found[problem]) for problem in problems)])
    return table(["method", *problems], rows)


def _cell(line: Line) -> str:
    if line.verdict == "refused":
        return "refused"
    return f"{line.runs}: {max(line.short, 0.0):.0e} {line.verdict}"


def studies_text(studies: Sequence[Study]) -> str:
    """One sentence."""
    left = sum(not study.kept for study in studies)
    runs = sorted(study.runs for study in studies)
    return (
        f"Of {len(studies)} random studies of one to four intervals (median {runs[len(runs) // 2]} runs) {left} state "
        "outer bounds that one of 100 000 random runs exceeds by more than the gap told; the furthest lies "
        f"{max(study.beyond for study in studies):.1e} of the width beyond."
    )


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1:]) else 1)
