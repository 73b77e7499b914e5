"""A priori estimate of the error of rigid rods: quasi-static deflection, amplified by the sensitivity of the motion.

The machine moves with rigid rods. On the way each rod carries its weight less its inertia and the loads on it, and
would bend and stretch as a beam under them. Released at once, an elastic rod swings to twice its deflection; the motion
amplifies that by the factor by which it amplifies small changes of the initial angles. This is an order of magnitude:
it excludes models only where it is far from the tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.mechanics.rotation import of_vector, product, vector_of
from shoal.scene import (
    Attachment,
    DistributedForce,
    Force,
    Function,
    PointMass,
    Rod,
    Scene,
    Thrust,
    Torque,
    Weld,
)
from shoal.scene.dimensions import padded
from shoal.scene.joints import places, sides
from shoal.selection.levels import RIGID, apply
from shoal.trajectory import Array, Trajectory

SAMPLES = 400
OVERSHOOT = 2.0
NUDGE = 1e-4
"""Change of an initial angle [rad] by which the growth of small changes is measured."""


@dataclass(frozen=True)
class PriorEstimate:
    """A priori estimates for a rod.

    deflection: quasi-static, largest along the motion [m], nan if the loads are not known beforehand
    growth: factor by which the motion amplifies small changes
    error: of modelling the rod as rigid, at the markers, by order of magnitude [m]
    frequency: lowest bending frequency of the rod, pinned at both ends, about its weaker axis [rad/s]
    """

    deflection: float
    growth: float
    error: float
    frequency: float


def estimate(scene: Scene, rods: tuple[str, ...]) -> dict[str, PriorEstimate]:
    """The estimate for every rod whose model is open; nan where the rigid motion cannot be had.

    So it is in space with a curved or twisted rod: no rigid one has its shape.
    """
    motion, growth = None, np.nan
    if scene.dimensions == 2 or all(getattr(scene.bodies[name], "straight", True) for name in rods):
        probed = _probed(apply(scene, dict.fromkeys(rods, RIGID)), rods)
        times = np.linspace(0.0, scene.solver.duration, SAMPLES + 1)
        motion = _run(probed, times)
        growth = _growth(probed, times, motion) if motion is not None else np.nan
    found = {}
    for name in rods:
        rod = scene.bodies[name]
        assert isinstance(rod, Rod)
        deflection = np.nan if motion is None else _deflection(scene, name, rod, motion)
        section, (density, heavy) = rod.section_at(0), rod.masses_at(0)
        sound = np.sqrt(rod.modulus / density) * np.sqrt(section.area / heavy.area)
        speed = sound * min(section.gyration(scene.dimensions))
        error = OVERSHOOT * deflection * (1.0 + growth)
        found[name] = PriorEstimate(deflection, growth, error, float(np.pi**2 * speed / rod.length**2))
    return found


def _probed(scene: Scene, rods: tuple[str, ...]) -> Scene:
    """The scene with markers at both ends of its rods beside its own."""
    markers = {name: place.model_dump(mode="json") for name, place in scene.markers.items()}
    for name in rods:
        for end in ("start", "end"):
            markers[f"at-{name}-{end}"] = Attachment(body=name, point=end).model_dump(mode="json")
    settings = {"solver.relative_tolerance": 1e-8, "solver.absolute_tolerance": 1e-10, "solver.integrator": "auto"}
    return scene.with_values({"markers": markers, **settings})


def _run(scene: Scene, times: Array, values: Mapping[str, Any] | None = None) -> Trajectory | None:
    try:
        motion = GaussEngine().simulate(scene.with_values(values) if values else scene, times[1:])
    except InputError:
        return None
    return motion if motion.ok else None


def _growth(scene: Scene, times: Array, motion: Trajectory) -> float:
    """Return the largest displacement of the markers per displacement at the start; nan where no start can vary."""
    found = []
    for name, body in scene.bodies.items():
        length = body.length if isinstance(body, Rod) else 1.0
        for values in _nudged(scene, name):
            near = _run(scene, times, values)
            if near is not None:
                found.append(near.distance(motion) / (NUDGE * length))
    return max(found, default=np.nan)


def _nudged(scene: Scene, name: str) -> list[dict[str, Any]]:
    """Return starts in which one body is turned a little: in the plane, or about each axis of the ground."""
    if isinstance(scene.bodies[name], PointMass):
        return []
    start = scene.start(name)
    if scene.dimensions == 2:
        return [{f"initial.{name}.angle": start.angle + NUDGE}]
    stated = np.array([0.0, 0.0, start.angle] if start.rotation is None else start.rotation)
    attitude = of_vector(stated[:, None])
    turned = (product(of_vector(nudge[:, None]), attitude)[..., 0] for nudge in NUDGE * np.eye(3))
    return [{f"initial.{name}.angle": None, f"initial.{name}.rotation": vector_of(one).tolist()} for one in turned]


def _deflection(scene: Scene, name: str, rod: Rod, motion: Trajectory) -> float:
    """Beam formulas under the largest load: half a sine between pins, or a cantilever where a weld holds the rod."""
    force, moment = _applied(scene, name, rod)
    interval = float(motion.times[1] - motion.times[0])
    ends = [motion.marker(f"at-{name}-{end}") for end in ("start", "end")]
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0], axis=1)[:, None]
    gravity = np.array(padded(scene.gravity, scene.dimensions))
    pulls = [gravity - np.diff(path, 2, axis=0) / interval**2 for path in ends]
    across = (pull - np.sum(pull * along[1:-1], axis=1)[:, None] * along[1:-1] for pull in pulls)
    transverse = max(float(np.max(np.linalg.norm(part, axis=1))) for part in across)
    largest = max(float(np.max(np.linalg.norm(pull, axis=1))) for pull in pulls)
    masses = {other: float(body.mass) for other, body in scene.bodies.items()}
    line, length = rod.mass / rod.length * transverse, rod.length
    if any(
        isinstance(joint, Weld) and name in {side.body for side in places(joint)} for joint in scene.joints.values()
    ):
        tip = force + (sum(masses.values()) - rod.mass) * largest
        sag = line * length**4 / 8 + tip * length**3 / 3 + moment * length**2 / 2
    else:
        sag = line * length**4 / np.pi**4 + force * length**3 / 48 + moment * length**2 / 16
    tension = sum(masses.values()) * largest + force
    bending_stiffness = rod.axial_stiffness * min(rod.section_at(0).gyration(scene.dimensions)) ** 2
    return float(sag / bending_stiffness + tension * length / rod.axial_stiffness)


def _applied(scene: Scene, name: str, rod: Rod) -> tuple[float, float]:
    """Return the sums of the forces [N] and torques [N m] on a rod; nan where they depend on time or on the motion.

    Loads of any other kind depend on the motion.
    """
    force, moment = 0.0, 0.0
    for load in scene.loads.values():
        if isinstance(load, DistributedForce) and load.body == name:
            force += float(np.linalg.norm(load.force)) * rod.length * _constant(load.scale)
        elif isinstance(load, Force) and load.at.body == name:
            force += float(np.linalg.norm(load.force)) * _constant(load.scale)
        elif isinstance(load, Torque) and name in {side.body for side in sides(load).values()}:
            moment += _constant(load.torque)
        elif isinstance(load, Thrust) and name in {side.body for side in places(scene.joints[load.joint])}:
            force += _constant(load.force)
        elif name in {side.body for side in sides(load).values()}:
            force = np.nan
    return force, moment


def _constant(function: Function) -> float:
    return np.nan if function.number is None else abs(function.number)
