"""Forces of joints and contacts along a motion, as load cells there would measure them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.analysis.contact_forces import contact_forces
from shoal.mechanics.analysis.felt import Felt
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.free_motion import FreeMotion
from shoal.mechanics.analysis.joint_reactions import exerted
from shoal.mechanics.analysis.singular import SHARE
from shoal.mechanics.numerics.tile import Array
from shoal.scene.joints import DrivenAngle

OF_CONTACT = "contacts."
BLOCK = 64
"""Samples that are balanced at once, which bounds the memory."""


class Reaction(NamedTuple):
    """Reaction of a joint on its second body, friction included, or of a contact on its first, at every sample.

    force [N], (samples, d); torque [N m], (samples,), in space a vector, (samples, 3); drive: in space that of a drive
    about its axis, (samples,); normal, friction: of a contact [N], friction in space by its size, (samples,). No
    numbers at an impact.
    """

    force: Array
    torque: Array
    drive: Array | None = None
    normal: Array | None = None
    friction: Array | None = None


def reactions_along(felt: Felt, names: tuple[str, ...]) -> dict[str, Reaction]:
    """Return what some joints, and contacts as `contacts.NAME`, exert; the model has one lane.

    Raises InputError if the forces of one of them are not unique at most of the samples.
    """
    bodies = FreeBodies(felt.evaluator, float(felt.times[-1]))
    rubbing = felt.evaluator.model.forces.size - bodies.evaluator.model.forces.size
    at, rate, change = bodies.state(felt.q, felt.v, felt.a)
    force = np.empty_like(at)
    for k, (q, v, t) in enumerate(zip(at, rate, felt.times, strict=True)):
        bodies.evaluator.turns = felt.turns[k, rubbing:]
        bodies.follow(felt.strengths[k])
        force[k] = bodies.evaluator.force(q, v, float(t))
    parts = []
    for first in range(0, len(at), BLOCK):
        block = slice(first, first + BLOCK)
        motion = FreeMotion(bodies, at[block], rate[block])
        acting = contact_forces(motion, change[block], felt.evaluator.model, felt.pressing[block])
        parts.append(exerted(motion, change[block], force[block], np.zeros_like(force[block]), acting))
    found = {}
    for name in names:
        shares = np.concatenate([part.shares(name) for part in parts])
        if np.median(shares) > SHARE:
            raise _not_unique(felt.scene.name, name)
        if name.startswith(OF_CONTACT):
            surfaces = [part.surfaces()[name.removeprefix(OF_CONTACT)] for part in parts]
            push = np.concatenate([one.component.force for one in surfaces])
            normal, friction = (np.concatenate([getattr(one, of) for one in surfaces]) for of in ("normal", "friction"))
            rubs = friction[:, 0] if friction.shape[1] == 1 else np.linalg.norm(friction, axis=1)
            found[name] = Reaction(push, np.zeros_like(normal), None, normal, rubs)
            continue
        pairs = [part.of(name) for part in parts]
        push, torque = (np.concatenate([pair[k] for pair in pairs]) for k in (0, 1))
        drive = None
        if torque.shape[1] > 1 and isinstance(felt.scene.joints[name], DrivenAngle):
            own = next(k for k, part in enumerate(parts[0].parts) if part.joint == name)
            drive = np.concatenate([part.sizes[:, own] for part in parts])
        found[name] = Reaction(push, torque[:, 0] if torque.shape[1] == 1 else torque, drive)
    return found


def _not_unique(scene: str, name: str) -> InputError:
    where = f"contact {name.removeprefix(OF_CONTACT)}" if name.startswith(OF_CONTACT) else f"joint {name}"
    return InputError(
        f"channels: the forces of {where} are not unique: {scene} holds itself more than it needs to; "
        "measure another joint, or leave out what is redundant"
    )
