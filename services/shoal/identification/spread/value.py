"""A number that was estimated, with its interval."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Value:
    """An estimated number: its standard deviation, and a 95 % interval (Student's t) with the model's own error in it.

    correction: what a mesh twice as fine with shorter steps would add to the value, of rigid machines the steps alone,
    None if not computed; it is not added, but is in the interval
    theory: what shear and rotary inertia would add where slender beams neglect them; likewise
    unit: of all of them, empty where there is none or none is known
    fixed: whether the data limit it at all; an estimate tells neither deviation nor interval of what they do not
    """

    value: float
    std: float
    lower: float
    upper: float
    identifiable: bool
    correction: float | None = None
    at_bound: bool = False
    unit: str = ""
    theory: float | None = None
    fixed: bool = True

    def told(self) -> Value:
        """As an estimate tells it: theory to first order knows nothing along what is open, nor beyond a bound."""
        return replace(self, std=np.nan, lower=np.nan, upper=np.nan) if self.at_bound or not self.fixed else self

    def exponential(self) -> Value:
        """The value of a parameter that was sought by its logarithm."""
        value = float(np.exp(self.value))
        correction = None if self.correction is None else value * self.correction
        with np.errstate(over="ignore"):
            lower, upper = float(np.exp(self.lower)), float(np.exp(self.upper))
        theory = None if self.theory is None else value * self.theory
        return replace(
            self, value=value, std=value * self.std, lower=lower, upper=upper, correction=correction, theory=theory
        )
