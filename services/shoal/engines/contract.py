"""The one contract behind which every engine stands, ours and others'."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np

from shoal.arguments import numbers
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

Extremes = dict[tuple[str, ...], list[tuple[float, float]]]
"""The least and the most of each of some paths that a scene accepts together, by these paths."""


@dataclass(frozen=True)
class Capabilities:
    """Capabilities of an engine, which comparisons, refusals and tests read.

    elements, joints, loads: kinds, by the names a scene uses
    features: requirements of scenes beyond these (see `capabilities.FEATURES`)
    lanes: whether many scenes run side by side in one compiled call
    """

    elements: frozenset[str]
    joints: frozenset[str]
    loads: frozenset[str]
    features: frozenset[str]
    lanes: bool

    @property
    def all(self) -> frozenset[str]:
        """Every name the engine knows; kinds and features have no name in common."""
        return self.elements | self.joints | self.loads | self.features


class Engine(Protocol):
    """Simulates scenes. Bad input raises InputError; a run that failed carries its status."""

    @property
    def name(self) -> str:
        """Name by which the engine is chosen."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """Return what the engine can simulate."""
        ...

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        """Run one scene; `times` [s] are the requested sampling instants, else the scene's own."""
        ...

    def simulate_many(
        self, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        """Run one scene per lane; `values` maps a path in the scene to one number per lane."""
        ...


def sampling_times(scene: Scene, times: Sequence[float] | Array | None) -> Array:
    """Return the requested instants [s] as an increasing array of its own, else the scene's, from 0 on.

    Raises InputError.
    """
    if times is None:
        return np.linspace(0.0, scene.solver.duration, scene.solver.samples + 1)
    wanted = numbers("at", times, "times in s")
    if wanted[0] < 0:
        raise InputError(f"at: must start at or after 0 s, found {wanted[0]:g}")
    if np.any(falls := np.diff(wanted) <= 0):
        first = int(np.argmax(falls))
        raise InputError(f"at: must increase, found {wanted[first + 1]:g} after {wanted[first]:g} s")
    return wanted


def check_lanes(scene: Scene, values: Mapping[str, Array], accepted: Extremes | None = None) -> int:
    """Number of lanes in `values`, after the scene accepted the extremes of each, or whole lanes. Raises InputError.

    Of numbers that limit each other (`Scene.bound_together`) it accepted the extremes with each other. accepted: the
    extremes of earlier calls, which these widen; what lies between them is accepted too.
    """
    values = {path: numbers(path, lanes) for path, lanes in values.items()}
    sizes = {path: lanes.size for path, lanes in values.items()}
    if len(set(sizes.values())) != 1:
        raise InputError(f"lanes: every path needs as many numbers as the others, found {sizes}")
    known, count = {} if accepted is None else accepted, next(iter(sizes.values()))
    for group in (*((path,) for path in values), *scene.bound_together(values)):
        ends = [(float(np.min(values[path])), float(np.max(values[path]))) for path in group]
        before = known.get(group, [(np.inf, -np.inf)] * len(group))
        wider = [(min(low, least), max(high, most)) for (low, high), (least, most) in zip(ends, before, strict=True)]
        if wider != before:
            try:
                for corner in product(*wider):
                    scene.with_values(dict(zip(group, corner, strict=True)))
            except InputError:
                if len(values) == 1:
                    raise
                # What cannot be beside the other numbers of the scene may be beside those of its lane.
                for k in range(count):
                    scene.with_values({name: float(column[k]) for name, column in values.items()})
                return count
            known[group] = wider
    return count
