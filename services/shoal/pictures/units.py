"""Units of a scene's fields, for the labels of axes."""

from __future__ import annotations

from shoal.identification import Estimate, Problem
from shoal.pictures.signals import UNITS

_UNITS = {
    "angle": "rad",
    "tilt": "rad",
    "rate": "rad/s",
    "length": "m",
    "height": "m",
    "width": "m",
    "centre_of_mass": "m",
    "position": "m",
    "x": "m",
    "y": "m",
    "velocity": "m/s",
    "gravity": "m/s²",
    "density": "kg/m³",
    "mass": "kg",
    "inertia": "kg m²",
    "youngs_modulus": "Pa",
    "delay": "s",
    "retardation": "s",
}


def labelled(path: str | None, name: str = "") -> str:
    """A path (or the name that stands for it) with its unit, where it is known."""
    leaves = [part for part in (path or "").split(".") if not part.isdigit()]
    unit = _UNITS.get(leaves[-1] if leaves else "", "")
    return f"{name or path}{f' [{unit}]' if unit else ''}"


def fitness_unit(estimate: Estimate) -> str:
    """Of a mean square over all channels."""
    units = {UNITS[channel.quantity] for r in estimate.measurement.recordings.values() for channel in r.channels}
    if len(units) > 1:
        return "SI units"
    (unit,) = units
    return f"({unit})²" if "/" in unit else f"{unit}²"


def parameter(problem: Problem, name: str) -> str:
    """A component of the parameter vector with its unit."""
    key = name if name in problem.parameters else name.rpartition(".")[2]
    found = problem.parameters.get(key)
    return labelled(found.path if found else None, name)
