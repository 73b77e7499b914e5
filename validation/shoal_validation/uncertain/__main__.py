"""`python -m shoal_validation.uncertain [--studies N] [--runs N] [--only PART] [--quick] [--first SEED] [--page FILE]
[--record FILE]`.

Prints accuracy by number of runs of every method for intervals on every problem (`methods`), N random studies of
machines in closed form by `auto`, whose bounds 100 000 random runs try to leave (`studies`), and ten scenes of other
shapes whose bounds a fiftieth of these runs try (`scenes`), demands (`reached`), and draws how far ahead the bounds of
every method are right (`map`); writes all into FILE (docs/uncertain-charts.md). Two hours; quick: 20 studies of at most
three parameters, the problems of one, demands of few seconds, and a map of up to two.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

from shoal.response.methods import methods

from shoal_validation.document import publish, table
from shoal_validation.resumed import resumed
from shoal_validation.uncertain import chart, maps, reached, scenes
from shoal_validation.uncertain.measure import Line, measured
from shoal_validation.uncertain.problems import PROBLEMS
from shoal_validation.uncertain.studies import RUNS, Judged, drawn, judged

NOT_FOR_INTERVALS = {"chaos", "maximum-entropy", "nested"}
VARIANTS = {
    "taylor, order 2": ("taylor", {"degree": 2}),
    "taylor, order 2, subintervals": ("taylor", {"degree": 2, "count": 400}),
}
"""Rows of methods with options of their own."""
SHARE = 50
"""One in so many runs tries each of the scenes, whose runs are dear."""
FEW = 3
"""Parameters of quick studies, at most."""


def main(arguments: list[str]) -> bool:
    """Measure, print, write; return whether nothing is silently wrong by `auto`."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.uncertain", description=__doc__)
    parser.add_argument("--studies", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="seed of the first study")
    parser.add_argument("--runs", type=int, default=RUNS, help="random runs against every study")
    parser.add_argument("--only", choices=["methods", "studies", "scenes", "reached", "map"])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--chart", type=Path, default=Path("docs/charts/uncertain-map.png"))
    parser.add_argument("--page", type=Path, default=Path("docs/uncertain-charts.md"))
    parser.add_argument("--record", type=Path, help="keeps the studies that are done, so that they can go on")
    chosen = parser.parse_args(arguments)
    told, good = {}, True
    if chosen.only in (None, "methods"):
        lines = compared(quick=chosen.quick)
        told["uncertain-methods"] = methods_table(lines)
        good = all(line.verdict != "silent" for line in lines if line.method == "auto")
    if chosen.only in (None, "studies"):
        count, most = (20, FEW) if chosen.quick else (chosen.studies, None)
        found = tried(count, chosen.runs, most, chosen.first, chosen.record)
        told["uncertain-studies"] = studies_text(found, chosen.runs)
        good = good and all(one.kept for one in found)
    if chosen.only in (None, "scenes"):
        made = [scenes.tried(asked, max(chosen.runs // SHARE, scenes.BLOCK)) for asked in scenes.STUDIES]
        told["uncertain-scenes"] = scenes_table(made)
        good = good and all(one.kept for one in made)
    if chosen.only in (None, "reached"):
        told["uncertain-reached"] = reached_table(list(reached.all_of_them(quick=chosen.quick)))
    if chosen.only in (None, "map"):
        cells = maps.surveyed([name for name in methods() if name not in NOT_FOR_INTERVALS], quick=chosen.quick)
        told["uncertain-map"] = chart.findings(cells)
        chart.draw(cells, chosen.chart)
        good = good and not any(one.silent for one in cells if one.method == "auto")
    publish(chosen.page, told)
    return good


def compared(*, quick: bool) -> list[Line]:
    """Every method on every problem; quick: those of one parameter."""
    lines = []
    for problem in PROBLEMS:
        if not quick or problem.parameters == 1:
            low, high = problem.reference()
            lines += [measured(problem, method, low, high) for method in methods() if method not in NOT_FOR_INTERVALS]
            for name, (method, options) in VARIANTS.items():
                lines.append(replace(measured(problem, method, low, high, **options), method=name))
    return lines


def tried(count: int, runs: int, most: int | None = None, first: int = 0, record: Path | None = None) -> list[Judged]:
    """Try `count` random studies against `runs` runs each; most: parameters. One that fails is printed."""
    every = (drawn(seed) for seed in itertools.count(first))
    asked = itertools.islice((one for one in every if most is None or len(one.varied) <= most), count)
    cases = {f"seed {one.seed}, {runs} runs": one for one in asked}
    found = []
    for _, kept in resumed(list(cases), lambda key: asdict(judged(cases[key], runs)), record):
        found.append(one := Judged(**kept))
        if not one.kept:
            sys.stdout.write(
                f"seed {one.seed}, {one.machine}, {one.parameters} parameters, {one.cycles:.3g} cycles: gap "
                f"{one.gap:.1e}, but a run lies {one.beyond:.1e} beyond ({one.why})\n"
            )
    return found


def scenes_table(made: Sequence[scenes.Tried]) -> str:
    """A row for each scene."""
    rows = []
    for one in made:
        found = one.response
        assert found.bounds is not None
        known = f"{found.bounds.gap:.0e}" if found.horizon > 0 else "not known"
        rows.append(
            [one.name, found.status, str(found.evaluations), known, f"{found.horizon:g}"]
            + [f"{max(of, 0.0):.0e}" if found.horizon > 0 else "" for of in (one.short, one.beyond)]
        )
    titles = ["machine", "status", "runs", "gap", "horizon [s]", "a run beyond attained bounds", "beyond outer ones"]
    return table(titles, rows)


def reached_table(found: Sequence[reached.Reached]) -> str:
    """A row for each demand."""
    rows = [[one.name, one.asked, one.found, "yes" if one.met else "no"] for one in found]
    return table(["what", "asked", "found", "met"], rows)


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


def studies_text(studies: Sequence[Judged], runs: int) -> str:
    """One paragraph."""
    left = sum(not study.kept for study in studies)
    whole = [study for study in studies if study.ok]
    made = sorted(study.runs for study in whole)
    furthest = max((study.beyond for study in whole), default=0.0)
    gaps = sorted(study.gap for study in whole)
    kinds = len({study.machine for study in studies})
    most = max(study.parameters for study in studies)
    middle_runs, middle_gap = made[len(made) // 2] if made else 0, gaps[len(gaps) // 2] if gaps else 0.0
    return (
        f"Of {len(studies)} random studies of {kinds} machines with one to {most} intervals of 0.5 to 30 % after "
        f"0.3 to 300 cycles, {left} state outer bounds that one of {runs} random runs exceeds within the horizon by "
        f"more than the gap. {len(whole)} hold at all instants (median {middle_runs} runs, gap {middle_gap:.0e}); "
        f"there the furthest run lies {furthest:.0e} of the width beyond. The other {len(studies) - len(whole)} end at "
        "a horizon and say so."
    )


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1:]) else 1)
