"""Units on the axes of pictures."""

from __future__ import annotations

from shoal.identification import Estimate, Problem
from shoal.identification.recording.units import of_channels, squared, unit

_MIXED = "SI units"
"""Of numbers over channels of different units."""


def labelled(path: str | None, name: str = "") -> str:
    """A path (or the name that stands for it) with its unit, where it is known."""
    known = unit(path or "")
    return f"{name or path}{f' [{known}]' if known else ''}"


def rms_unit(estimate: Estimate) -> str:
    """Return the unit of a root mean square over all channels."""
    return of_channels(estimate.measurement) or _MIXED


def fitness_unit(estimate: Estimate) -> str:
    """Return the unit of a mean square over all channels."""
    unit = rms_unit(estimate)
    return unit if unit == _MIXED else squared(unit)


def parameter(problem: Problem, name: str) -> str:
    """A component of the parameter vector with its unit."""
    key = name if name in problem.parameters else name.rpartition(".")[2]
    found = problem.parameters.get(key)
    return labelled(found.path if found else None, name)
