"""What was taken as known and is freed: its numbers, the machine that has them, and how their effect is probed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.problem import Parameter
from shoal.identification.recording.units import unit
from shoal.scene import Scene
from shoal.trajectory import Array

_TINY = 1e-9
_NEAR = 1.04
"""An effect that goes with one over a number is followed by this factor from where it was probed."""


@dataclass(frozen=True)
class FaultHypothesis:
    """Its name, its numbers as parameters, and their stated values, at which it is no fault (or infinite).

    probes: values whose effects are measured, (ways, effects, numbers): the residual is regressed on the effects of
        each way, and the best counts; bases: where the effects of each way vanish, (ways, numbers)
    law: how the effect grows: with a number, with its logarithm, or with one over it
    kind: of the suspect that it may become; scene: the machine that has its paths, None for the model's own
    alone: whether no other number may be freed beside it; factor: whether its change is told as a factor
    tell: its size and its change in words, from its numbers; None for the usual words
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
    tell: Callable[[Array], tuple[float, str]] | None = None

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
        """Of its numbers."""
        return {str(parameter.path) for parameter in self.parameters}

    def freed(self, model: ForwardModel) -> ForwardModel:
        """The model with its numbers as further parameters, at the end."""
        return with_parameters(model, [self])

    def vector(self, values: Array) -> Array:
        """Values as the components of a point, (numbers,)."""
        both = zip(values, self.parameters, strict=True)
        return np.array([np.log(max(x, _TINY * p.upper)) if p.logarithmic else x for x, p in both])

    def at(self, way: int, amounts: Array) -> Array:
        """The values within their bounds at which the effects are so many times those of the probes, (numbers,)."""
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

    def told(self, values: Array) -> tuple[float, str]:
        """The value that a suspect tells, and stated and other value in words."""
        if self.tell is not None:
            return self.tell(values)
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
