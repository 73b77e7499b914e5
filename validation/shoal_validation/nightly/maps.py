"""The lines of the stability maps in space and of contacts: no cell of ours may say that all is well and be wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from shoal_validation.benchmarks.timing import undisturbed
from shoal_validation.judge import Outcome
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.measure import Measured
from shoal_validation.stability import MAPS

NAMES = tuple(name for name in MAPS if name.startswith(("space-", "contacts-")))
REASON = "no run that is off by a tenth of the machine may say ok"
SOURCE = "the references of the map"


def lines() -> Iterator[Line]:
    """One for each map, on three values of each axis and with our own methods."""
    for name in NAMES:
        run = partial(silently_wrong, name)
        yield Line(f"map/{name}", "gauss", "all methods", 0.0, REASON, run, SOURCE, "cells", quick=False, noise=0.5)


def silently_wrong(name: str) -> Measured:
    """Number of cells of a map that are, as the error; failed if none holds, as such a map guards nothing."""
    whole = MAPS[name].reduced()
    asked = replace(whole, methods=tuple(method for method in whole.methods if method.ours))

    def outcomes() -> list[Outcome]:
        places = [(x, y) for y in asked.y.values for x in asked.x.values]
        return [asked.cell(method, *place).outcome for method in asked.methods for place in places]

    seconds, found = undisturbed(outcomes)
    if Outcome.HOLDS not in found:
        return Measured("failed", np.nan, seconds, "no cell holds")
    return Measured("ok", float(found.count(Outcome.SILENT)), seconds)
