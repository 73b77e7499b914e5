"""Numerical settings of a scene; every one has a default that suits a small mechanism."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from shoal.scene.record import Positive, Record

IntegratorName = Literal["leapfrog", "rk4", "generalized-alpha"]


class Solver(Record):
    """How the motion is computed.

    `duration` and `step` are in s; `samples` output times are spread evenly over the duration, the
    first one sampling interval after the start. `spectral_radius` is rho_infinity of
    generalized-alpha. `energy_tolerance` is the relative energy error beyond which a run is rejected.
    """

    duration: Positive = 1.0
    step: Positive = 1e-3
    integrator: IntegratorName = "leapfrog"
    samples: Annotated[int, Field(ge=1, le=10_000_000)] = 50
    spectral_radius: Annotated[float, Field(ge=0, le=1)] = 1.0
    newton_tolerance: Positive = 1e-10
    rank_tolerance: Positive = 1e-9
    energy_tolerance: Positive = 1e-2
