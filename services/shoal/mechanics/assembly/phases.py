"""Free motions of joints as vectors: of a hinge the cosine and the sine of its angle, of a slider its way.

A rotor behind a gear of the ratio N adds N^2 J r^2 / 2 to the kinetic energy, r the rate of the joint's angle. In
natural coordinates r is no linear form of the rates, but the vector u = (cos, sin) of the angle moves with |u'| = |r|:
a mass N^2 J of u is exact, and the mass matrix stays constant. Between the ground and a body u is linear in the
coordinates, else it has unknowns (`lifted`). In space couplings count the angles of these vectors.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.lifted import Lifted
from shoal.scene import Coupling, PointMass, Revolute, Scene, Slider
from shoal.scene.joints import places


def make_phases(scene: Scene, result: Placement) -> None:
    """Add the free motions of joints with an armature, and of those whose angles couplings count. Raises InputError."""
    for name, joint in scene.joints.items():
        if isinstance(joint, Revolute | Slider) and np.any(joint.armature):
            for side in (joint.first.body, joint.second.body):
                if not _turns(scene, side):
                    raise InputError(f"joints.{name}.armature: acts between rigid bodies; {side} is none")
            _make(scene, name, result)
    for name, joint in scene.joints.items() if scene.dimensions == 3 else ():
        for number, term in enumerate(joint.terms) if isinstance(joint, Coupling) else ():
            if term.measure is not None and term.measure.kind == "angle":
                (other,) = term.measure.names
                for side in (side.body for side in places(scene.joints[other])):
                    if not _turns(scene, side):
                        raise InputError(
                            f"joints.{name}.terms.{number}.of: in space an angle is counted between rigid bodies; "
                            f"{side} is none"
                        )
                if other not in result.phases:
                    _make(scene, other, result)


def _turns(scene: Scene, body: str) -> bool:
    return is_stiff(scene, body) and not isinstance(scene.bodies.get(body), PointMass)


def _make(scene: Scene, name: str, result: Placement) -> None:
    joint, before = scene.joints[name], len(result.positions)
    result.phases[name] = _defined(name, free_motion(scene, joint, result), int(isinstance(joint, Slider)), result)
    if added := range(before, len(result.positions)):
        result.lifted.append(Lifted(tuple(added), name, turns=not isinstance(joint, Slider)))


def free_motion(scene: Scene, joint: Any, result: Placement) -> list[tuple[Affine, Affine]]:
    """Return vectors whose scalar products are cosine and sine of the angle of the second body, or its way [m]."""
    if isinstance(joint, Slider):
        along = joint.direction if scene.dimensions == plane.DIMENSIONS or joint.axis is None else joint.axis
        way = result.point(scene, joint.second) - result.point(scene, joint.first)
        return [(result.line(joint.first, along), way)]
    if scene.dimensions == plane.DIMENSIONS:
        flat, towards = (result.direction(scene, side) for side in (joint.first, joint.second))
        return [(flat, towards), (flat.turned(plane.QUARTER), towards)]
    flat, towards, ahead = result.hinge(joint.first, joint.second, joint.axis)  # type: ignore[attr-defined]
    return [(flat, towards), (ahead, towards)]


def _defined(name: str, products: list[tuple[Affine, Affine]], lengths: int, result: Placement) -> Affine:
    """Return a vector whose components are scalar products: linear where one side rests, else with unknowns."""
    axes = np.eye(result.scene.dimensions)[..., None]
    if all(one.rests or other.rests for one, other in products):
        total = fixed(0.0 * axes[0])
        for axis, (one, other) in zip(axes, products, strict=False):
            row, vector = (one, other) if one.rests else (other, one)
            total = total + vector.turned(axis[:, None] * row.constant[None])
        return total
    first = len(result.positions)
    for one, other in products:
        (p, v), (q, w) = result.start_of(one), result.start_of(other)
        result.positions.append(np.sum(p * q, axis=0))
        result.velocities.append(np.sum(v * q + p * w, axis=0))
    found = Affine({first + k: axes[k] for k in range(len(products))}, 0.0 * axes[0])
    for axis, pair in zip(axes, products, strict=False):
        result.terms.add(name, [pair, (fixed(-axis), found)], lengths)
    return found
