"""Normal stress along rods that bend, by their section forces: |N| / A + |M| c / I at the outermost fibre.

Section forces are in balance with the loads on any mesh (`analysis.sections`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.scene import Rod, Scene
from shoal.trajectory import Array, Trajectory

LEVELS = 24
"""Colours of a scale: neighbours are hardly told apart."""
_UNITS = ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))
_ROUND = ("round", "tube")


@dataclass(frozen=True)
class Stress:
    """Largest normal stress of sections by bending and normal force [Pa], by rod, (frames, points)."""

    values: Mapping[str, Array]

    @property
    def most(self) -> float:
        """The largest of all [Pa]."""
        return max((float(np.max(one)) for one in self.values.values()), default=0.0)

    @property
    def scale(self) -> tuple[float, str]:
        """The end of the scale in a unit, and the unit."""
        size, unit = next((one for one in _UNITS if self.most >= one[0]), _UNITS[-1])
        return self.most / size, unit

    def levels(self, rod: str) -> Array:
        """Return numbers of colours, (frames, points)."""
        share = self.values[rod] / (self.most or 1.0)
        return np.minimum(LEVELS - 1, (LEVELS * share)).astype(int)


def stress_along(run: Trajectory, scene: Scene, points: Mapping[str, int]) -> Stress:
    """Return the stress of a run with its states; points: how many along each rod.

    Of rods of elements whose section has a shape; in space round ones, and director rods, which know their axes.
    Raises InputError where there is no such rod.
    """
    from shoal.mechanics.analysis.felt import lanes_of  # slow to import
    from shoal.mechanics.analysis.free_bodies import FreeBodies
    from shoal.mechanics.analysis.sections import EndForces, sections

    rods = {name: rod for name, rod in scene.flexible_rods.items() if _is_known(scene, rod)}
    if not rods:
        raise InputError(
            f"stress: no rod of {scene.name} has a stress that is known; it needs elements and a section with a shape, "
            "in space a round one or element director-rod"
        )
    if run.states is None:
        raise InputError(f"stress: engine {run.engine} does not give coordinates; use gauss")
    felt = next(iter(lanes_of(run.states, run.times, [0])))
    free = FreeBodies(felt.evaluator, float(run.times[-1]))
    found: dict[str, list[Array]] = {name: [] for name in rods}
    axes = {name: _section_axes(felt, rod, name) for name, rod in rods.items()}
    for k, (q, v, a, turns, t) in enumerate(zip(felt.q, felt.v, felt.a, felt.turns, felt.times.tolist(), strict=True)):
        felt.evaluator.turns = turns
        for name, rod in rods.items():
            ends = sections(felt.evaluator, q, v, a, t, name, bodies=free)
            if isinstance(ends, EndForces):
                along, across = ends.moment, np.zeros_like(ends.moment)
            else:
                across_axes = axes[name]
                along, across = _bending(ends, None if across_axes is None else across_axes[:, k])
            section = rod.section_at(ends.s / rod.length)
            value = _largest(rod, section, ends.normal, along, across)
            known = np.isfinite(value)
            places = np.linspace(0.0, rod.length, points[name])
            filled = np.interp(places, ends.s[known], value[known]) if np.any(known) else np.zeros(len(places))
            found[name].append(filled)
    return Stress({name: np.array(values) for name, values in found.items()})


def _is_known(scene: Scene, rod: Rod) -> bool:
    if rod.element == "modal" or rod.section == "numbers":
        return False
    return scene.dimensions == 2 or rod.section in _ROUND or rod.element == "director-rod"


def _largest(rod: Rod, section: Any, normal: Array, along: Array, across: Array) -> Array:
    """Return |N| / A and the stresses of both bendings at the outermost fibre; round sections bend about one axis."""
    axial, height, width = np.abs(normal) / section.area, section.height / 2, section.width / 2
    if rod.section in _ROUND:
        return np.asarray(axial + np.hypot(along, across) * height / section.bending)
    return np.asarray(axial + np.abs(along) * height / section.bending + np.abs(across) * width / section.side)


def _bending(ends: Any, axes: Array | None) -> tuple[Array, Array]:
    """Return moments about the local z and y axes; about any two across a round rod, which knows no axes."""
    bending = ends.moment - ends.torque[:, None] * ends.tangent
    if axes is None:
        return np.linalg.norm(bending, axis=1), np.zeros(len(bending))
    return np.sum(axes[:, 2] * bending, axis=1), np.sum(axes[:, 1] * bending, axis=1)


def _section_axes(felt: Any, rod: Rod, name: str) -> Array | None:
    """Return the axes of the sections of a director rod at both ends of its elements, as rows.

    (2 elements, frames, 3, 3)
    """
    if rod.element != "director-rod":
        return None
    from shoal.mechanics.analysis import triads  # slow to import

    frame = felt.evaluator.model.frames[name]
    step = rod.length / rod.elements
    places = [(number + end) * step for number in range(rod.elements) for end in (0, 1)]
    return np.array([triads.along(frame, (s, 0.0, 0.0), felt.q, felt.v, felt.lane)[0] for s in places])
