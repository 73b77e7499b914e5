"""How far off mean and deviation of an expansion may be.

What is left out of a fit tells how much single runs are off. It does not tell of tails that runs do not reach, nor of a
deviation that a smooth polynomial loses. Half of the runs know less of both than all: what expansions of either half
tell apart from that of all is what the runs are worth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from shoal.response.statistics import SURE
from shoal.response.study import Study
from shoal.trajectory import Array

HALVES = 2.0
"""Times what a half tells apart from all."""


class Moments(Protocol):
    """What an expansion tells, (columns,) each."""

    @property
    def mean(self) -> Array:
        """Over all parameters."""
        ...

    @property
    def variance(self) -> Array:
        """Over all parameters."""
        ...

    @property
    def left_out(self) -> Array:
        """Error at runs that are left out of the fit."""
        ...

    @property
    def squares(self) -> Array | None:
        """The same of squares."""
        ...


def errors(study: Study, found: Moments, fitted: Callable[[Study], Moments]) -> tuple[Array, Array]:
    """Within which mean and std lie with 95 % confidence, (columns,) each; fitted: what fewer runs tell."""
    made, std, left_out = len(study.runs.germs), np.sqrt(found.variance), found.left_out
    squares = left_out if found.squares is None else np.maximum(found.squares, left_out)
    missing = np.divide(left_out**2, 2 * std, out=np.zeros_like(std), where=std > 0)
    scatter = SURE * np.array([left_out / np.sqrt(made), np.hypot(squares / np.sqrt(made), missing)])
    apart, first = np.zeros_like(scatter), np.arange(made) < made // 2
    for half in (first, ~first):
        part = fitted(replace(study, runs=study.runs.part(half)))
        apart = np.maximum(apart, np.abs([part.mean - found.mean, np.sqrt(part.variance) - std]))
    mean, deviation = np.hypot(scatter, HALVES * apart)
    return mean, deviation
