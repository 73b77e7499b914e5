"""Plan of a night: each problem on each engine by several methods, with the error that each may have, and why."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from shoal.errors import InputError

from shoal_validation.nightly import drawn, maps, own, uncertain
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.measure import Measured, angles, motion, selection
from shoal_validation.nightly.methods import FLEXIBLE, RIGID, Method
from shoal_validation.nightly.methods_in_space import IN_SPACE
from shoal_validation.nightly.result import ROUND_OFF
from shoal_validation.problems import PROBLEMS

IDENTIFICATION = {
    "paper-case-1-same-mesh": (1e-9, "data of CasADi on the fitted mesh: only round-off and its tolerance remain"),
    "paper-case-2-same-mesh": (1e-9, "data of CasADi on the fitted mesh: only round-off and its tolerance remain"),
    "paper-case-1": (1e-3, "data of a converged mesh: the error of the fitted 4/8 mesh, 0.035 degrees, remains"),
    "paper-case-2": (1e-3, "data of a converged mesh: the error of the fitted 4/8 mesh, 0.045 degrees, remains"),
}
"""Limits of both angles [rad] of the paper's cases."""
SEARCHES = ("least-squares", "iafsa")


def plan(only: str | None = None, quick: bool = False) -> list[Line]:
    """The lines of a night, of one problem or scene of the library if so asked. Raises InputError."""
    lines = [*_motions(), *_identifications(), *maps.lines(), *drawn.lines(), *uncertain.lines(), *own.lines()]
    names = dict.fromkeys(line.problem for line in lines)
    if only is not None and only not in names and (only := own.OWN + (asked := only)) not in names:
        raise InputError(f"--only: no problem {asked!r}; there are {', '.join(names)}")
    return [line for line in lines if only in (None, line.problem) and (line.quick or not quick)]


def _motions() -> Iterator[Line]:
    for name, problem in PROBLEMS.items():
        for method in (*(FLEXIBLE if problem.flexible else RIGID), *IN_SPACE):
            if name in method.limits:
                limit = method.limits[name]
                run, noise = _call(name, method), (limit or ROUND_OFF) if method.by_theory else ROUND_OFF
                line = Line(name, method.engine, method.name, limit, method.reason, run, noise=noise)
                yield replace(line, quick=method.quick)


def _call(problem: str, method: Method) -> Callable[[], Measured]:
    if method.tolerance is not None:
        return partial(selection, problem, method.tolerance)
    return partial(motion, problem, method.engine, method.values, method.verify)


def _identifications() -> Iterator[Line]:
    for name, (limit, reason) in IDENTIFICATION.items():
        for search in SEARCHES:
            run = partial(angles, name, search)
            # The swarm needs thousands of evaluations, which the fine step of the same-mesh problems makes slow.
            quick = search == "least-squares" or name == "paper-case-1"
            yield Line(name, "gauss", search, limit, reason, run, "the angles of the data", "rad", quick)
