"""Shoal: simulate and identify planar rigid-flexible machines.

`import shoal` costs nothing: each name is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shoal.identification import Estimate, Measurement, Problem, Recording, load_problem, problem_names
    from shoal.notebook import compare, identify, plot, select, simulate, sweep
    from shoal.scene import Scene, load_scene, scene_names
    from shoal.trajectory import Trajectory

__all__ = [
    "Estimate",
    "Measurement",
    "Problem",
    "Recording",
    "Scene",
    "Trajectory",
    "compare",
    "identify",
    "load_problem",
    "load_scene",
    "plot",
    "problem_names",
    "scene_names",
    "select",
    "simulate",
    "sweep",
]
_PLACES = {
    "shoal.scene": ("Scene", "load_scene", "scene_names"),
    "shoal.trajectory": ("Trajectory",),
    "shoal.identification": ("Estimate", "Measurement", "Problem", "Recording", "load_problem", "problem_names"),
    "shoal.notebook": ("compare", "identify", "plot", "select", "simulate", "sweep"),
}


def __getattr__(name: str) -> Any:
    """A name of the list, imported on demand; notebooks then know how to show what it makes."""
    for module, names in _PLACES.items():
        if name in names:
            import_module("shoal.notebook")
            return getattr(import_module(module), name)
    raise AttributeError(f"module 'shoal' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
