"""`python -m shoal_validation.work_precision`: measures every method on every problem, and renews charts and tables.

A whole run writes work-precision.json and the pictures to docs/charts and the tables of docs/accuracy-and-speed.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
from rich import box
from rich.console import Console
from rich.table import Table
from shoal.home import home, prepare_kernel_cache

from shoal_validation.document import rewrite

if TYPE_CHECKING:
    from shoal_validation.work_precision.contract import Point
    from shoal_validation.work_precision.measure import Study

CHAINS = ("pendulum", "double-pendulum")


def main() -> None:
    """Measure, draw, write, print."""
    asked = _asked()
    # Before anything imports Numba or pyplot.
    prepare_kernel_cache()
    matplotlib.use("Agg")
    from shoal_validation.work_precision.data import load, machine_facts, save
    from shoal_validation.work_precision.page import tables

    partial = bool(asked.only or asked.quick)
    folder: Path = asked.out or (home() / "work-precision" if partial else Path("docs/charts"))
    folder.mkdir(parents=True, exist_ok=True)
    if asked.redraw:
        studies, machine = load(folder)
    else:
        studies, machine = _measure(asked.only, asked.quick), machine_facts()
        save(folder, studies, machine)
    _draw(folder, studies)
    page = folder.parent / "accuracy-and-speed.md"
    if not partial and page.exists():
        rewrite(page, "work-precision", tables(studies, machine))
    console = Console(highlight=False)
    for one in studies:
        _print(console, one)
    console.print(f"written to {folder}")


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.work_precision", description=__doc__)
    parser.add_argument("--only", metavar="PROBLEM", help="one problem of the library")
    parser.add_argument("--quick", action="store_true", help="few meshes, one repeat; for a look")
    parser.add_argument("--redraw", action="store_true", help="charts and tables from the data that lie in the folder")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="default: docs/charts; in part: the state folder")
    return parser.parse_args()


def _measure(only: str | None, quick: bool) -> list[Study]:
    from shoal_validation.problems import PROBLEMS, get_problem
    from shoal_validation.work_precision.measure import study

    errors = Console(stderr=True, highlight=False)
    problems = [get_problem(only)] if only else list(PROBLEMS.values())
    with errors.status("starting") as status:
        note: Callable[[str], None] = status.update if errors.is_terminal else errors.print
        return [study(problem, quick, note) for problem in problems]


def _draw(folder: Path, studies: list[Study]) -> None:
    from shoal_validation.work_precision import charts

    pictures = {one.problem.name: charts.flexible(one) for one in studies if one.problem.flexible}
    rigid = [one for one in studies if not one.problem.flexible]
    groups = {
        "chains": [one for one in rigid if one.problem.name in CHAINS],
        "loops": [one for one in rigid if one.problem.name not in CHAINS],
    }
    pictures |= {name: charts.rigid(group) for name, group in groups.items() if group}
    for name, figure in pictures.items():
        figure.savefig(folder / f"work-precision-{name}.png", dpi=110)


def _print(console: Console, one: Study) -> None:
    """The front of a problem, and what each error costs."""
    from shoal_validation.work_precision.contract import MANY
    from shoal_validation.work_precision.front import front
    from shoal_validation.work_precision.table import costs

    def named(point: Point | None) -> str:
        return f"{point.seconds * 1e3:.3g} ms ({point.label})" if point else "not reached"

    table = Table("ms", "error [m]", f"front of {one.problem.name}", box=box.SIMPLE_HEAD)
    for point in front([p for p in one.points if p.family != MANY], one.problem.reference.error):
        table.add_row(f"{point.seconds * 1e3:.3g}", f"{point.error:.1e}", point.label)
    console.print(table)
    for line in costs(one):
        ratio = f", ratio {line.ratio:.1f}, to its loop alone {line.loop_ratio or 0:.1f}" if line.ratio else ""
        console.print(f"to reach {line.reach:.0e} m: {named(line.ours)}, cheapest Exudyn {named(line.exudyn)}{ratio}")


if __name__ == "__main__":
    main()
