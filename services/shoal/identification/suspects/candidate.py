"""One number that was taken as known and is freed, with the machine in which it can be."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.problem import Parameter
from shoal.identification.units import unit
from shoal.scene import Scene
from shoal.trajectory import Array

_TINY = 1e-9


@dataclass(frozen=True)
class Candidate:
    """Its name, the value stated, the parameter that frees it, and the value by which its effect is measured.

    scene: the machine that has its path, None for the model's own; kind: of the suspect that it may become
    factor: whether a change of it is told as a factor; inverse: whether its effect goes with one over it, so that
    the value stated is infinite
    """

    name: str
    stated: float
    parameter: Parameter
    probe: float
    kind: str
    scene: Scene | None = None
    factor: bool = False
    inverse: bool = False

    @property
    def key(self) -> str:
        """Name of its parameter in a problem."""
        return f"suspect {self.name}"

    def freed(self, model: ForwardModel) -> ForwardModel:
        """The model with it as one more parameter, at the end."""
        return with_parameters(model, [self])

    def vector(self, value: float) -> float:
        """A value as the component of a point."""
        return float(np.log(max(value, _TINY * self.parameter.upper))) if self.parameter.logarithmic else value

    def at(self, amount: float) -> float:
        """The value within its bounds at which the effect is so many times that of the probe, to first order."""
        if self.inverse:
            value = self.probe / max(amount, 1e-6)
        elif self.parameter.logarithmic:
            value = self.stated * (self.probe / self.stated) ** np.clip(amount, -1e5, 1e5)
        else:
            value = self.stated + amount * (self.probe - self.stated)
        return float(np.clip(value, self.parameter.lower, self.parameter.upper))

    def amount(self, value: float) -> float:
        """The inverse of `at`."""
        if self.inverse:
            return self.probe / value
        if self.parameter.logarithmic:
            return float(np.log(value / self.stated) / np.log(self.probe / self.stated))
        return (value - self.stated) / (self.probe - self.stated)

    def change(self, value: float) -> str:
        """Stated and other value in words."""
        if self.factor:
            return f"a factor of {value / self.stated:.4g}"
        stated = "infinitely much" if self.inverse else f"{self.stated:g}"
        return f"a value of {value:.4g} instead of {stated} {unit(self.parameter.path or '')}".rstrip()


def with_parameters(model: ForwardModel, candidates: list[Candidate]) -> ForwardModel:
    """The model with candidates of one and the same machine as further parameters, at the end."""
    more = {candidate.key: candidate.parameter for candidate in candidates}
    problem = model.problem.model_copy(update={"parameters": {**model.problem.parameters, **more}})
    scene = candidates[0].scene or model.scene
    return replace(model, problem=problem, scene=scene, memory=None, whole=None)


def extended(point: Array, candidate: Candidate, value: float) -> Array:
    """A point with a value of the candidate at its end."""
    return np.append(point, candidate.vector(value))
