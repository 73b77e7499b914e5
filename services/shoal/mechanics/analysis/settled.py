"""Static equilibrium within a tolerance, by uniform mesh refinement and Richardson extrapolation (`mesh_error`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.arguments import check
from shoal.mechanics.analysis import findings as kinds
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.mesh_error import apart, beyond, finer
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene
from shoal.scene.shear import with_shear

DOUBLINGS = 7
"""Refinements at most; each doubles the elements of all rods."""
SAFE = 2.0
"""Safety factor: the tolerance over the estimated error."""


def settled(scene: Scene, tolerance: float, time: float = 0.0) -> Equilibrium:
    """Return the equilibrium of a machine, with markers within a tolerance [m] of the limit of ever finer meshes.

    The elements of the scene's flexible rods are doubled together. With d the distance of two meshes in a row and f the
    factor by which it falls, the finer one is d / (f - 1) from the limit: its `mesh_error`. The coarsest mesh whose
    estimate is safely within the tolerance is returned; there is none where the status is `failed`. In the plane, rods
    with shear take the place of slender ones where that moves a marker by as much as the estimate may be off, unless
    `solver.theory` is slender. Raises InputError.
    """
    check(tolerance=tolerance)
    found = _refined(scene, tolerance, time)
    stout = None if scene.solver.theory == "slender" else with_shear(found.scene)
    if stout is None:
        return found
    other = statics(stout, time)
    away = apart(found, other) if found.ok and other.ok else np.nan
    if found.estimates is not None:
        found = replace(found, estimates={**found.estimates, "theory": away if np.isfinite(away) else None})
    if SAFE * away <= tolerance:
        return found
    other = _refined(stout, tolerance, time, other)
    if other.ok and np.isfinite(away):
        shear = kinds.SHEAR.found(f"with shear, which is worth {away:.1e} m", distance=float(away))
        return replace(other, findings=[*other.findings, shear])
    return other if other.ok or found.ok else found


def _refined(scene: Scene, tolerance: float, time: float, begun: Equilibrium | None = None) -> Equilibrium:
    """Return the equilibrium on the coarsest mesh within the tolerance, of the scene's own elements.

    begun: the equilibrium of the scene, if known
    """
    found, gap = begun or statics(scene, time), np.nan
    for _ in range(DOUBLINGS):
        if (fine := finer(scene)) is None:
            return found
        scene, coarse, last = fine, found, gap
        found = statics(scene, time)
        if not (coarse.ok and found.ok):
            gap = np.nan
            continue
        gap = apart(coarse, found)
        error = beyond(gap, last)
        found = replace(found, estimates={"mesh": error})
        if SAFE * error <= tolerance:
            return found
    if not found.ok:
        return found
    return replace(
        found,
        findings=[kinds.NO_MESH.found(f"no mesh that was tried is within the tolerance {tolerance:g} m")],
    )
