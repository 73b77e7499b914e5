"""What Bernoulli-Euler's beam leaves out: shear and rotary inertia."""

from __future__ import annotations

import numpy as np

from shoal.scene import Rod
from shoal.selection.climb import Runs
from shoal.selection.levels import RIGID
from shoal.selection.run import Rung, distance, rigid_scene, run


def neglected(chosen: Rung, runs: Runs) -> float:
    """Displacement of the markers that shear and rotary inertia would cause, by order of magnitude [m].

    In the first bending mode of a rod they change the stiffness and the mass by pi^2 r^2 / L^2 times E / (kappa G) and
    1 (Timoshenko 1921; r radius of gyration of the section, kappa by Cowper 1966); that share of the effect that
    bending has at all, which is the distance of the chosen model from the rigid machine.
    """
    share = 0.0
    for name, level in chosen.levels.items():
        rod = runs.scene.bodies[name]
        if level.element in ("rigid", "ancf-full") or not isinstance(rod, Rod):
            continue
        nu = rod.poisson_ratio
        kappa = 10 * (1 + nu) / (12 + 11 * nu)
        slenderness = np.pi * rod.height / np.sqrt(12.0) / rod.length
        share = max(share, slenderness**2 * (2 * (1 + nu) / kappa + 1.0))
    if share == 0.0:
        return 0.0
    rigid = run(rigid_scene(runs.scene, dict.fromkeys(chosen.levels, RIGID), 1e-8), runs.times)
    return share * distance(rigid, chosen.trajectory)
