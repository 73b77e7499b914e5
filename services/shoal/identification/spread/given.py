"""What a fit takes as given though it is known with an uncertainty: to first order, what that does to the answer.

No residual shows it: the model has the given values. The answer moves against what other values change of the channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shoal.findings import Finding
from shoal.identification.findings import UNCERTAIN_INPUT
from shoal.identification.spread.covariance import Noise
from shoal.identification.spread.uncertainty import Linearisation
from shoal.trajectory import Array

EXACT = 1e9
"""Freedom of a variance that is stated."""
_NOTICED = 0.2
"""Of a variance: the part of something given from which on it is said."""


@dataclass(frozen=True)
class Given:
    """moved: what independent standard deviations of it change of the residuals, (n, rows); freedom: of their size.

    what: in words, as the subject of a sentence; remedy: what would help, as the end of one
    one_of_many: whether it might as well have been something else, so that a systematic residual counts too
    """

    moved: Array
    freedom: float
    what: str
    remedy: str = ""
    one_of_many: bool = False

    def left(self, jacobian: Array, pseudo_inverse: Array) -> float:
        """Size of the residual that it leaves beside what the parameters follow, root mean square.

        Of rows that have derivatives: later ones of a chaotic motion are not compared.
        """
        rest = (self.moved - (self.moved @ pseudo_inverse.T) @ jacobian.T)[:, np.any(jacobian != 0.0, axis=1)]
        return float(np.sqrt(np.sum(rest**2) / max(rest.shape[1], 1)))

    def spread(self, at: Linearisation) -> Linearisation:
        """The linearisation with its share in the covariance."""
        noise = Noise(0.0, 0.0, self.freedom)
        parts = np.concatenate([at.parts, self._share(at)[None]])
        return replace(at, parts=parts, noise=(*at.noise, noise), given=at.given + 1)

    def findings(self, at: Linearisation, names: Sequence[str]) -> list[Finding]:
        """Return which parameters it makes less certain, at a linearisation that has its share, if any."""
        shares, variance = np.diag(self._share(at)), np.diag(at.covariance)
        widened = [name for name, part, all_ in zip(names, shares, variance, strict=True) if part > _NOTICED * all_ > 0]
        text = f"{self.what} widens the interval of {', '.join(widened)}{self.remedy}"
        return [UNCERTAIN_INPUT.found(text)] if widened else []

    def _share(self, at: Linearisation) -> Array:
        shifts = self.moved @ at.pseudo_inverse.T
        return np.asarray(shifts.T @ shifts)
