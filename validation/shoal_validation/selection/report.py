"""The figures of the study in words and one table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shoal_validation.document import table
from shoal_validation.selection.study import Case


def section(cases: Sequence[Case]) -> str:
    """Results of all machines, by number of rods."""
    rows = [_row(f"{rods}", [case for case in cases if case.rods == rods]) for rods in (1, 2, 3, 4)]
    head = (
        *("rods", "machines", "met, and true", "met, not true", "beyond 3 times", "met, truth unknown"),
        *("not met, and said so", "all rigid", "search, median"),
    )
    parts = [
        f"{len(cases)} machines, seeds {cases[0].seed} to {cases[-1].seed}.",
        table(head, [row for row in [*rows, _row("all", list(cases))] if row[1] != "0"]),
        _costs([case for case in cases if np.isfinite(case.least) and case.least > 0 and case.met]),
        _capped([case for case in cases if case.met and case.work < case.uncapped and not case.rigid]),
        _owned([case for case in cases if not case.met]),
    ]
    return "\n\n".join(part for part in parts if part)


def _row(name: str, cases: list[Case]) -> tuple[str, ...]:
    met = [case for case in cases if case.met]
    judged = [case for case in met if case.known]
    over = [case for case in judged if case.error > case.tolerance]
    counts = (
        len(cases),
        len(judged) - len(over),
        len(over),
        sum(case.error > 3 * case.tolerance for case in judged),
        len(met) - len(judged),
        len(cases) - len(met),
        sum(case.rigid for case in met),
    )
    median = f"{np.median([case.seconds for case in cases]):.2f} s" if cases else ""
    return (name, *map(str, counts), median)


def _costs(cases: list[Case]) -> str:
    if not cases:
        return ""
    ratios = np.array([case.uncapped / case.least for case in cases])
    return (
        f"Work over that of the cheapest model with its inertia as it is that would have met the tolerance, for the "
        f"{len(cases)} machines of one or two rods that are not all rigid: median {np.median(ratios):.2f}, 95 % below "
        f"{np.quantile(ratios, 0.95):.2f}, largest {ratios.max():.2f}; above 2 for {np.mean(ratios > 2):.0%}."
    )


def _capped(cases: list[Case]) -> str:
    if not cases:
        return ""
    ratio = np.median([case.work / case.uncapped for case in cases])
    return f"{len(cases)} models cap the inertia of axial modes, which takes {ratio:.2f} of the work (median)."


def _owned(cases: list[Case]) -> str:
    if not cases:
        return ""
    reasons = {
        "no theory of rods holds": "strained beyond all theory",
        "element steps": "too much work",
        "rejected": "runs rejected",
        "": "does not settle",
    }
    named = [next(name for word, name in reasons.items() if word in case.reason) for case in cases]
    known = ", ".join(f"{name} {named.count(name)}" for name in reasons.values() if name in named)
    return f"Not met: {known}."
