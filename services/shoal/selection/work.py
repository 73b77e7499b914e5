"""Forecast of the cost of a model: its stable step, and its work in steps of one cable element.

The highest frequency of a machine is about the highest of its rods, each taken with the others as coarse as can be. It
is computed on two elements and carried over to n: an axial mode goes as c / l, a bending mode as c r / l^2 (c^2 = E /
rho, r the radius of gyration of the section, l the element's length).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shoal.mechanics.simulate import stable_step
from shoal.scene import FRAMED, Rod, Scene
from shoal.selection.levels import SHEARS, Level, Levels, apply

INTEGRATOR = "leapfrog"
"""One force evaluation a step, and the longest stable step per evaluation of all explicit integrators."""
WEIGHT = {
    "rigid": 0.0,
    "ancf-cable": 1.0,
    "ancf-quintic": 1.5,
    "ancf-full": 5.0,
    "modal": 0.0,
    "simo-reissner": 2.3,
    "director-rod": 30.0,
}
"""Work of one element in one step, in terms of a cable's; measured on meshes of 16 elements. Directors are held by
constraints, which each step solves."""
STEP_WORK = 3.0
"""Work of a step beside its elements."""
CONSTRAINED, CONSTRAINT = 12.0, 5.0
"""More of it where there are constraints, and for each of them."""
_BENDING = {"ancf-cable": 4.7, "ancf-quintic": 16.8, "director-rod": 4.6}
"""A bending mode is the fastest one of an element whose length is below so many radii of gyration."""


class Forecast:
    """Work of the models of one scene.

    coarse: of the rods whose model is open the coarsest levels; fewest: numbers of elements by which they can bend,
    else those of coarse
    """

    def __init__(self, scene: Scene, coarse: Levels, fewest: Mapping[str, int] | None = None) -> None:
        self.scene, self.coarse = scene, coarse
        self.fewest = fewest or {rod: level.elements for rod, level in coarse.items()}
        self._steps: dict[tuple[str, Level], float] = {}

    def step(self, levels: Levels) -> float:
        """The stable step [s] as foreseen; infinite if nothing is elastic."""
        return float(min((self._rod_step(name, level) for name, level in levels.items()), default=np.inf))

    def work(self, levels: Levels) -> float:
        """Work of a run with leapfrog at its longest step, in steps of one cable element; 0 for rigid rods."""
        rows = sum(_rows(level) for level in levels.values())
        each = sum(WEIGHT[level.element] * level.elements for level in levels.values())
        each += STEP_WORK + (CONSTRAINED + CONSTRAINT * rows if rows else 0.0)
        return float(self.scene.solver.duration / self.step(levels) * each)

    def _rod_step(self, name: str, level: Level) -> float:
        if level.element == "rigid":
            return np.inf
        few = max(2, self.fewest[name])
        # few elements shear, many stretch
        probe = level if level.element in (SHEARS, "modal") else Level(level.element, few)
        key = (name, probe)
        if key not in self._steps:
            self._steps[key] = stable_step(apply(self.scene, {**self.coarse, name: probe}), INTEGRATOR)
        rod = self.scene.bodies[name]
        assert isinstance(rod, Rod)
        if level.element not in _BENDING:  # the thickness mode does not know the length of its element
            return self._steps[key]
        gyration = max(max(rod.section_at(x).gyration(self.scene.dimensions)) for x in (0, 1))
        turn = rod.length / (_BENDING[level.element] * gyration)

        def growth(n: int) -> float:
            return float(n * max(1.0, n / turn))

        return float(self._steps[key] * growth(few) / growth(level.elements))

    def own(self, name: str, level: Level) -> float:
        """Work of one rod by itself, as if the others were as coarse as can be."""
        each = WEIGHT[level.element] * level.elements + CONSTRAINT * _rows(level)
        return float(each / self._rod_step(name, level))


def _rows(level: Level) -> int:
    """Constraints of a rod: that its direction has unit length, and for each mode that its vector is along it.

    Those of directors are part of WEIGHT.
    """
    return 1 + level.modes if level.element in FRAMED else 0
