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

    `duration` and `step` are in s; the motion is reported at its start and at `samples` evenly spread times
    after it. `integrator: auto` picks by the stiffness of the scene.
    Adaptive integrators (dop853, radau5) keep the error of each step below `absolute_tolerance` +
    `relative_tolerance` times the size of the state; `step` is then their first step, `max_step` [s] the
    longest (no limit if null: a machine at rest may then skip what a drive does later), and `max_steps` the most
    they may take. `spectral_radius` is rho_infinity of generalized-alpha. `acceleration` is how Gauss's principle
    is solved, `baumgarte` [1/s] the rate of Baumgarte's stabilisation, `project` whether drift is removed after
    every step, `rank_tolerance` the distance from a singular position that counts as singular. `inertia_cap` (leapfrog
    only) raises the inertia of axial vibrations that are too fast for the step. `theory` is the one that a tolerance
    refers to: of slender rods, or (auto) of rods with shear and rotary inertia where these count.
    `energy_tolerance` is the relative energy error beyond which a run is rejected. The accelerations `afsa`, `iafsa`
    and `iafsa-printed` let `swarm_size` fish search for `swarm_iterations` iterations in every time step (the paper's
    section 4.2, with its numbers); `swarm_seed` makes them repeatable.
    """

    duration: Positive = 1.0
    step: Positive = 1e-3
    integrator: IntegratorName = "auto"
    samples: Annotated[int, Field(ge=1, le=10_000_000)] = 50
    relative_tolerance: Annotated[float, Field(ge=1e-14, le=1e-1)] = 1e-12
    absolute_tolerance: Positive = 1e-13
    max_step: Positive | None = None
    max_steps: Annotated[int, Field(ge=1, le=1_000_000_000)] = 1_000_000
    spectral_radius: Annotated[float, Field(ge=0, le=1)] = 1.0
    newton_tolerance: Positive = 1e-10
    acceleration: Acceleration = "projection"
    swarm_size: Annotated[int, Field(ge=2, le=100_000)] = 40
    swarm_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 100
    swarm_seed: Annotated[int, Field(ge=0)] = 0
    baumgarte: Positive = 20.0
    project: bool = True
    inertia_cap: bool = False
    theory: Literal["auto", "slender"] = "auto"
    rank_tolerance: Positive = 1e-5
    energy_tolerance: Positive = 1e-2

    @property
    def caps_inertia(self) -> bool:
        """Return whether runs with these settings raise the inertia of axial vibrations."""
        return self.inertia_cap and self.integrator == "leapfrog"
