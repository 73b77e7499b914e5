"""Forces of contacts on free bodies: in joints of stops, ropes, play, backlash and dry friction, and of surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.analysis.evaluate import Pressing
from shoal.mechanics.analysis.free_motion import FreeMotion
from shoal.mechanics.analysis.joint_forces import Component, of_condition, pair, tension
from shoal.mechanics.gaps import RIGID, SLIP, STICK, Gaps
from shoal.mechanics.joints import conditions
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, Flags
from shoal.mechanics.reach import span
from shoal.mechanics.sums import place_of_force
from shoal.scene import Contact, Slider
from shoal.scene.clearances import contacts_of
from shoal.scene.joints import tightened

TOUCHING = 1e-9
"""Gaps below this part of the machine's size, and accelerations below it of all that make them up, are none."""
CONTACT = "contact"
"""Name of the component of two surfaces."""


class ContactForce(NamedTuple):
    """Force of a contact at every sample.

    component: what it does, in a joint to the second body, of two surfaces to the first; at: where [m], (samples, d);
    normal: force that presses [N, of a stop of a hinge N m], friction: along the tangents, (samples, 1 or in space 2);
    state: `gaps.STICK` or `gaps.SLIP` of one that rubs, (samples,); sign: of an upper limit -1. open: gradients by
    displacement of the free bodies of the unit forces that the motion alone determines, (samples, unknowns) each, zero
    where it has none.
    """

    component: Component
    at: Array
    normal: Array
    friction: Array
    state: Array
    sign: float
    open: tuple[Array, ...]


def contact_forces(
    motion: FreeMotion, change: Array, model: Model, pressing: Sequence[Pressing]
) -> dict[str, list[ContactForce]]:
    """Return the forces of the contacts of a machine by what states them, as `contacts.NAME` or `joints.NAME.stops`.

    change: accelerations of the free bodies, (samples, unknowns); pressing: at every sample
    """
    found: dict[str, list[ContactForce]] = {}
    if not model.gaps.size:
        return found
    every = Pressing._make(np.stack(parts) for parts in zip(*pressing, strict=True))
    surfaces = contacts_of(motion.scene)
    for number, path in enumerate(model.gap_fields):
        here = Pressing._make(part[:, number] for part in every)
        if path in surfaces:
            one = _between(motion, change, model.gaps, number, path, surfaces[path], here)
        else:
            one = _in_joint(motion, model.gaps, number, path, here)
        found.setdefault(path, []).append(one)
    return found


def together(parts: Sequence[ContactForce]) -> ContactForce:
    """Return the sum of the forces of one contact that touches at several places, where the force that presses is.

    It sticks where one of them does, as they are of one body.
    """
    first, *others = parts
    if not others:
        return first
    normal, friction, force = (
        np.asarray(sum(part))
        for part in zip(*((one.normal, one.friction, one.component.force) for one in parts), strict=True)
    )
    weights = [np.where(normal != 0.0, one.normal, 1.0)[:, None] for one in parts]
    at = sum(weight * one.at for weight, one in zip(weights, parts, strict=True)) / sum(weights)
    modes = np.stack([one.state for one in parts])
    state = np.where(np.any(modes == STICK, axis=0), STICK, np.max(modes, axis=0))
    return first._replace(
        component=first.component._replace(force=force),
        at=np.asarray(at),
        normal=normal,
        friction=friction,
        state=state,
    )


def _in_joint(motion: FreeMotion, gaps: Gaps, number: int, path: str, here: Pressing) -> ContactForce:
    """Return the force of a stop, a rope, a strut, backlash or dry friction on the second body."""
    _, name, field = path.split(".")
    joint, rubs = motion.scene.joints[name], field in ("coulomb", "mu")
    unit, weight = _unit(motion, name, joint, field)
    sign = float(np.sign(gaps.weight[gaps.number[number]].flat[0])) * weight
    force, none = here.force[:, 1 if rubs else 0], np.zeros(len(here.force))
    told = _acts(force) & ~(rubs & (here.mode == SLIP))
    return ContactForce(
        unit.times(sign * force), motion.place(place_of_force(motion.scene, joint)), none if rubs else force,
        np.stack([force if rubs else none], axis=1), here.mode, sign, (told[:, None] * unit.gradient,),
    )  # fmt: skip


