"""`python -m shoal_validation.work_precision`: measures every method on every problem, and renews charts and tables.

A whole run writes data and pictures to docs/charts, and the tables of docs/accuracy-figures.md (in the plane) and of
docs/accuracy-in-space.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
from rich import box
from rich.console import Console
from rich.table import Table
from shoal.home import home, prepare_kernel_cache

from shoal_validation.document import rewrite

if TYPE_CHECKING:
    from shoal_validation.problems import Problem
    from shoal_validation.work_precision.contract import Point
    from shoal_validation.work_precision.measure import Study

GROUPS: dict[str, dict[str, tuple[str, ...]]] = {
    "plane": {"chains": ("pendulum", "double-pendulum"), "loops": ()},
    "space": {"spatial": ()},
}
"""Pictures of rigid machines by page, and what they hold; an empty one has all others."""
PAGES = {
    "plane": ("work-precision", "accuracy-figures.md"),
    "space": ("work-precision-space", "accuracy-in-space.md"),
}
"""Name of the data and of the marks in the page, and the page."""


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
    console = Console(highlight=False)
    for page, problems in _problems(asked.only, asked.page).items():
        name, document = PAGES[page]
        if asked.redraw:
            studies, machine = load(folder, name)
        else:
            studies, machine = [], machine_facts()
            for one in _measure(problems, asked.quick):
                studies.append(one)
                save(folder, studies, machine, name)
        _draw(folder, page, studies)
        if not partial and (folder.parent / document).exists():
            rewrite(folder.parent / document, name, tables(studies, machine))
        for one in studies:
            _print(console, one)
    console.print(f"written to {folder}")


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.work_precision", description=__doc__)
    parser.add_argument("--only", metavar="PROBLEM", help="one problem of the library")
    parser.add_argument("--page", choices=PAGES, help="machines in the plane or in space only")
    parser.add_argument("--quick", action="store_true", help="few meshes, one repeat; for a look")
    parser.add_argument("--redraw", action="store_true", help="charts and tables from the data that lie in the folder")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="default: docs/charts; in part: the state folder")
    return parser.parse_args()


def _problems(only: str | None, page: str | None) -> dict[str, list[Problem]]:
    """Problems to measure, by pages."""
    from shoal_validation.problems import PROBLEMS, get_problem

    found: dict[str, list[Problem]] = {}
    for problem in [get_problem(only)] if only else PROBLEMS.values():
        of = "space" if problem.scene().dimensions == 3 else "plane"
        if only or page in (None, of):
            found.setdefault(of, []).append(problem)
    return found


def _measure(problems: list[Problem], quick: bool) -> Iterator[Study]:
    from shoal_validation.work_precision.measure import study

    errors = Console(stderr=True, highlight=False)
    with errors.status("starting") as status:
        note: Callable[[str], None] = status.update if errors.is_terminal else errors.print
        for problem in problems:
            yield study(problem, quick, note)


def _draw(folder: Path, page: str, studies: list[Study]) -> None:
    from shoal_validation.work_precision import charts

    pictures = {one.problem.name: charts.flexible(one) for one in studies if one.problem.flexible}
    rigid = [one for one in studies if not one.problem.flexible]
    named = {problem for group in GROUPS[page].values() for problem in group}
    for name, group in GROUPS[page].items():
        shown = [one for one in rigid if (one.problem.name in group if group else one.problem.name not in named)]
        pictures |= {name: charts.rigid(shown)} if shown else {}
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
