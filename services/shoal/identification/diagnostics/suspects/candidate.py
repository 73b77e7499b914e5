"""A machine by order of magnitude: what its frictions, rates and records are measured against."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from shoal.identification.conventions import ROUND_OFF
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import Descent, descend_each, difference_at
from shoal.identification.methods.least_squares import PATIENCE
from shoal.identification.problem import Parameter
from shoal.identification.recording.units import unit
from shoal.mechanics.numerics.tile import WIDE
from shoal.mechanics.reach import span
from shoal.scene import Scene
from shoal.scene.joints import places
from shoal.trajectory import Array

_EARTH = 9.81
"""Standard gravity [m/s^2], by which a machine without gravity is scaled."""


@dataclass(frozen=True)
class Size:
    """Mass [kg], length of its largest body and how far it reaches [m], and its gravity, that of the earth if none."""

    mass: float
    length: float
    reach: float
    gravity: float

    @property
    def rate(self) -> float:
        """Angular frequency of a swing [rad/s]."""
        return float(np.sqrt(self.gravity / self.length))


def size_of(scene: Scene) -> Size:
    """The size of a machine."""
    lengths = [max(float(np.linalg.norm(place)) for place in body.points.values()) for body in scene.bodies.values()]
    ground = [
        float(np.linalg.norm(side.point))
        for joint in scene.joints.values()
        for side in places(joint)
        if side.body == "ground" and not isinstance(side.point, str)
    ]
    mass = sum(float(body.mass) for body in scene.bodies.values())
    gravity = float(np.linalg.norm(scene.gravity)) or _EARTH
    # A point on a slider has no extent; how far its start or its spring is limits how far it goes.
    reach = sum(lengths) + max(ground, default=0.0) or span(scene)
    return Size(mass, max([*lengths, 1e-3]), reach, gravity)


FACTOR = 2.0
"""A positive number that is stated (a mass, a clock) is looked for within this factor."""
PROBE = 1e-4
"""Change by which an effect is measured, relative to the range that is looked for. From 1e-5 to 1e-3 the effects of
friction laws, which differ least, are the same to four digits; at 1e-6 the accuracy of the integrator hides what
distinguishes them.
"""
_NEAR = 1.04
"""An effect that goes with one over a number is followed by this factor from where it was probed."""


@dataclass(frozen=True)
class FaultHypothesis:
    """Its name, its numbers as parameters, and their stated values, at which it is no fault (or infinite).

    probes: values whose effects are measured, (ways, effects, numbers): the residual is regressed on the effects of
        each way, and the best counts; bases: where the effects of each way vanish, (ways, numbers)
    law: how the effect grows: with a number, with its logarithm, or with one over it
    kind: of the suspect that it may become; scene: the machine that has its paths, None for the model's own
    alone: whether no other number may be freed beside it; factor: whether its change is given as a factor
    describe: its size and its change in words, from its numbers; None for the usual words
    """

    name: str
    kind: str
    parameters: tuple[Parameter, ...]
    stated: tuple[float, ...]
    probes: Array
    bases: Array
    law: Literal["linear", "log", "inverse"] = "linear"
    scene: Scene | None = None
    alone: bool = False
    factor: bool = False
    describe: Callable[[Array], tuple[float, str]] | None = None

    @classmethod
    def single(
        cls,
        name: str,
        path: str,
        stated: float,
        bounds: tuple[float, float],
        probe: float,
        kind: str = "machine",
        *,
        law: Literal["linear", "log"] = "linear",
        scene: Scene | None = None,
        alone: bool = False,
        factor: bool = False,
        own: tuple[str, ...] = (),
    ) -> FaultHypothesis:
        """One number between bounds, whose effect is measured at one other value; own: of these recordings alone."""
        free = Parameter(path=path, lower=bounds[0], upper=bounds[1], scale=law, own=own or False)
        probes, bases = np.array([[[probe]]]), np.array([[stated]])
        return cls(name, kind, (free,), (stated,), probes, bases, law, scene, alone, factor)

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of its parameters in a problem."""
        return tuple(f"suspect {self.name} {k}" for k in range(len(self.parameters)))

    @property
    def paths(self) -> set[str]:
        """Paths of its numbers."""
        return {str(parameter.path) for parameter in self.parameters}

    def freed(self, model: ForwardModel) -> ForwardModel:
        """The model with its numbers as further parameters, at the end."""
        return with_parameters(model, [self])

    def vector(self, values: Array) -> Array:
        """Values as the components of a point, (numbers,)."""
        both = zip(values, self.parameters, strict=True)
        return np.array([np.log(max(x, ROUND_OFF * p.upper)) if p.logarithmic else x for x, p in both])

    def at(self, way: int, amounts: Array) -> Array:
        """Values within their bounds at which the effects are these multiples of the probes', (numbers,)."""
        base, probes = self.bases[way], self.probes[way]
        if self.law == "inverse":
            values = probes[0] / np.clip(amounts[0], 1 / _NEAR, _NEAR)
        elif self.law == "log":
            values = base * (probes[0] / base) ** np.clip(amounts[0], -1e5, 1e5)
        else:
            values = base + amounts @ (probes - base)
        lower, upper = (np.array([getattr(p, end) for p in self.parameters]) for end in ("lower", "upper"))
        return np.asarray(np.clip(values, lower, upper))

    def amounts(self, way: int, values: Array) -> Array:
        """The inverse of `at` for one number; of several, that of their nearest combination, (effects,)."""
        base, probes = self.bases[way], self.probes[way]
        if self.law == "inverse":
            return np.asarray(probes[0] / values)
        if self.law == "log":
            return np.asarray(np.log(values / base) / np.log(probes[0] / base))
        return np.asarray(np.linalg.lstsq((probes - base).T, values - base)[0])

    def described(self, values: Array) -> tuple[float, str]:
        """The value that a suspect names, and stated and other value in words."""
        if self.describe is not None:
            return self.describe(values)
        value, stated = float(values[0]), self.stated[0]
        if self.factor:
            return value, f"a factor of {value / stated:.4g}"
        known = "infinitely much" if np.isinf(stated) else f"{stated:g}"
        return value, f"a value of {value:.4g} instead of {known} {unit(self.parameters[0].path or '')}".rstrip()


