"""What a function of something simpler is asked for, and the studies that it is fitted to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol, Self

import numpy as np

from shoal.response.expansion import Expansion
from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.runs import CachedModel
from shoal.response.study import Study
from shoal.trajectory import Array

CLEARLY = 0.5
"""Of the error of the expansion: below it a function is taken instead."""

Fitted = Callable[[Study], Expansion]
"""The expansion of a study."""


class Link(Protocol):
    """A function of something simpler, in some columns; text: in words."""

    text: str

    @property
    def mean(self) -> Array:
        """(columns,)."""
        ...

    @property
    def variance(self) -> Array:
        """(columns,)."""
        ...

    @property
    def beyond(self) -> Array:
        """Part of the deviation that no run can tell of, (columns,)."""
        ...

    def __call__(self, germs: Array) -> Array:
        """(places, columns)."""
        ...

    def indices(self) -> Array:
        """First and total ones of Sobol, (2, parameters, columns), of parameters that do not correlate."""
        ...

    def some(self, which: BoolArray) -> Self:
        """In some of its columns, (columns,)."""
        ...

    def again(self, study: Study, fitted: Fitted) -> Self:
        """Of the same kind, for other runs of the same columns."""
        ...


def some(study: Study, columns: IntArray) -> Study:
    """Of these columns alone."""
    return of(study, study.inputs, study.runs.germs, study.runs.values[:, columns])


def of(study: Study, inputs: Inputs, germs: Array, values: Array) -> Study:
    """With other answers."""
    good = np.ones(len(germs), dtype=bool)
    return replace(
        study, runs=CachedModel(study.runs.model, inputs, len(germs), None, 0, "", [germs], [values], [good])
    )
