"""Springs, friction and constant loads as CasADi expressions: stored energy, dissipation, generalised forces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np

from shoal.engines.casadi_bodies import PlacedCable
from shoal.engines.casadi_tree import Tree
from shoal.engines.poses import initial_poses, owner
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
            first, second = (poses[owner(s)].position(scene.location(s)) for s in (load.first, load.second))
            loads[name] = load.model_copy(update={"length": float(np.linalg.norm(second - first))})
        if isinstance(load, TorsionSpring):
            turn = poses[load.second.body].angle - poses[load.first.body].angle
            rest = turn if load.angle is None else load.angle
            flexible = any(_is_flexible(scene, side) for side in (load.first, load.second))
            if flexible and abs(turn - rest) >= np.pi:
                raise InputError(f"loads.{name}.angle: engine casadi winds up no cable; start within half a turn of it")
            loads[name] = load.model_copy(update={"angle": rest})
    return scene.model_copy(update={"loads": loads})


def stored(scene: Scene, tree: Tree) -> Any:
    """Energy of the springs [J]."""
    energy = ca.SX(0)
    for name, load in scene.loads.items():
        if isinstance(load, Spring | TorsionSpring):
            x = _elongation(scene, tree, name, load)
            energy += load.stiffness / 2 * x**2 + load.cubic / 4 * x**4
    return energy


def dissipation(scene: Scene, tree: Tree, v: Any) -> Any:
    """A function D of the velocities whose gradient is what friction and dampers resist with [W].

    Rayleigh's c w^2 / 2 for viscous friction; F w0 log cosh(w / w0) for Coulomb's, smoothed as F tanh(w / w0).
    """
    total = ca.SX(0)
    for name, joint in scene.joints.items():
        assert isinstance(joint, Revolute)
        if joint.friction or joint.coulomb:
            first, second = (_angle(scene, tree, f"joints.{name}", side) for side in (joint.first, joint.second))
            rate = ca.jtimes(second - first, tree.coordinates, v)
            # log cosh without overflow.
            size = ca.fabs(rate) / joint.coulomb_speed
            rub = joint.coulomb * joint.coulomb_speed * (size + ca.log1p(ca.exp(-2 * size)))
            total += joint.friction / 2 * rate**2 + (rub if joint.coulomb else 0)
    for name, load in scene.loads.items():
        if isinstance(load, Spring | TorsionSpring) and load.damping:
            rate = ca.jtimes(_elongation(scene, tree, name, load), tree.coordinates, v)
            total += load.damping / 2 * rate**2
    return total


def applied(scene: Scene, tree: Tree) -> Any:
    """Generalised forces of the applied loads, all constant but for the direction of following ones, (unknowns,)."""
    total = ca.SX.zeros(tree.coordinates.numel())
    for name, load in scene.loads.items():
        if isinstance(load, Force):
            placed, place = tree.placed[load.at.body], scene.location(load.at)
            assert load.scale.number is not None
            force = load.scale.number * ca.SX(load.force)
            if load.follows:
                c, s = (f(_angle(scene, tree, f"loads.{name}", load.at)) for f in (ca.cos, ca.sin))
                force = ca.vertcat(c * force[0] - s * force[1], s * force[0] + c * force[1])
            total += ca.jtimes(placed.point(place), tree.coordinates, force, True)
        elif isinstance(load, Torque):
            assert load.torque.number is not None
            for side, sign in _turned(load):
                angle = _angle(scene, tree, f"loads.{name}", side)
                total += sign * load.torque.number * ca.gradient(angle, tree.coordinates)
        elif isinstance(load, DistributedForce):
            assert load.scale.number is not None
            way = ca.dot(load.scale.number * ca.SX(load.force), _integral(scene, tree, load.body))
            total += ca.gradient(way, tree.coordinates)
    return total


def _turned(load: Torque) -> Iterator[tuple[Attachment, float]]:
    yield load.at, 1.0
    if load.reaction is not None:
        yield load.reaction, -1.0


def _elongation(scene: Scene, tree: Tree, name: str, load: Spring | TorsionSpring) -> Any:
    """Length or angle from rest [m or rad]."""
    if isinstance(load, Spring):
        first, second = (tree.placed[side.body].point(scene.location(side)) for side in (load.first, load.second))
        return ca.norm_2(second - first) - load.length
    first, second = (_angle(scene, tree, f"loads.{name}", side) for side in (load.first, load.second))
    x = second - first - load.angle
    # The direction of a cable is known up to full turns only.
    flexible = any(_is_flexible(scene, side) for side in (load.first, load.second))
    return ca.atan2(ca.sin(x), ca.cos(x)) if flexible else x


def _integral(scene: Scene, tree: Tree, body: str) -> Any:
    """Integral of the position along a rod [m^2], (2,)."""
    placed, rod = tree.placed[body], scene.bodies[body]
    assert isinstance(rod, Rod)
    if isinstance(placed, PlacedCable):
        return sum((placed.element.integral(e, placed.h) for e in placed.elements()), ca.SX.zeros(2))
    nodes, weights = np.polynomial.legendre.leggauss(24)
    axis = [complex(rod.axis((x + 1) / 2 * rod.length)) for x in nodes]
    middle = sum(w / 2 * z for w, z in zip(weights, axis, strict=True))
    return rod.length * placed.point((middle.real, middle.imag))


def _angle(scene: Scene, tree: Tree, where: str, side: Attachment) -> Any:
    if isinstance(scene.bodies.get(side.body), PointMass):
        raise InputError(f"{where}: {side.body} is a point mass, which has no angle")
    return tree.placed[side.body].angle(scene.location(side))


def _is_flexible(scene: Scene, side: Attachment) -> bool:
    body = scene.bodies.get(side.body)
    return body is not None and body.element != "rigid"
