"""The force of surfaces that give way where they touch."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from shoal.scene.record import NonNegative, Positive, Record


class ContactLaw(Record):
    """The force of a contact that gives way by a depth d: stiffness d^exponent (1 + damping d') + viscosity d'.

    Hertz's law, Hunt's and Crossley's (1975) and a spring with a damper are of this form.
    """

    stiffness: Positive
    """Force at a depth of 1 m [N/m^exponent]."""
    exponent: Annotated[float, Field(ge=1)] = 1.5
    """Power of the depth [1]: 1.5 of Hertz's law for spheres, 1 of a spring."""
    damping: NonNegative = 0.0
    """Part of the force by the rate of the depth [s/m], of Hunt and Crossley."""
    restitution: Annotated[float, Field(gt=0, le=1)] | None = None
    """Rate after an impact of free bodies over that before [1], from which `damping` follows at each touch."""
    viscosity: NonNegative = 0.0
    """Force by the rate of the depth [N s/m]; where both pull, the contact opens."""

    @model_validator(mode="after")
    def _one_damping(self) -> ContactLaw:
        if self.restitution is not None and (np.any(self.damping) or np.any(self.viscosity)):
            raise ValueError("restitution: damping or viscosity is stated as well; state one of them")
        return self

    @property
    def numbers(self) -> tuple[Any, ...]:
        """Return stiffness, exponent, damping, damping times the rate at which the contact is met, and viscosity."""
        loss = 0.0 if self.restitution is None else np.vectorize(loss_of)(self.restitution)
        return self.stiffness, self.exponent, self.damping, loss, self.viscosity


def loss_of(e: float) -> float:
    """Return damping times the rate v before, x, for a restitution e: ln((1 + x) / (1 - e x)) = (1 + e) x.

    Of m d'' = -K d^n (1 + x d'/v): d' dd' / (1 + x d'/v) = -K d^n dd / m, integrated from v to -e v.
    """
    # Importing scipy takes longer than reading a scene.
    from scipy.optimize import brentq

    if e >= 1.0:
        return 0.0

    def rest(x: float) -> float:
        return float(np.log1p(x) - np.log1p(-e * x) - (1.0 + e) * x)

    # Of a small e the root is nearer to 1 / e than round-off.
    top = (1.0 - 1e-12) / e
    return top if rest(top) < 0.0 else float(brentq(rest, 1e-9, top))
