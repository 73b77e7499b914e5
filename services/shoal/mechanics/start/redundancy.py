"""Redundant joints of planar machines, by the null space of the transposed Jacobian (their forces are not unique)."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.plane import as_complex, phasor
from shoal.mechanics.start.closure import lead, place_of
from shoal.mechanics.start.poses import Assembly
from shoal.scene import GROUND, Attachment, Coupling, InitialState, RigidBody, Scene
from shoal.scene.joints import Joint

_RANK = 1e-7
_SHARE = 1e-3
_ASIDE = 0.02
"""How far [1, rad] the machine is moved to leave a singular position."""
_LARGEST = 400
"""Rows of joints up to which the question is asked."""


def redundant_joints(scene: Scene) -> tuple[str, ...]:
    """Return joints of a started scene that depend on others, there and, if the machine can move, also near it."""
    if sum(3 for _ in scene.joints) > _LARGEST or not scene.joints:
        return ()
    scene = _split(scene)
    assembly = Assembly(scene, 1)
    names, free = _dependent(assembly, assembly.guess)
    if names and len(free):
        step = free.T @ np.cos(1.0 + np.arange(len(free)))
        aside = assembly.guess + _ASIDE * step / np.max(np.abs(step))
        poses, gap = assembly.close(assembly.closure, aside, np.zeros(aside.shape, dtype=bool))
        # A machine that comes back cannot move: what holds it twice does so for good.
        if gap[0] < 1e-9 and np.max(np.abs(poses - assembly.guess)) > 0.25 * _ASIDE:
            names = _dependent(assembly, poses)[0]
    return names


def _dependent(assembly: Assembly, poses: Array) -> tuple[tuple[str, ...], Array]:
    """Return the joints of dependent rows, and the null space of all rows, (motions, 3 bodies)."""
    rows = assembly.closure.at(poses).rows(poses)
    unit_size = np.where(np.arange(poses.shape[1]) % 3 == 2, 1.0 / assembly.size, 1.0)
    slope = rows.slope[0] * unit_size
    slope = slope / (np.linalg.norm(slope, axis=1, keepdims=True) + 1e-300)
    split = np.linalg.svd(slope)
    rank = int(np.sum(split.S > _RANK))
    share = np.linalg.norm(split.U[:, rank:], axis=1)
    names = dict.fromkeys(name for name, part in zip(rows.names, share, strict=True) if part > _SHARE)
    return tuple(name for name in names if name in assembly.scene.joints), split.Vh[rank:] * unit_size


def _split(scene: Scene) -> Scene:
    """Return the scene with a separate body for each place of a flexible rod, as the rod does not hold them rigidly."""
    bodies = {name: body for name, body in scene.bodies.items() if body.element == "rigid"}
    initial = {}
    for name in bodies:
        begin = scene.start(name)
        initial[name] = InitialState(angle=begin.angle, position=begin.position)
    names: dict[tuple[str, Any], str] = {}

    def apart(at: Attachment) -> Attachment:
        if at.body == GROUND or scene.bodies[at.body].element == "rigid":
            return at
        place, start = scene.location(at), scene.start(at.body)
        name = names.setdefault((at.body, place), f"{at.body}-{len(names)}")
        where = as_complex(start.position or (0.0, 0.0)) + phasor(start.angle) * place_of(scene, at)
        bodies[name] = RigidBody(mass=1.0, inertia=1.0)
        initial[name] = InitialState(angle=start.angle + lead(scene, at), position=(where.real, where.imag))
        return Attachment(body=name, point=(0.0, 0.0))

    def remade(joint: Joint) -> Joint:
        if isinstance(joint, Coupling):
            terms = tuple(term.model_copy(update={"at": apart(term.at)}) for term in joint.terms)
            return joint.model_copy(update={"terms": terms})
        return joint.model_copy(update={"first": apart(joint.first), "second": apart(joint.second)})

    joints = {name: remade(joint) for name, joint in scene.joints.items()}
    return scene.model_copy(update={"bodies": bodies, "joints": joints, "initial": initial})
