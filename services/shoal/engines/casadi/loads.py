"""Springs, friction and loads without time as CasADi expressions: stored energy, dissipation, generalised forces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import numpy as np

from shoal.engines.capabilities import of_kind
from shoal.engines.casadi.bodies import PlacedCable
from shoal.engines.casadi.signals import strength
from shoal.engines.casadi.tree import PlacedTree
from shoal.engines.poses import initial_poses, start_of
from shoal.errors import InputError
from shoal.scene import (
    Attachment,
    DistributedForce,
    Force,
    PointMass,
    Revolute,
    Rod,
    Scene,
    Spring,
    Torque,
    TorsionSpring,
)


def with_rest(scene: Scene) -> Scene:
    """The scene with rest lengths and angles said where they follow from the start. Raises InputError."""
    if not any(isinstance(load, Spring | TorsionSpring) for load in scene.loads.values()):
        return scene
    poses, loads = initial_poses(scene), dict(scene.loads)
    for name, load in loads.items():
        if isinstance(load, Spring) and load.length is None:
            first, second = (start_of(scene, poses, side) for side in (load.first, load.second))
            loads[name] = load.model_copy(update={"length": float(np.linalg.norm(second - first))})
        if isinstance(load, TorsionSpring):
            turn = poses[load.second.body].angle - poses[load.first.body].angle
            rest = turn if load.angle is None else load.angle
            flexible = any(_is_flexible(scene, side) for side in (load.first, load.second))
            if flexible and abs(turn - rest) >= np.pi:
                raise InputError(f"loads.{name}.angle: engine casadi winds up no cable; start within half a turn of it")
            loads[name] = load.model_copy(update={"angle": rest})
    return scene.model_copy(update={"loads": loads})


def stored(scene: Scene, tree: PlacedTree) -> Any:
    """Energy of the springs [J]."""
    energy = ca.SX(0)
    for load, x in _springs(scene, tree):
        energy += load.stiffness / 2 * x**2 + load.cubic / 4 * x**4
    return energy


def dissipation(scene: Scene, tree: PlacedTree, v: Any) -> Any:
    """A function D of the velocities whose gradient is what friction and dampers resist with [W].

    Rayleigh's c w^2 / 2 for viscous friction, c |w|^3 / 3 for drag; F w0 log cosh(w / w0) for Coulomb's, smoothed as
    F tanh(w / w0).
    """
    total = ca.SX(0)
    for name, joint in scene.joints.items():
        assert isinstance(joint, Revolute)
        if joint.resists:
            first, second = (_angle(scene, tree, f"joints.{name}", side) for side in (joint.first, joint.second))
            rate = ca.jtimes(second - first, tree.coordinates, v)
            # log cosh without overflow.
            size = ca.fabs(rate) / joint.coulomb_speed
            rub = joint.coulomb * joint.coulomb_speed * (size + ca.log1p(ca.exp(-2 * size)))
            total += joint.friction / 2 * rate**2 + joint.drag / 3 * ca.fabs(rate) ** 3 + (rub if joint.coulomb else 0)
    for load, x in _springs(scene, tree):
        if load.damping:
            total += load.damping / 2 * ca.jtimes(x, tree.coordinates, v) ** 2
    return total


def applied(scene: Scene, tree: PlacedTree, v: Any) -> Any:
    """Generalised forces of the applied loads, constant or by signals at the rates v, (unknowns,)."""
    total = ca.SX.zeros(tree.coordinates.numel())
    for name, load in scene.loads.items():
        if load.kind not in ELONGATIONS:
            total += of_kind(FORCES, load.kind, f"loads.{name}")(scene, tree, v, f"loads.{name}", load)
    return total


def _force(scene: Scene, tree: PlacedTree, v: Any, where: str, load: Force) -> Any:
    force = strength(scene, tree, v, load.scale) * ca.SX(load.force)
    if load.follows:
        c, s = (f(_angle(scene, tree, where, load.at)) for f in (ca.cos, ca.sin))
        force = ca.vertcat(c * force[0] - s * force[1], s * force[0] + c * force[1])
    point = tree.placed[load.at.body].point(scene.location(load.at))
    return ca.jtimes(point, tree.coordinates, force, True)


def _torque(scene: Scene, tree: PlacedTree, v: Any, where: str, load: Torque) -> Any:
    turn = _angle(scene, tree, where, load.at)
    if load.reaction is not None:
        turn = turn - _angle(scene, tree, where, load.reaction)
    return strength(scene, tree, v, load.torque) * ca.gradient(turn, tree.coordinates)


def _distributed(scene: Scene, tree: PlacedTree, v: Any, where: str, load: DistributedForce) -> Any:
    way = ca.dot(ca.SX(load.force), _integral(scene, tree, load.body))
    return strength(scene, tree, v, load.scale) * ca.gradient(way, tree.coordinates)


FORCES: dict[str, Callable[[Scene, PlacedTree, Any, str, Any], Any]] = {
    "force": _force,
    "torque": _torque,
    "distributed-force": _distributed,
}


def _springs(scene: Scene, tree: PlacedTree) -> Iterator[tuple[Any, Any]]:
    """The springs, each with its length or angle from rest [m or rad]."""
    for name, load in scene.loads.items():
        if load.kind in ELONGATIONS:
            yield load, ELONGATIONS[load.kind](scene, tree, f"loads.{name}", load)


def _stretch(scene: Scene, tree: PlacedTree, where: str, load: Spring) -> Any:
    """Length from rest [m]."""
    first, second = (tree.placed[side.body].point(scene.location(side)) for side in (load.first, load.second))
    return ca.norm_2(second - first) - load.length


def _twist(scene: Scene, tree: PlacedTree, where: str, load: TorsionSpring) -> Any:
    """Angle from rest [rad]."""
    first, second = (_angle(scene, tree, where, side) for side in (load.first, load.second))
    x = second - first - load.angle
    # The direction of a cable is known up to full turns only.
    flexible = any(_is_flexible(scene, side) for side in (load.first, load.second))
    return ca.atan2(ca.sin(x), ca.cos(x)) if flexible else x


ELONGATIONS: dict[str, Callable[[Scene, PlacedTree, str, Any], Any]] = {"spring": _stretch, "torsion-spring": _twist}


def _integral(scene: Scene, tree: PlacedTree, body: str) -> Any:
    """Integral of the position along a rod [m^2], (2,)."""
    placed, rod = tree.placed[body], scene.bodies[body]
    assert isinstance(rod, Rod)
    if isinstance(placed, PlacedCable):
        return sum((placed.element.integral(e, placed.h) for e in placed.elements()), ca.SX.zeros(2))
    nodes, weights = np.polynomial.legendre.leggauss(24)
    axis = [complex(rod.axis((x + 1) / 2 * rod.length)) for x in nodes]
    middle = sum(w / 2 * z for w, z in zip(weights, axis, strict=True))
    return rod.length * placed.point((middle.real, middle.imag))


def _angle(scene: Scene, tree: PlacedTree, where: str, side: Attachment) -> Any:
    if isinstance(scene.bodies.get(side.body), PointMass):
        raise InputError(f"{where}: {side.body} is a point mass, which has no angle")
    return tree.placed[side.body].angle(scene.location(side))


def _is_flexible(scene: Scene, side: Attachment) -> bool:
    body = scene.bodies.get(side.body)
    return body is not None and body.element != "rigid"
