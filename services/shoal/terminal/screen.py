"""The two streams: tables and sentences on the output, progress on standard error."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table

from shoal.compile import progress
from shoal.error_budget import Grade
from shoal.findings import Concluded
from shoal.json_values import json_text
from shoal.scene import Scene

_ENOUGH = 10_000
"""Columns that every table has room in."""

COLOURS: Mapping[Grade, str] = {"good": "green", "fair": "yellow", "bad": "red"}
"""Of a line that says how far an answer is to be trusted."""

out = Console(highlight=False)
err = Console(stderr=True, highlight=False)


def show(data: Mapping[str, Any], as_json: bool, draw: Callable[[], None]) -> None:
    """One JSON object, or what `draw` prints."""
    if as_json:
        print(json_text(data))  # noqa: T201 - this is the output
    else:
        draw()


@contextmanager
def working(what: str) -> Iterator[Callable[[str], None]]:
    """Show a spinner with `what`, or a later text, on a terminal; a line for every kernel that is compiled."""
    if not err.is_terminal:
        with progress.reporting_to(line):
            yield lambda _: None
        return
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True) as shown, progress.reporting_to(line):
        task = shown.add_task(what, total=None)
        yield lambda now: shown.update(task, description=now)


def line(text: str) -> None:
    """A line of progress, which log files get too."""
    err.print(escape(text), soft_wrap=True)


def compile_for(engine: str, lanes: Iterable[int], *scenes: Scene) -> None:
    """Compile the kernels of runs of the native solver on all cores; lanes: 1 for single runs, 2 for batches.

    It begins with the first model, so that errors of the input are reported before.
    """
    if engine == "gauss":

        def compile_all() -> None:
            from shoal.mechanics.warm import warm_for

            warm_for(scenes, lanes, line)

        progress.before_first_model(compile_all)


class FittingTable(Table):
    """A table that breaks no word, and so no number: where it would have to, its columns stand below each other."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        wide = options.update(width=_ENOUGH)
        for column in self.columns:
            column.width = None
        sizes = [
            [Measurement.get(console, wide, cell) for cell in (column.header, *column.cells)] for column in self.columns
        ]
        words = [max(size.minimum for size in cells) for cells in sizes]
        room = options.max_width - (Measurement.get(console, wide, self).minimum - sum(words))
        if sum(words) <= room:
            # Rich by itself shortens the widest columns, whatever words these have.
            for column, width in zip(self.columns, _shared(words, sizes, room), strict=True):
                column.width = width
            yield from super().__rich_console__(console, options)
            return
        for row in zip(*(column.cells for column in self.columns), strict=True):
            for column, cell in zip(self.columns, row, strict=True):
                yield f"{column.header}  {cell}".strip()
            yield ""


def _shared(words: list[int], sizes: list[list[Measurement]], room: int) -> list[int]:
    """Widths of columns [characters]: of the longest word at least, of the longest cell where there is room."""
    widths, spare = list(words), room - sum(words)
    wanted = [max(size.maximum for size in cells) - word for cells, word in zip(sizes, words, strict=True)]
    order = sorted(range(len(words)), key=lambda k: wanted[k])
    for rank, k in enumerate(order):
        more = min(wanted[k], spare // (len(order) - rank))
        widths[k], spare = widths[k] + more, spare - more
    return widths


def table(title: str, *headings: str) -> Table:
    """An empty table; its title is printed at once, so that it is not folded to the width of the table."""
    out.print(title, style="bold")
    return untitled(*headings)


def untitled(*headings: str) -> Table:
    """An empty table without a title, of which nothing is printed yet."""
    made = FittingTable(box=box.SIMPLE_HEAD, pad_edge=False)
    for index, heading in enumerate(headings):
        made.add_column(escape(heading), justify="left" if index == 0 else "right", overflow="fold")
    return made


def listing(title: str, items: Mapping[str, str]) -> None:
    """Names with their descriptions."""
    made = Table(title=title, title_justify="left", title_style="bold", box=None, show_header=False, pad_edge=False)
    made.add_column(no_wrap=True)
    made.add_column()
    for name, text in items.items():
        made.add_row(name, text)
    out.print(made)
    out.print()


def findings(answer: Concluded) -> None:
    """Print what was found out about an answer, and the steps to take next."""
    say(*(f"  {one.text}" for one in answer.findings))
    say(*(f"next: {step}" for step in answer.advice))


def say(*texts: str, style: str = "") -> None:
    """Lines of text, on a terminal folded at 80 columns, in a log file whole; what looks like markup is none."""
    for text in texts:
        out.print(escape(text), style=style, width=min(80, out.width), soft_wrap=not out.is_terminal)
