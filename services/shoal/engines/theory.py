"""Error of the theory of slender rods (Bernoulli-Euler): neglected shear and rotary inertia of the section."""

from __future__ import annotations

from collections.abc import Callable

from shoal.engines.contract import Engine
from shoal.engines.deviation import Deviation
from shoal.errors import InputError
from shoal.scene import Rod, Scene
from shoal.scene.refined import unbent
from shoal.scene.shear import like_stout, slender_share
from shoal.trajectory import Trajectory

WITH_SHEAR = ("exudyn-ge",)
"""Engines whose flexible rods have shear and rotary inertia, whatever element the scene states."""


def left_out(trajectory: Trajectory, scene: Scene, native: Engine, share: Callable[..., float] = max) -> float | None:
    """Displacement of the markers [m] that shear and rotary inertia would cause in a run of a scene.

    0 without rods that leave them out, None where it cannot be estimated; see `theory_deviations`.
    """
    found = theory_deviations(trajectory, scene, native, share)
    return None if found is None else sum(one.distance for one in found)


def theory_deviations(
    trajectory: Trajectory, scene: Scene, native: Engine, share: Callable[..., float] = max
) -> list[Deviation] | None:
    """Return what shear and rotary inertia change of a run, as differences of runs that add up; None if unknown.

    That the whole rod turns with its section's inertia is the distance of two runs with rigid rods, with and without
    it. In the first bending mode of a flexible rod shear and rotary inertia change the stiffness and the mass by pi^2
    r^2 / L^2 times E / (kappa G) and 1 (Timoshenko 1921; r radius of gyration of the section, kappa by Cowper 1966);
    this share of the effect that bending has at all, the distance from the run with rigid rods, is an order of
    magnitude. share: which rod's counts, if not the largest. Where rods have no rigid counterpart, as curved ones do,
    or where those of rigid rods fail, it is the distance from a run whose rods are softer by their shares.
    """
    _, slender = _rods(scene, trajectory.engine in WITH_SHEAR)
    if not slender:
        return []
    if unstated(scene):
        return None
    scenes = rigid_runs(scene, trajectory.engine)
    try:
        runs = [native.simulate(one, trajectory.times) for one in scenes]
        if runs and all(run.ok for run in runs):
            found = [Deviation("theory", runs[0], runs[1], (scenes[0], scenes[1]))]
            counted = share((slender_share(rod) for rod in slender.values() if rod.element != "rigid"), default=0.0)
            bent = [Deviation("theory", trajectory, runs[0], (scene, scenes[0]), counted)] if counted else []
            return found + bent
        softer = scene.with_values(like_stout(slender))
        run = native.simulate(softer, trajectory.times)
    except InputError:
        return None
    return [Deviation("theory", trajectory, run, (scene, softer))] if run.ok else None


def unstated(scene: Scene) -> list[str]:
    """Return the fields without which the shear of flexible rods that are stated by numbers is not known."""
    return [
        f"bodies.{name}.{field}" for name, rod in scene.flexible_rods.items() for field in rod.lacking("simo-reissner")
    ]


def rigid_runs(scene: Scene, engine: str = "gauss") -> list[Scene]:
    """Return the scene with rigid rods, without and with the rotary inertia of sections; none if that is unknown."""
    rods, slender = _rods(scene, engine in WITH_SHEAR)
    # A place on a curved rod is told by its arc length where it is flexible, by its coordinates where it is rigid.
    if not slender or any(rod.curvature or rod.side_curvature for rod in rods.values() if rod.element != "rigid"):
        return []
    values: dict[str, object] = {f"bodies.{name}.element": "rigid" for name in rods}
    for name in rods:
        values |= unbent(scene, name)
    values["solver.integrator"] = "auto"
    inertias = (
        {f"bodies.{name}.rotary_inertia": stout or name not in slender for name in rods} for stout in (False, True)
    )
    try:
        return [scene.with_values(values | inertia) for inertia in inertias]
    except InputError:
        return []


def _rods(scene: Scene, shearing: bool) -> tuple[dict[str, Rod], dict[str, Rod]]:
    """All rods, and those whose motion leaves shear and rotary inertia out; shearing: every flexible rod has both."""
    rods = {name: body for name, body in scene.bodies.items() if isinstance(body, Rod)}
    full = [name for name, rod in rods.items() if rod.shears or (shearing and rod.element != "rigid")]
    slender = {name: rod for name, rod in rods.items() if name not in full and not rod.rotary_inertia}
    return rods, slender
