"""Surrogate-based methods: a plan places the runs and fits a surrogate to them; a row of the list for each plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from shoal.response.extremes import Surrogate
from shoal.response.study import Found, Method, Study
from shoal.trajectory import Array


@dataclass(frozen=True)
class Plan:
    """Runs of a surrogate and its fit.

    places: standardised variables of the runs, (runs, parameters), from -1 to 1; fit: to the runs that did not fail;
    about: both in words. The error of the surrogate is estimated from further runs, alike for all of them
    """

    places: Array
    fit: Callable[[Study], Surrogate]
    about: str


def fitted(name: str, plan: Callable[[Study], Plan]) -> Method:
    """Return the method of that name for intervals. It raises InputError and ComputationError."""

    def method(study: Study) -> Found:
        study.intervals_only(name)
        planned = plan(study)
        study.runs(planned.places)
        return Found(planned.about, planned.fit(study))

    return method
