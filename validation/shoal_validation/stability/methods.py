"""The methods that the maps put side by side: our integrators, and other engines with and without our checks."""

from __future__ import annotations

from dataclasses import replace

from shoal.engines.casadi import CasadiEngine
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.gauss import GaussEngine
from shoal.mechanics.integrators import INTEGRATORS, facts

from shoal_validation.stability.contract import Method
from shoal_validation.stability.exudyn_defaults import ExudynDefaults

GAUSS = GaussEngine(threads=1)
DAMPED = 0.9
"""Spectral radius of generalized-alpha with numerical damping."""


def ours(name: str, **fields: float) -> Method:
    """One of our integrators; fields: further ones of the solver."""
    changes = {"solver.integrator": name, **{f"solver.{key}": value for key, value in fields.items()}}
    extra = "".join(f" {value:g}" for value in fields.values())
    return Method(f"{name}{extra}", GAUSS, changes)


def unchecked(method: Method) -> Method:
    """The same run, believed as soon as its engine is content."""
    return replace(method, name=f"{method.name}, unchecked", checked=False)


FIXED_STEP = tuple(
    method
    for name in INTEGRATORS
    if not facts(name).adaptive
    for method in (
        [ours(name, spectral_radius=radius) for radius in (1.0, DAMPED)]
        if name == "generalized-alpha"
        else [ours(name)]
    )
)
"""Our integrators of fixed step."""
CAPPED = Method("leapfrog, inertia capped", GAUSS, {"solver.integrator": "leapfrog", "solver.inertia_cap": True})
"""Steps that axial vibrations are too fast for."""
ADAPTIVE = tuple(ours(name) for name in INTEGRATORS if facts(name).adaptive)
"""Our integrators that choose their steps."""
AUTO = ours("auto")
"""What a scene gets that names no integrator."""

EXUDYN = (
    Method("exudyn trapezoidal", ExudynEngine()),
    Method(
        f"exudyn generalized-alpha {DAMPED}",
        ExudynEngine(integrator="generalized-alpha"),
        {"solver.spectral_radius": DAMPED},
    ),
)
EXUDYN_DEFAULTS = Method("exudyn, its own defaults, unchecked", ExudynDefaults(), checked=False)
CASADI_RK4 = Method("casadi rk4", CasadiEngine(integrator="rk4"))
CASADI_CVODES = Method("casadi cvodes", CasadiEngine())


def both(*methods: Method) -> tuple[Method, ...]:
    """Each method with our checks and without."""
    return tuple(row for method in methods for row in (method, unchecked(method)))
