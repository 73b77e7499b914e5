"""Joint reactions: forces and torques in every joint by the balance of free bodies (Newton-Euler equations).

For each free body M a = Q + R, with the reactions R of its joints as unknowns, which do no work in displacements that
the joints allow. All balances together are solved by least squares. With redundant constraints the solution of least
norm is reported, torques over the machine's size as forces, and the joints whose forces are not unique are named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from shoal.error_budget import ErrorBudget
from shoal.errors import InputError
from shoal.findings import Concluded, Finding, worst_implied
from shoal.json_values import plain
from shoal.mechanics.analysis import reaction_findings as kinds
from shoal.mechanics.analysis.balance import metric_of
from shoal.mechanics.analysis.contact_forces import CONTACT, ContactForce, contact_forces, together
from shoal.mechanics.analysis.evaluate import Evaluator, Pressing
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.free_motion import FreeMotion
from shoal.mechanics.analysis.joint_forces import (
    Component,
    Displacements,
    components,
    displacements,
    friction,
    rotors,
    work,
)
from shoal.mechanics.analysis.reaction_findings import ReactionsStatus
from shoal.mechanics.analysis.singular import SHARE, nearby_freedom
from shoal.mechanics.event_record import place_of
from shoal.mechanics.gaps import SLIP, STICK
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, Flags
from shoal.mechanics.reach import span
from shoal.mechanics.rubbing import ROUNDS, SETTLED
from shoal.mechanics.sums import place_of_force
from shoal.scene import Revolute, Scene, Slider

RANK = 1e-9
BALANCED = 1e-6


@dataclass(frozen=True)
class JointReaction:
    """Reaction of a joint on its second body (on its first: the opposite).

    at: where [m]; force [N] and torque [N m] (counter-clockwise, in space a vector), friction and stops included;
    components: each unknown of the joint by name (fx, fy, torque, normal, axial, coupled, stop, ...) with its value;
    unique: whether the motion determines them all. force_error [N], torque_error [N m]: estimated by other runs
    (`reactions_verified`), the sum of the errors of steps, mesh and the theory of slender rods; None where not
    estimated.
    """

    joint: str
    kind: str
    at: tuple[float, ...]
    force: tuple[float, ...]
    torque: float | tuple[float, ...]
    components: dict[str, float]
    unique: bool
    force_error: float | None = None
    torque_error: float | None = None


@dataclass(frozen=True)
class ContactReaction:
    """Force of a contact on its first body (on its second: the opposite).

    at: where they touch [m]; force [N]; normal: what presses [N]; friction: in the plane along the normal turned
    clockwise, in space its size [N]; state: open, presses (without friction), sticks or slips; unique, force_error: as
    of a joint.
    """

    contact: str
    at: tuple[float, ...]
    force: tuple[float, ...]
    normal: float
    friction: float
    state: str
    unique: bool
    force_error: float | None = None


@dataclass(frozen=True)
class Reactions(Concluded):
    """Reactions at one state.

    redundancy: number of independent self-stresses. constraints: those of the model that depend on others, at a
    neighbouring state as well. unbalanced: residual of the balances, relative to all forces. scale: size of all forces
    on the bodies [N], torques by the machine's size. remarks: on the agreement with other runs, if there were any
    (`reactions_verified`). errors: of the forces at all times [N], by source, the largest of all joints and contacts.
    contacts: between surfaces. impacts: events at this time, at which there are impulses and no forces.
    """

    time: float
    joints: dict[str, JointReaction]
    redundancy: int
    constraints: tuple[str, ...]
    unbalanced: float
    scale: float = 0.0
    remarks: Sequence[Finding] = ()
    errors: ErrorBudget = field(default_factory=ErrorBudget)
    contacts: Mapping[str, ContactReaction] = field(default_factory=dict)
    impacts: Sequence[Mapping[str, Any]] = ()

    @property
    def ok(self) -> bool:
        """Return whether all bodies are balanced, by forces that do not depend on the steps."""
        return self.status is ReactionsStatus.OK

    @property
    def status(self) -> ReactionsStatus:
        """The worst status that the findings imply."""
        return worst_implied(self.findings, ReactionsStatus)

    @property
    def findings(self) -> list[Finding]:  # type: ignore[override]
        """Findings about the balance of the bodies, and of other runs."""
        if self.impacts:
            struck = ", ".join(
                f"{place_of(one)} with an impulse of {one['impulse']:.6g} N s (or N m s)" for one in self.impacts
            )
            return [kinds.IMPACT.found(f"impact at t = {self.time:g} s: {struck}; there are no forces")]
        off = kinds.UNBALANCED.found("the bodies are not in balance", residual=self.unbalanced)
        return [*([] if self.unbalanced < BALANCED else [off]), *self.remarks]

    @property
    def not_unique(self) -> tuple[str, ...]:
        """Joints and contacts whose forces are not unique."""
        joints = [name for name, one in self.joints.items() if not one.unique]
        return (*joints, *(name for name, one in self.contacts.items() if not one.unique))

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "time": self.time,
            "joints": {name: plain(vars(joint)) for name, joint in self.joints.items()},
            **({"contacts": {name: plain(vars(one)) for name, one in self.contacts.items()}} if self.contacts else {}),
            **({"impacts": plain(list(self.impacts))} if self.impacts else {}),
            "redundancy": self.redundancy,
            "not_unique": list(self.not_unique),
            "redundant_constraints": list(self.constraints),
            "unbalanced": plain(self.unbalanced),
            "error": plain(self.errors.total),
            "errors": plain(self.errors.to_json()),
        }


def to_json(found: list[Reactions]) -> dict[str, Any]:
    """Return plain data of reactions at some times, with the first status that is not ok."""
    worst = next((one for one in found if not one.ok), found[0])
    return {
        "status": str(worst.status),
        "message": worst.message,
        "advice": worst.advice,
        "findings": [one.to_json() for one in worst.findings],
        "reactions": [one.to_json() for one in found],
    }


class Exerted(NamedTuple):
    """Forces of all joints and contacts along a motion.

    parts: the unknowns; sizes: of each [N or N m], (samples, parts); free_play: how much of each could be different
    with the same motion, 0 to 1, (samples, parts); friction: of the joints that resist; contacts: by what states them;
    loose: how much of each contact could be different, by `contacts.NAME` or `joints.NAME`. redundancy: of
    self-stresses; unbalanced: what no joint can balance [N]; scale: size of all forces [N]; (samples,) each. none: no
    force and no torque, (samples, ...)
    """

    parts: list[Component]
    sizes: Array
    free_play: Array
    friction: dict[str, Component]
    contacts: dict[str, list[ContactForce]]
    loose: dict[str, Array]
    redundancy: Array
    unbalanced: Array
    scale: Array
    none: tuple[Array, Array]

    def of(self, joint: str) -> tuple[Array, Array]:
        """Return force [N] and torque [N m] of a joint on its second body, friction included, (samples, ...)."""
        acting = [part.times(self.sizes[:, k]) for k, part in enumerate(self.parts) if part.joint == joint]
        acting += [self.friction[joint]] if joint in self.friction else []
        acting += [one.component for one in self._one_sided(joint)]
        force, torque = self.none
        return sum((one.force for one in acting), force), sum((one.torque for one in acting), torque)

    def shares(self, joint: str) -> Array:
        """Return how much of the forces of a joint, or of `contacts.NAME`, could be different, (samples,)."""
        mine = [k for k, part in enumerate(self.parts) if part.joint == joint]
        own = np.max(self.free_play[:, mine], axis=1, initial=0.0)
        name = joint if joint.startswith("contacts.") else f"joints.{joint}"
        return np.asarray(np.maximum(own, self.loose.get(name, 0.0)))

    def components(self, joint: str) -> dict[str, Array]:
        """Return the unknowns of a joint by name, those of stops, ropes and struts among them, (samples,) each."""
        found = {part.name: self.sizes[:, k] for k, part in enumerate(self.parts) if part.joint == joint}
        for one in self._one_sided(joint):
            if one.component.name != "friction":
                found[one.component.name] = found.get(one.component.name, 0.0) + one.sign * one.normal
        return found

    def _one_sided(self, joint: str) -> list[ContactForce]:
        """Return its stops, its rope or strut, and its dry friction that sticks."""
        own = (one for field, of in self.contacts.items() if field.startswith(f"joints.{joint}.") for one in of)
        return list(own)

    def surfaces(self) -> dict[str, ContactForce]:
        """Return the contacts between two surfaces by name, of a polygon with all of its corners or edges."""
        found: dict[str, list[ContactForce]] = {}
        for each in (one for of in self.contacts.values() for one in of if one.component.name == CONTACT):
            found.setdefault(each.component.joint, []).append(each)
        return {name: together(parts) for name, parts in found.items()}


def exerted(
    motion: FreeMotion, change: Array, force: Array, elastic: Array, acting: dict[str, list[ContactForce]]
) -> Exerted:
    """Return what joints exert where the bodies accelerate by `change` under `force`, of which `elastic` is elastic.

    Each (samples, unknowns) of the free bodies. acting: the contacts, which are known, by what states them
    """
    at, lever = motion.at, float(np.ravel(span(motion.scene))[0])
    inertia = (motion.bodies.mass @ change.T).T
    parts, moves = components(motion), displacements(motion, lever)
    count = len(parts)
    units = np.array([lever if part.turns else 1.0 for part in parts])
    columns = (
        np.stack([unit * work(moves, part.gradient) for unit, part in zip(units, parts, strict=True)], axis=-1)
        if count
        else np.zeros((len(change), work(moves, inertia).shape[1], 0))
    )
    # Displacements in which no joint does work, as those of inner nodes of rods, tell nothing about the joints.
    touched = np.any(columns, axis=(0, 2))
    left, singular, right = np.linalg.svd(columns[:, touched], full_matrices=False)
    kept = singular > RANK * singular[:, :1]
    inverse = np.where(kept, 1.0 / np.where(kept, singular, 1.0), 0.0)
    touching = [one for of_field in acting.values() for one in of_field]
    pressing = sum((one.component.gradient for one in touching), rotors(motion, change))
    held: dict[str, Array] = {}
    for _ in range(ROUNDS):
        rubbed = friction(motion, held)
        known = sum((part.gradient for part in rubbed.values()), pressing)
        missing = work(moves, inertia - force - known)
        told = np.einsum("nrk,nr->nk", right, inverse * np.einsum("nwr,nw->nr", left, missing[:, touched]))
        last, held = held, _pressed(motion.scene, parts, told)
        if all(np.all(np.abs(now - last.get(name, 0.0)) <= SETTLED * now) for name, now in held.items()):
            break
    loads = (inertia, force, known, force - elastic)
    free_play, loose = _free_play(columns, right, kept, moves, acting)
    return Exerted(
        parts,
        told * units,
        free_play,
        rubbed,
        acting,
        loose,
        count - kept.sum(axis=1),
        np.linalg.norm(missing - np.einsum("nwk,nk->nw", columns, told), axis=1),
        np.max([np.linalg.norm(work(moves, one), axis=1) for one in loads], axis=0),
        (np.zeros((len(at), motion.dimensions)), np.zeros((len(at), motion.turn_axes))),
    )


def _free_play(
    columns: Array, right: Array, kept: Flags, moves: list[Displacements], acting: dict[str, list[ContactForce]]
) -> tuple[Array, dict[str, Array]]:
    """Return how much of the unknowns of joints is not unique, and of contacts by `joints.NAME` or `contacts.NAME`.

    Of contacts that is how far their force as a whole could be different.
    """
    more = [
        (".".join(path.split(".")[:2]), each) for path, parts in acting.items() for one in parts for each in one.open
    ]
    if not more:
        return np.sqrt(np.maximum(0.0, 1.0 - np.sum(np.where(kept[..., None], right, 0.0) ** 2, axis=1))), {}
    works = np.stack([work(moves, each) for _, each in more], axis=-1)
    sizes = np.linalg.norm(works, axis=1, keepdims=True)
    units = works / np.where(sizes > 0.0, sizes, 1.0)
    columns = np.concatenate([columns, units], axis=-1)
    _, singular, right = np.linalg.svd(columns, full_matrices=False)
    held = np.where((singular > RANK * singular[:, :1])[..., None], right, 0.0)
    open_ = np.eye(columns.shape[-1]) - np.swapaxes(held, 1, 2) @ held
    count, loose = columns.shape[-1] - len(more), dict[str, Array]()
    for whole in dict.fromkeys(name for name, _ in more):
        mine = [k for k, (name, _) in enumerate(more) if name == whole]
        net = units[:, :, mine] @ open_[:, [count + k for k in mine]]
        loose[whole] = np.linalg.norm(net, axis=(1, 2))
    return np.sqrt(np.maximum(0.0, np.diagonal(open_, axis1=1, axis2=2)))[:, :count], loose


def _pressed(scene: Scene, parts: list[Component], sizes: Array) -> dict[str, Array]:
    """Return the force [N] of each joint whose friction depends on it, (samples,)."""
    found = {}
    for name, joint in scene.joints.items():
        if isinstance(joint, Revolute | Slider) and joint.share and joint.stick == "smooth":
            mine = [part.times(sizes[:, k]) for k, part in enumerate(parts) if part.joint == name and not part.turns]
            found[name] = np.linalg.norm(sum(one.force for one in mine), axis=1)
    return found


def reactions_of(
    evaluator: Evaluator,
    q: Array,
    v: Array,
    a: Array,
    t: float = 0.0,
    *,
    bodies: FreeBodies | None = None,
    pressing: Pressing | None = None,
    impacts: Sequence[Mapping[str, Any]] = (),
    resting: bool = False,
) -> Reactions:
    """Return the reactions at one state: coordinates, rates and accelerations, each (unknowns,).

    resting: whether states of the user stand in place of their unknowns, as at rest;
    pressing: what contacts exert, of a machine that has some; impacts: at this time.
    """
    bodies = bodies or FreeBodies(evaluator, t)
    rubbing = evaluator.model.forces.size - bodies.evaluator.model.forces.size
    bodies.evaluator.turns = evaluator.force_turns[rubbing:]
    bodies.follow(evaluator.strengths(q, None if resting else v, t))
    at, rate, change = bodies.state(q, v, a)
    motion = FreeMotion(bodies, at[None], rate[None])
    here = bodies.evaluator.at(at, rate, t)
    if pressing is None and evaluator.gaps.size:
        pressing = evaluator.pressed(q, np.zeros(evaluator.gaps.size))
    acting = {} if pressing is None else contact_forces(motion, change[None], evaluator.model, [pressing])
    told = exerted(motion, change[None], here.force[None], bodies.evaluator.at(at).elastic[None], acting)
    found = {}
    for name, joint in bodies.scene.joints.items():
        force, torque = (one[0].tolist() for one in told.of(name))
        found[name] = JointReaction(
            name,
            joint.kind,
            tuple(motion.place(place_of_force(motion.scene, joint))[0].tolist()),
            tuple(force),
            torque[0] if len(torque) == 1 else tuple(torque),
            {part: float(size[0]) for part, size in told.components(name).items()},
            bool(told.shares(name)[0] < SHARE),
        )
    scale, redundancy = float(told.scale[0]), int(told.redundancy[0])
    # Without a self-stress only rows of the model depend on each other, as both parts of a driven angle on a director.
    names = redundant_constraints(evaluator, q, t) if redundancy else ()
    contacts = {
        name: ContactReaction(
            name, tuple(one.at[0].tolist()), tuple(one.component.force[0].tolist()), float(one.normal[0]),
            float(one.friction[0, 0] if motion.turn_axes == 1 else np.linalg.norm(one.friction[0])),
            _state(one), bool(np.all(told.loose.get(f"contacts.{name}", 0.0) < SHARE)),
        )
        for name, one in told.surfaces().items()
    }  # fmt: skip
    unbalanced = float(told.unbalanced[0]) / scale if scale > 0 else 0.0
    return Reactions(t, found, redundancy, names, unbalanced, scale, contacts=contacts, impacts=impacts)


def _state(one: ContactForce) -> str:
    """Return what a contact does at the first sample."""
    if np.isnan(one.normal[0]):
        return "strikes"
    states = {STICK: "sticks", SLIP: "slips"}
    return states.get(float(one.state[0]), "presses" if one.normal[0] != 0.0 else "open")


def require_unique_friction(model: Model) -> None:
    """Raises InputError where friction depends on the force of a joint that other joints may bear as well."""
    evaluator = Evaluator(model, one_sided=True, held=True)
    sharing = _sharing(evaluator, model.q0[:, 0], 0.0)
    firsts, counts = (*model.rubbing.first, *model.gaps.held), (*model.rubbing.parts, *model.gaps.parts)
    for first, parts in zip(firsts, counts, strict=True):
        if np.any(sharing[first : first + parts] > SHARE):
            name = model.constraint_names[first]
            raise InputError(
                f"joints.{name}.mu: the force of {name} is not unique, as {model.scene.name} holds itself more than "
                "it needs to; leave out what is redundant (in space some hinges can be spherical or cylindrical), or "
                "use coulomb"
            )


def redundant_constraints(evaluator: Evaluator, q: Array, t: float = 0.0) -> tuple[str, ...]:
    """Names of the constraints that depend on others, at q and, if the machine can move, at a state beside it too."""
    names, sharing = evaluator.model.constraint_names, _sharing(evaluator, q, t)
    return tuple(dict.fromkeys(name for name, part in zip(names, sharing, strict=True) if part > SHARE))


def _sharing(evaluator: Evaluator, q: Array, t: float) -> Array:
    """The largest part of every constraint in what depends on others, (constraints,)."""
    none = np.zeros(evaluator.model.constraints.size)
    if not none.size:
        return none
    metric = metric_of(evaluator)
    freedom = metric.freedom(evaluator.at(q, t=t).jacobian)
    if freedom.dependent.shape[1] == 0:
        return none
    near = nearby_freedom(evaluator, metric, freedom, q, t)
    return np.asarray(np.max(np.abs(near.dependent), axis=1, initial=0.0))