def with_parameters(model: ForwardModel, candidates: list[FaultHypothesis]) -> ForwardModel:
    """The model with candidates of one and the same machine as further parameters, at the end."""
    more = {key: p for c in candidates for key, p in zip(c.keys, c.parameters, strict=True)}
    problem = model.problem.model_copy(update={"parameters": {**model.problem.parameters, **more}})
    scene = candidates[0].scene or model.scene
    return model.aside(problem=problem, scene=scene)


_ITERATIONS = 15
"""Gauss-Newton steps of a refit at most: a fault that is near is found in a few, others are followed later."""


def groups_of(candidates: Iterable[FaultHypothesis]) -> list[list[FaultHypothesis]]:
    """Candidates of one machine that can be freed beside each other."""
    groups = dict[int, list[FaultHypothesis]]()
    for candidate in candidates:
        groups.setdefault(id(candidate if candidate.alone else candidate.scene), []).append(candidate)
    return list(groups.values())


@dataclass(frozen=True, eq=False)
class Together:
    """A model with all numbers of a group of candidates, of which each point changes those of one."""

    model: ForwardModel
    group: list[FaultHypothesis]

    @cached_property
    def _union(self) -> ForwardModel:
        return with_parameters(self.model, self.group)

    @cached_property
    def _begins(self) -> list[int]:
        sizes = [len(candidate.parameters) for candidate in self.group]
        return list(len(self.model.names) + np.cumsum([0, *sizes[:-1]]))

    def residuals(self, numbers: Sequence[int], points: Sequence[Array]) -> Array:
        """At points (parameters and the candidate's numbers,) of candidates by number, (points, rows). Not counted."""
        union, known = self._union, len(self.model.names)
        stated = np.concatenate([c.vector(np.nan_to_num(c.stated, posinf=1e300)) for c in self.group])
        stated = np.clip(stated, union.lower[known:], union.upper[known:])
        lanes = np.tile(np.append(np.zeros(known), stated), (len(points), 1))
        for lane, k, point in zip(lanes, numbers, points, strict=True):
            lane[:known] = point[:known]
            lane[self._begins[k] : self._begins[k] + len(point) - known] = point[known:]
        return union.uncounted(lanes)

    def fit(self, numbers: Sequence[int], starts: Sequence[Array]) -> list[Descent]:
        """Descend from a start for each of some candidates."""
        models = [self.group[k].freed(self.model) for k in numbers]

        def differentiate(chosen: Sequence[int], points: Sequence[Array]) -> tuple[list[Array], list[Array]]:
            # A point and its neighbours stand in one tile, which has one step: see `differentiate_many`.
            most = 1 + max(len(point) for point in points)
            block = next((size for size in (2, 4, 8, len(WIDE)) if size >= most), most)
            steps = [difference_at(models[k], point) for k, point in zip(chosen, points, strict=True)]
            lanes, owners = list[Array](), list[int]()
            for k, point, step in zip(chosen, points, steps, strict=True):
                beside = [point, *(point + step * unit for unit in np.eye(len(point)))]
                lanes += beside + [point] * (block - len(beside))
                owners += [numbers[k]] * block
            seen = self.residuals(owners, lanes).reshape(len(points), block, -1)
            jacobians = list[Array]()
            for found, step in zip(seen, steps, strict=True):
                with np.errstate(invalid="ignore"):
                    slope = ((found[1 : 1 + len(step)] - found[0]) / step[:, None]).T
                jacobians.append(np.where(np.isfinite(slope), slope, 0.0))
            return list(seen[:, 0]), jacobians

        return descend_each(models, starts, differentiate, patience=PATIENCE, most=_ITERATIONS)
