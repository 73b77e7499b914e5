"""The section of docs/stability.md that the maps write themselves: a picture, how to read it, what it teaches."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from shoal_validation.document import table
from shoal_validation.judge import Outcome
from shoal_validation.stability.survey import Result


def section(results: Sequence[Result]) -> str:
    """The maps one after the other, and a table of all of them."""
    return "\n\n".join([_totals(results), *(_one(result) for result in results)])


def _one(result: Result) -> str:
    return "\n\n".join(
        [
            f"## {result.question}",
            f"![{result.question}](charts/stability-{result.name}.png)",
            f"Across: {result.x.title}. Up: {result.y.title}. {result.teaches} {result.summary.capitalize()}.",
            f"`python -m shoal_validation.stability --only {result.name}`",
        ]
    )


def _totals(results: Sequence[Result]) -> str:
    """Cells of each class by who ran them, as a table."""
    kinds = [Outcome.SILENT, *(kind for kind in Outcome if kind is not Outcome.SILENT)]
    groups: dict[str, Counter[Outcome]] = {}
    for result in results:
        for panel in result.panels:
            name = "ours" if panel.ours else "other engines, checked" if panel.checked else "other engines, unchecked"
            groups[name] = groups.get(name, Counter()) + panel.count
    rows = [(name, *(str(count[kind]) for kind in kinds)) for name, count in groups.items()]
    return table(("cells", *kinds), rows)
