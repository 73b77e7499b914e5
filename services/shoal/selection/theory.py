"""What Bernoulli-Euler's beam leaves out: shear and rotary inertia."""

from __future__ import annotations

import numpy as np

from shoal.scene import Rod
from shoal.selection.climb import Runs
from shoal.selection.levels import RIGID
from shoal.selection.run import Rung, distance, rigid_scene, run


def neglected(chosen: Rung, runs: Runs) -> float:
    """Displacement of the markers that shear and rotary inertia would cause, by order of magnitude [m].

    Their share of the effect that bending has at all, which is the distance of the chosen model from the rigid machine.
    """
    share = 0.0
    for name, level in chosen.levels.items():
        rod = runs.scene.bodies[name]
        if level.element not in ("rigid", "ancf-full") and isinstance(rod, Rod):
            share = max(share, slender_share(rod))
    if share == 0.0:
        return 0.0
    rigid = run(rigid_scene(runs.scene, dict.fromkeys(chosen.levels, RIGID), 1e-8), runs.times)
    return share * distance(rigid, chosen.trajectory)


def slender_share(rod: Rod) -> float:
    """By how much shear and rotary inertia lower the stiffness of a rod in bending, over its mass.

    In the first bending mode of a rod they change the stiffness and the mass by pi^2 r^2 / L^2 times E / (kappa G) and
    1 (Timoshenko 1921; r radius of gyration of the section, kappa by Cowper 1966).
    """
    nu = rod.poisson_ratio
    kappa = 10 * (1 + nu) / (12 + 11 * nu)
    slenderness = np.pi * rod.height / np.sqrt(12.0) / rod.length
    return float(slenderness**2 * (2 * (1 + nu) / kappa + 1.0))
