"""Forces and torques in every joint, from the balance of every body taken by itself.

For each free body M a = Q + (what its joints exert), with unknown forces that do work in no displacement the joint
allows. All balances together are solved by least squares. Where joints hold more than they need to (redundant
constraints), the solution of least norm is reported, torques counted as forces at the machine's size as lever, and
the joints whose forces are not unique are named.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.error_budget import ErrorBudget
from shoal.errors import InputError
from shoal.mechanics import joints, plane
from shoal.mechanics.analysis import plane_forces, space_forces
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.freedom import Metric
from shoal.mechanics.analysis.joint_forces import Component, friction, place
from shoal.mechanics.analysis.singular import SHARE, beside
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.mechanics.rubbing import ROUNDS, SETTLED
from shoal.scene import Attachment, Coupling, Revolute, Scene, Slider
from shoal.scene.joints import places
from shoal.trajectory import plain

RANK = 1e-9
BALANCED = 1e-6


@dataclass(frozen=True)
class JointReaction:
    """What a joint exerts on its second body (on its first: the opposite).

    at: where [m]; force [N] and torque [N m] (counter-clockwise, in space a vector), friction included; components:
    each unknown of the joint by name (fx, fy, torque, normal, axial, coupled, ...) with its value; unique: whether none
    of them could be different with the same motion. force_error [N], torque_error [N m]: how far other runs are away
    (`reactions_verified`): with other steps, more elements and what slender rods leave out, all together; None where
    there was none.
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
class Reactions:
    """Reactions at one state.

    redundancy: how many self-stresses are possible. constraints: those of the model that depend on others, at a
    neighbouring state as well. unbalanced: what no joint can balance, relative to all forces. scale: size of all forces
    on the bodies [N], torques by the machine's size. settled: whether the forces agree with those of another run, as
    far as there was one (`reactions_verified`); message: what of that is to be known. errors: of the forces at all
    times [N], by source, the largest of all joints.
    """

    time: float
    joints: dict[str, JointReaction]
    redundancy: int
    constraints: tuple[str, ...]
    unbalanced: float
    scale: float = 0.0
    settled: bool = True
    message: str = ""
    errors: ErrorBudget = field(default_factory=ErrorBudget)

    @property
    def ok(self) -> bool:
        """Whether all bodies are balanced, by forces that do not depend on the steps."""
        return self.status == "ok"

    @property
    def status(self) -> str:
        """ok, unbalanced, or inaccurate: the forces depend on the steps."""
        if not self.unbalanced < BALANCED:
            return "unbalanced"
        return "ok" if self.settled else "inaccurate"

    @property
    def not_unique(self) -> tuple[str, ...]:
        """Joints whose forces are not unique."""
        return tuple(name for name, joint in self.joints.items() if not joint.unique)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "time": self.time,
            "joints": {name: plain(vars(joint)) for name, joint in self.joints.items()},
            "redundancy": self.redundancy,
            "not_unique": list(self.not_unique),
            "redundant_constraints": list(self.constraints),
            "unbalanced": plain(self.unbalanced),
            "error": plain(self.errors.total),
            "errors": plain(self.errors.to_json()),
        }


def told(found: list[Reactions]) -> dict[str, Any]:
    """Plain data of reactions at some times, with the first status that is not ok."""
    worst = next((one for one in found if not one.ok), found[0])
    message = "the bodies are not in balance" if worst.status == "unbalanced" else worst.message
    return {"status": worst.status, "message": message, "reactions": [one.to_json() for one in found]}


