"""Machine: a scene assembled once, with everything that later computations need of it again.

Motions, places of rest, modes, reactions, sweeps and the choice of a model ask `Machine.of` for the machine of their
scene. Scenes that differ in how their motion is stepped alone share one: a run with half the step, or by another
integrator, assembles nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import numpy as np

from shoal.compile import progress
from shoal.mechanics.assembly.build import build
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.placement import place
from shoal.mechanics.integrators.scheme import Facts
from shoal.mechanics.model import Model
from shoal.scene import Scene, Solver
from shoal.scene.formula import Node

T = TypeVar("T")

MACHINES = 64
"""The machines of so many scenes are kept,"""
KEPT = 64
"""and of each so many results, the latest ones: a convention, as both bound memory alone."""
PACE = (
    "step",
    "integrator",
    "samples",
    "relative_tolerance",
    "absolute_tolerance",
    "max_step",
    "max_steps",
    "spectral_radius",
    "newton_tolerance",
    "energy_tolerance",
)
"""Settings of the solver that leave the machine as it is."""
_SHAPING = tuple(name for name in Solver.model_fields if name not in PACE)
_BUT_SOLVER = {"solver"}


class Machine:
    """A scene as the native solver sees it. Threads may share it.

    scene: a private copy, with the usual pace (`PACE`)
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._kept: dict[Hashable, Any] = {}

    @staticmethod
    def of(scene: Scene) -> Machine:
        """Return the machine of a scene, made now or for an earlier call; raises nothing."""
        solver = scene.solver
        settings = tuple([getattr(solver, name) for name in _SHAPING])
        # Whether the kind of an element was said decides what other values do to a scene.
        said = tuple(["element" in body.model_fields_set for body in scene.bodies.values()])
        content = scene.model_dump_json(exclude=_BUT_SOLVER), settings, solver.caps_inertia, said
        return _machine(_Content(content, scene))

    def kept(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what was made under this key before, or make it; every cache of a machine is this one."""
        found = self._kept.get(key)
        if found is None:
            found = self._kept.setdefault(key, make())
            for old in list(self._kept)[:-KEPT]:
                self._kept.pop(old, None)
        made: T = found
        return made

    @cached_property
    def placement(self) -> Placement:
        """The unknowns of all bodies and their start. Raises InputError if joints and start contradict each other."""
        progress.begin()
        return place(self.scene)

    def model(self, horizon: float = 0.0) -> Model:
        """Return the model, with functions of time up to `horizon` [s] at least. Raises InputError."""
        end = max(horizon, self.scene.solver.duration)
        return self.kept(("model", end), lambda: build(self.scene, horizon=end, placement=self.placement))

    def probed(self, probes: tuple[Node, ...], horizon: float) -> Model:
        """Return the model with formulas that are looked at; see `build`."""
        end = max(horizon, self.scene.solver.duration)
        return self.kept(
            ("probed", end, probes),
            lambda: build(self.scene, horizon=end, placement=self.placement, probes=probes),
        )


def step_limit(model: Model, integrator: Facts) -> float:
    """`stability.step_limit`, which takes a second to import, where anything can limit a step."""
    if not (model.elastic or model.forces.size or model.signals):
        return np.inf
    from shoal.mechanics import stability

    return stability.step_limit(model, integrator)


@dataclass(frozen=True)
class _Content:
    key: tuple[str, tuple[Any, ...], bool, tuple[bool, ...]]
    scene: Scene = field(compare=False)


@lru_cache(maxsize=MACHINES)
def _machine(content: _Content) -> Machine:
    kept = ("integrator",) if content.scene.solver.caps_inertia else ()
    usual = {name: Solver.model_fields[name].default for name in PACE if name not in kept}
    # What is kept does not change with the mappings of a scene that somebody else holds.
    scene = content.scene.model_copy(deep=True)
    return Machine(scene.model_copy(update={"solver": scene.solver.model_copy(update=usual)}))
