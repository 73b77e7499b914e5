"""Shoal: simulate and identify rigid-flexible machines.

`import shoal` costs nothing: each name is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shoal import library
    from shoal.client import Client
    from shoal.errors import ComputationError, InputError, ShoalError
    from shoal.identification import Estimate, Measurement, Problem, Recording, load_problem, problem_names
    from shoal.notebook import (
        compare,
        design,
        export,
        identify,
        linearize,
        modes,
        plot,
        prepare,
        reactions,
        select,
        simulate,
        statics,
        sweep,
        uncertain,
    )
    from shoal.scene import Scene, load_scene, scene_names
    from shoal.trajectory import Trajectory

__all__ = [
    "Client",
    "ComputationError",
    "Estimate",
    "InputError",
    "Measurement",
    "Problem",
    "Recording",
    "Scene",
    "ShoalError",
    "Trajectory",
    "compare",
    "design",
    "export",
    "identify",
    "library",
    "linearize",
    "load_problem",
    "load_scene",
    "modes",
    "plot",
    "prepare",
    "problem_names",
    "reactions",
    "scene_names",
    "select",
    "simulate",
    "statics",
    "sweep",
    "uncertain",
]


def __getattr__(name: str) -> Any:
    """A name of the list, imported on demand; notebooks then know how to show what it makes."""
    if name not in __all__:
        raise AttributeError(f"module 'shoal' has no attribute {name!r}")
    if name == "Client":
        from shoal.client import Client

        return Client
    if name == "library":
        # `from shoal import` would ask here again.
        import shoal.library as library

        return library
    from shoal import errors

    if hasattr(errors, name):
        return getattr(errors, name)
    from shoal import notebook, scene, trajectory

    for place in (notebook, scene, trajectory):
        if hasattr(place, name):
            return getattr(place, name)
    from shoal import identification

    return getattr(identification, name)


def __dir__() -> list[str]:
    return __all__