def reactions_of(
    evaluator: Evaluator,
    q: Array,
    v: Array,
    a: Array,
    t: float = 0.0,
    *,
    bodies: FreeBodies | None = None,
    naming: bool = True,
) -> Reactions:
    """Reactions at one state: coordinates, rates and accelerations, each (unknowns,).

    naming: whether the constraints that depend on others are named, which takes most of the time
    """
    bodies = bodies or FreeBodies(evaluator, t)
    rubbing = evaluator.model.forces.size - bodies.evaluator.model.forces.size
    bodies.evaluator.turns = evaluator.turns[rubbing:]
    at, rate, change = bodies.state(q, v, a)
    free = bodies.evaluator
    lever = span(bodies.scene)
    here: Any = plane_forces if bodies.scene.dimensions == plane.DIMENSIONS else space_forces
    told = joints.of_scene(bodies.scene)
    unknown = [part for name, one in told for part in here.components(bodies, name, one, at)]
    force = free.at(at, rate, t).force
    inertia = bodies.mass @ change
    displacements = here.displacements(bodies, at, lever)
    count = len(unknown)
    columns = np.zeros((len(displacements), count))
    for k, part in enumerate(unknown):
        columns[:, k] = displacements @ part.gradient * (lever if part.turns else 1.0)
    left, sizes, right = np.linalg.svd(columns, full_matrices=True)
    rank = int(np.sum(sizes > RANK * sizes[0])) if count and len(sizes) else 0
    held: dict[str, float] = {}
    for _ in range(ROUNDS):
        known, rubbed = friction(bodies, at, rate, here.rubbing, held)
        missing = displacements @ (inertia - force - known)
        solution = right[:rank].T @ ((left[:, :rank].T @ missing) / sizes[:rank])
        last, held = held, _pressed(bodies.scene, unknown, solution)
        if all(abs(size - last.get(name, 0.0)) <= SETTLED * size for name, size in held.items()):
            break
    scale = max(
        float(np.linalg.norm(displacements @ part)) for part in (inertia, force, known, force - free.at(at).elastic)
    )
    rest = float(np.linalg.norm(missing - columns @ solution))
    free_play = np.linalg.norm(right[rank:], axis=0) if rank < count else np.zeros(count)
    found = {}
    for name in bodies.scene.joints:
        mine = [k for k, part in enumerate(unknown) if part.joint == name]
        values = {k: float(solution[k]) * (lever if unknown[k].turns else 1.0) for k in mine}
        none = np.zeros(bodies.scene.dimensions), np.zeros(1 if here is plane_forces else 3)
        rubbing_force, rubbing_torque = rubbed.get(name, none)
        total = sum((unknown[k].force * values[k] for k in mine), rubbing_force)
        torque = sum((unknown[k].torque * values[k] for k in mine), rubbing_torque).tolist()
        joint = bodies.scene.joints[name]
        found[name] = JointReaction(
            name,
            joint.kind,
            tuple(place(bodies, _second(joint), at).value.tolist()),
            tuple(total.tolist()),
            torque[0] if here is plane_forces else tuple(torque),
            {unknown[k].name: values[k] for k in mine},
            bool(np.all(free_play[mine] < SHARE)),
        )
    # Without a self-stress only rows of the model depend on each other, as both parts of a driven angle on a director.
    names = redundant_constraints(evaluator, q, t) if naming and count > rank else ()
    return Reactions(t, found, count - rank, names, rest / scale if scale > 0 else 0.0, scale)


def _pressed(scene: Scene, unknown: list[Component], solution: Array) -> dict[str, float]:
    """The force [N] of each joint whose friction depends on it."""
    found = {}
    for name, joint in scene.joints.items():
        if isinstance(joint, Revolute | Slider) and joint.share:
            mine = [solution[k] * part.force for k, part in enumerate(unknown) if part.joint == name and not part.turns]
            found[name] = float(np.linalg.norm(sum(mine)))
    return found


def require_unique_friction(model: Model) -> None:
    """Raises InputError where friction depends on the force of a joint that other joints may bear as well."""
    evaluator = Evaluator(model)
    sharing = _sharing(evaluator, model.q0[:, 0], 0.0)
    for first, parts in zip(model.rubbing.first, model.rubbing.parts, strict=True):
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
    metric = Metric(evaluator.mass)
    freedom = metric.freedom(evaluator.at(q, t=t).jacobian)
    if freedom.dependent.shape[1] == 0:
        return none
    near = beside(evaluator, metric, freedom, q, t)
    return np.asarray(np.max(np.abs(near.dependent), axis=1, initial=0.0))


def _second(joint: Any) -> Attachment:
    return places(joint)[0] if isinstance(joint, Coupling) else joint.second
