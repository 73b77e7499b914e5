"""Numerical settings of a scene; every one has a default that suits a small mechanism."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from shoal.scene.record import Positive, Record

Acceleration = Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$")]
"""A name that the engines look up: among them are the swarms, whose list a scene does not know."""
IntegratorName = Literal[
    "auto",
    "leapfrog",
    "semi-implicit-euler",
    "rk4",
    "dop853",
    "radau5",
    "generalized-alpha",
    "energy-momentum",
    "implicit-gauss",
]


class Solver(Record):
    """Settings of the integrator and of the checks of a run.

    The accelerations `afsa`, `iafsa` and `iafsa-printed` let a swarm search in every time step (the paper's section
    4.2, with its numbers).
    """

    duration: Positive = 1.0
    """Duration of the motion [s]."""
    step: Positive = 1e-3
    """Time step; of an adaptive integrator the first [s]."""
    integrator: IntegratorName = "auto"
    """Time integration; `auto` chooses by the stiffness of the scene."""
    samples: Annotated[int, Field(ge=1, le=10_000_000)] = 50
    """Number of evenly spaced times after the start at which the motion is reported."""
    relative_tolerance: Annotated[float, Field(ge=1e-14, le=1e-1)] = 1e-12
    """Relative error of each step of an adaptive integrator (dop853, radau5), by the size of the state [1]."""
    absolute_tolerance: Positive = 1e-13
    """Absolute error of each step of an adaptive integrator [m, of rates m/s]."""
    max_step: Positive | None = None
    """Longest step of an adaptive integrator [s]. Without a limit a machine at rest may skip what a drive does later.
    """
    max_steps: Annotated[int, Field(ge=1, le=1_000_000_000)] = 1_000_000
    """Most steps of an adaptive integrator."""
    spectral_radius: Annotated[float, Field(ge=0, le=1)] = 1.0
    """rho_infinity of generalized-alpha [1]."""
    newton_tolerance: Positive = 1e-10
    """Largest change of a coordinate at which implicit steps stop iterating [m, of directors 1]."""
    acceleration: Acceleration = "projection"
    """How Gauss's principle is solved."""
    swarm_size: Annotated[int, Field(ge=2, le=100_000)] = 40
    """Number of fish."""
    swarm_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 100
    """Iterations of the swarm in every time step."""
    swarm_seed: Annotated[int, Field(ge=0)] = 0
    """Seed of its random numbers."""
    baumgarte: Positive = 20.0
    """Rate of Baumgarte's stabilisation [1/s]."""
    project: bool = True
    """Whether drift is removed after every step."""
    inertia_cap: bool = False
    """Whether leapfrog raises the inertia of axial vibrations that are too fast for the step."""
    theory: Literal["auto", "slender"] = "auto"
    """Theory that a tolerance refers to: slender rods, or (`auto`) rods with shear and rotary inertia where these
    count.
    """
    rank_tolerance: Positive = 1e-5
    """Distance from a singular position that counts as singular [1]."""
    energy_tolerance: Positive = 1e-2
    """Relative energy error beyond which a run is rejected [1]."""

    @property
    def caps_inertia(self) -> bool:
        """Return whether runs with these settings raise the inertia of axial vibrations."""
        return self.inertia_cap and self.integrator == "leapfrog"
