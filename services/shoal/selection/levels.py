"""Hierarchy of models of one rod, from rigid to ever more elements.

The accuracy of n quintic elements needs about 2 n cubic cables of reduced quadrature, whose work is about the same for
small n and more beyond. So cables are the coarse end of the elements and quintic ones the fine end. A few modes in a
floating frame, below them, leave out stretching and large bending; their steps are as much longer as a rod is slender.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.scene import FRAMED, Rod, Scene
from shoal.scene.dimensions import is_flat

_SHORT = {"ancf-cable": "cable", "ancf-quintic": "quintic", "ancf-full": "full", "simo-reissner": "reissner"}
"""Elements in the names of models."""


@dataclass(frozen=True)
class Level:
    """A model of one rod: its element and the number of elements, or of modes where it bends by modes.

    rotary: whether the sections of a rigid or modal rod have rotary inertia
    """

    element: str
    elements: int = 1
    rotary: bool = False
    modes: int = 0

    def fields(self, rod: Rod) -> dict[str, Any]:
        """Return the fields that give a rod this model."""
        values: dict[str, Any] = {"element": self.element}
        if self.element != "rigid" or rod.element == "modal":
            values |= rod.by_elements(self.element, self.elements)
        if self.element != "rigid":
            light = self.element == "ancf-cable" and not (rod.retardation or rod.curvature)
            values["quadrature"] = "reduced" if light else "full"
        if self.rotary or self.element != "rigid":
            values["rotary_inertia"] = self.rotary
        if self.modes:
            values |= {"modes": self.modes, "axial_modes": 0, "ends": None}
        return values


Levels = Mapping[str, Level]
"""Levels of the rods whose model is open; the other bodies stay as the scene states them."""


def words(levels: Levels) -> str:
    """Describe levels, such as `upper 1, lower 2 quintic, third rigid`: rods of one element together."""
    rods: dict[str, list[str]] = {}
    for rod, level in levels.items():
        counted = rod if level.element == "rigid" else f"{rod} {level.modes or level.elements}"
        rods.setdefault(level.element, []).append(counted)
    return ", ".join(f"{', '.join(named)} {_SHORT.get(element, element)}" for element, named in rods.items())


RIGID = Level("rigid")
STOUT = Level("rigid", rotary=True)


def cable(n: int) -> Level:
    """Return the level of n cubic cable elements."""
    return Level("ancf-cable", n)


def quintic(n: int) -> Level:
    """Return the level of n quintic elements."""
    return Level("ancf-quintic", n)


def modal(n: int, rotary: bool = False) -> Level:
    """Return the level of n bending modes in a floating frame."""
    return Level("modal", rotary=rotary, modes=n)


MODES = 1, 2, 4
COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 1536, 2048)
SLENDER, SHEARS = "ancf-quintic", "simo-reissner"
"""The elements whose limits are the truth of slender rods, and in the plane of those with shear and rotary inertia."""
LADDERS = {
    SLENDER: (
        *(RIGID, *(modal(n) for n in MODES)),
        *(cable(1), cable(2), quintic(1), cable(3), cable(4)),
        *(quintic(n) for n in COUNTS if n > 1),
    ),
    "ancf-full": (RIGID, *(Level("ancf-full", n) for n in COUNTS)),
    SHEARS: (STOUT, *(modal(n, rotary=True) for n in MODES), *(Level(SHEARS, n) for n in COUNTS)),
    "director-rod": (RIGID, *(Level("director-rod", n) for n in COUNTS)),
}
"""Levels from coarse to fine, by the element whose limit is the truth."""

FEWEST = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
"""First numbers of elements of refinements; all that follow by doubling are among COUNTS."""
REFINEMENTS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048)
"""Numbers of these elements in the models by which errors are estimated."""
WOUND = 256
"""Largest first number of elements of a wound rod."""


def below(level: Level, limit: str, coarsest: Level) -> tuple[Level, ...]:
    """Return the coarser levels, the finest first, of a rod whose truth is the limit of that element."""
    ladder = LADDERS[limit]
    return tuple(reversed(ladder[ladder.index(coarsest) : ladder.index(level)]))


def open_rods(scene: Scene) -> dict[str, str]:
    """Return the rods whose model is open, and the element whose limit is their truth: the finest of its theory.

    Bernoulli-Euler's beam, unless the scene names simo-reissner or ancf-full, which have shear, or director-rod, which
    twists. A rigid rod that leaves the plane may twist. Raises InputError for an element that is on no ladder.
    """
    finest = dict.fromkeys(("ancf-cable", "modal", SLENDER), SLENDER)
    finest["rigid"] = "director-rod" if scene.dimensions == 3 and not is_flat(scene) else SLENDER
    limits = {
        name: finest.get(body.element, body.element)
        for name, body in scene.bodies.items()
        if isinstance(body, Rod) and body.modulus is not None
    }
    for name, limit in limits.items():
        if limit not in LADDERS:
            known = ", ".join(dict.fromkeys((*finest, *LADDERS)))
            raise InputError(
                f"bodies.{name}.element: models are chosen of {known}, not of {limit}; state its number of elements "
                "instead of a tolerance"
            )
    return limits


def coarsest(scene: Scene, limits: Mapping[str, str], meshed: Collection[str] = ()) -> dict[str, Level]:
    """Return the coarsest levels of rods. limits: the element whose limit is the truth of each; meshed: see `select`.

    They are rigid, except for curved or twisted director rods, whose elements turn by a right angle at most.
    Raises InputError where that takes too many elements.
    """
    return {rod: _coarsest(rod, scene.bodies[rod], limit, rod in meshed) for rod, limit in limits.items()}


def _coarsest(name: str, rod: Any, limit: str, meshed: bool) -> Level:
    if limit != "director-rod" or rod.straight:
        return next(level for level in LADDERS[limit] if not meshed or level.element not in FRAMED)
    few = next((n for n in REFINEMENTS if rod.winding <= n * np.pi / 2 and n <= WOUND), None)
    if few is None:
        raise InputError(
            f"bodies.{name}.element: models are chosen of rods that wind by {WOUND * np.pi / 2:.3g} rad at "
            f"most, and {name} does by {rod.winding:.3g}; state its number of elements instead of a tolerance"
        )
    return Level(limit, few)


def apply(scene: Scene, levels: Levels) -> Scene:
    """Return the scene with these levels. Raises InputError where a joint does not suit a flexible rod."""
    return scene.with_values(fields(scene, levels))


def fields(scene: Scene, levels: Levels) -> dict[str, Any]:
    """Return the values of a scene that give its rods these levels."""
    rods = {name: scene.bodies[name] for name in levels}
    return {
        f"bodies.{name}.{field}": value
        for name, rod in rods.items()
        if isinstance(rod, Rod)
        for field, value in levels[name].fields(rod).items()
    }