def _unit(motion: FreeMotion, name: str, joint: Any, field: str) -> tuple[Component, float]:
    """Return a force along what a one-sided constraint of a joint limits, and the size that a unit multiplier has."""
    if field == "backlash":
        tight = tightened(joint)
        (condition,) = conditions(tight, motion.dimensions)
        (unit,) = of_condition(motion, name, condition)
        return unit._replace(name="backlash"), 1.0 / condition.scale
    if field.startswith("tension"):
        (condition,) = conditions(joint, motion.dimensions)
        unit = tension(motion, name, condition, int(field.removeprefix("tension") or 1) - 1)
        return unit, -1.0  # the length has an upper limit
    if field == "keeps":
        way = motion.gap(joint)
        return pair(motion, name, "axial", joint, way / np.linalg.norm(way, axis=1, keepdims=True), None), 1.0
    label = "stop" if field == "stops" else "friction"
    if isinstance(joint, Slider):
        along = motion.line(joint.first, joint.direction if joint.axis is None else joint.axis)
        return pair(motion, name, label, joint, along, None), 1.0
    return pair(motion, name, label, joint, None, motion.pin(joint)), 1.0


def _between(
    motion: FreeMotion, change: Array, gaps: Gaps, number: int, path: str, contact: Contact, here: Pressing
) -> ContactForce:
    """Return the force of the second surface on the first, of a joint with play that on the second body."""
    force, mode, axes = here.force, here.mode, here.axes
    section, name, *_ = path.split(".")
    d = motion.dimensions
    at = motion.place(contact.first) - _arm(motion, contact, axes[:, 0, :d])
    units = [axes[:, k, :d] for k in range(d)]
    gradients = [_gradient(motion, contact, at, unit) for unit in units]
    whole = np.asarray(sum(force[:, k, None] * unit for k, unit in enumerate(units)))
    gradient = np.asarray(sum(force[:, k, None] * one for k, one in enumerate(gradients)))
    told = _acts(force[:, 0])
    could = told | _touches(motion, gradients[0], change, here)
    slips, rigid = mode == SLIP, gaps.soft[number] == RIGID
    # Friction that slips goes with the normal force; that of a law is known.
    along = np.where((told & slips)[:, None], force[:, 1:d], 0.0) / np.where(told, force[:, 0], 1.0)[:, None]
    open_ = [gradients[0] + sum(along[:, k, None] * gradients[1 + k] for k in range(d - 1))] * bool(rigid)
    open_ += [one * ~slips[:, None] for one in gradients[1:]] * bool(gaps.rubs[number])
    component = Component(name, CONTACT, gradient, whole, np.zeros((len(at), motion.turn_axes)))
    if section == "joints":
        side = place_of_force(motion.scene, motion.scene.joints[name])
        push = whole if contact.first.body == side.body else -whole
        torque = _moment(motion, at - motion.place(side), push)
        component = Component(name, "play", gradient, push, torque)
    return ContactForce(
        component, at, force[:, 0], force[:, 1:d], mode, 1.0,
        tuple(could[:, None] * one for one in open_),
    )  # fmt: skip


def _touches(motion: FreeMotion, gradient: Array, change: Array, here: Pressing) -> Flags:
    """Return at which samples surfaces touch on, be it without a force, as where others bear the load."""
    parts, weight = gradient * change, float(np.linalg.norm(np.array(motion.scene.gravity, dtype=float)))
    scale = np.sum(np.abs(parts), axis=1) + np.abs(here.bias) + weight
    stays = np.abs(np.sum(parts, axis=1) + here.bias) <= TOUCHING * scale
    return np.asarray(stays & (np.abs(here.gap) <= TOUCHING * float(np.ravel(span(motion.scene))[0])))


def _acts(force: Array) -> Flags:
    """Return at which samples there is a force, of a contact that is closed and does not strike."""
    return np.asarray(np.isfinite(force) & (force != 0.0))


def _arm(motion: FreeMotion, contact: Contact, normal: Array) -> Array:
    """Return the way from the point that touches to the first place [m], (samples, d)."""
    towards = normal
    if contact.first.axis is not None:
        axle = motion.held_axis(contact.first, contact.first.axis)
        towards = normal - np.sum(normal * axle, axis=1, keepdims=True) * axle
        towards = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    return float(np.ravel(contact.first.radius)[0]) * towards


def _gradient(motion: FreeMotion, contact: Contact, at: Array, force: Array) -> Array:
    """Return the work of a force on the first body at a point, and of its opposite on the second, per displacement."""
    total = np.zeros((len(at), motion.bodies.unknowns))
    for side, sign in ((contact.first, 1.0), (contact.second, -1.0)):
        moment = _moment(motion, at - motion.place(side), force)
        slope = force @ motion.slope(motion.placement.point(motion.scene, side))
        turn = motion.turn(side)
        turned = np.einsum("nk,nku->nu", moment, np.broadcast_to(turn, (len(at), *turn.shape[1:])))
        total += sign * (slope + turned)
    return total


def _moment(motion: FreeMotion, arm: Array, force: Array) -> Array:
    """Return arm x force, (samples, 1 or in space 3)."""
    return plane.cross(arm.T, force.T)[:, None] if motion.turn_axes == 1 else np.cross(arm, force)
