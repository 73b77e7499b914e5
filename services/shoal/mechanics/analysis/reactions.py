"""Forces and torques in every joint, from the balance of every body taken by itself.

For each free body M a = Q + (what its joints exert), with unknown forces that do work in no displacement the joint
allows. All balances together are solved by least squares. Where joints hold more than they need to (redundant
constraints), the solution of least norm is reported, torques counted as forces at the machine's size as lever, and
the joints whose forces are not unique are named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine
from shoal.mechanics.analysis.evaluate import Evaluator, points
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.freedom import Metric
from shoal.mechanics.analysis.motion_state import states
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.joints import Along, Apart, Condition, Meet, Sum, Turned, conditions, unknown
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.scene import Attachment, Coupling, Revolute, Scene, Slider
from shoal.scene.dimensions import require_plane
from shoal.scene.joints import places
from shoal.trajectory import plain

RANK = 1e-9
SHARE = 1e-6
"""A component that takes part in a self-stress (of unit size) by less than this is unique."""
BALANCED = 1e-6


@dataclass(frozen=True)
class JointReaction:
    """What a joint exerts on its second body (on its first: the opposite).

    at: where [m]; force [N] and torque [N m] (counter-clockwise), friction included; components: each unknown of the
    joint by name (fx, fy, torque, normal, axial, coupled) with its value; unique: whether none of them could be
    different with the same motion.
    """

    joint: str
    kind: str
    at: tuple[float, ...]
    force: tuple[float, ...]
    torque: float
    components: dict[str, float]
    unique: bool


@dataclass(frozen=True)
class Reactions:
    """Reactions at one state.

    redundancy: how many self-stresses are possible. constraints: those of the model that depend on others, at a
    neighbouring state as well. unbalanced: what no joint can balance, relative to all forces.
    """

    time: float
    joints: dict[str, JointReaction]
    redundancy: int
    constraints: tuple[str, ...]
    unbalanced: float

    @property
    def ok(self) -> bool:
        """Whether all bodies are balanced."""
        return self.unbalanced < BALANCED

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
        }


class _Component(NamedTuple):
    """One unknown of a joint: its work per displacement of the free bodies, and the force it is per unit [N]."""

    joint: str
    name: str
    gradient: Array
    force: Array
    torque: bool


def reactions(scene: Scene, times: Sequence[float] = (0.0,)) -> list[Reactions]:
    """Reactions in the motion of a scene at requested times [s]. Raises InputError, ComputationError."""
    require_plane(scene, "reactions are")
    evaluator, found = states(scene, times)
    bodies = FreeBodies(evaluator, max(times))
    result = []
    for state in found:
        evaluator.turns = state.turns
        result.append(reactions_of(evaluator, state.q, state.v, state.a, state.time, bodies=bodies))
    return result


def reactions_of(
    evaluator: Evaluator, q: Array, v: Array, a: Array, t: float = 0.0, *, bodies: FreeBodies | None = None
) -> Reactions:
    """Reactions at one state: coordinates, rates and accelerations, each (unknowns,)."""
    bodies = bodies or FreeBodies(evaluator, t)
    rubbing = evaluator.model.forces.size - bodies.evaluator.model.forces.size
    bodies.evaluator.turns = evaluator.turns[rubbing:]
    at, rate, change = bodies.state(q, v, a)
    free = bodies.evaluator
    lever = span(bodies.scene)
    told = [(name, one) for name, joint in bodies.scene.joints.items() for one in conditions(joint)]
    unknown = [part for name, one in told for part in _of_condition(bodies, name, one, at)]
    known, rubbed = _friction(bodies, at, rate)
    force = free.at(at, rate, t).force
    inertia = bodies.mass @ change
    displacements = _displacements(bodies, at, lever)
    missing = displacements @ (inertia - force - known)
    scale = max(
        float(np.linalg.norm(displacements @ part)) for part in (inertia, force, known, force - free.at(at).elastic)
    )
    count = len(unknown)
    columns = np.zeros((len(displacements), count))
    for k, part in enumerate(unknown):
        columns[:, k] = displacements @ part.gradient * (lever if part.torque else 1.0)
    left, sizes, right = np.linalg.svd(columns, full_matrices=True)
    rank = int(np.sum(sizes > RANK * sizes[0])) if count and len(sizes) else 0
    solution = right[:rank].T @ ((left[:, :rank].T @ missing) / sizes[:rank])
    rest = float(np.linalg.norm(missing - columns @ solution))
    free_play = np.linalg.norm(right[rank:], axis=0) if rank < count else np.zeros(count)
    joints = {}
    for name in bodies.scene.joints:
        mine = [k for k, part in enumerate(unknown) if part.joint == name]
        values = {k: float(solution[k]) * (lever if unknown[k].torque else 1.0) for k in mine}
        rubbing_force, rubbing_torque = rubbed.get(name, (np.zeros(plane.DIMENSIONS), 0.0))
        total = sum((unknown[k].force * values[k] for k in mine), rubbing_force)
        torque = sum(values[k] for k in mine if unknown[k].torque) + rubbing_torque
        joint = bodies.scene.joints[name]
        joints[name] = JointReaction(
            name,
            joint.kind,
            tuple(_place(bodies, _second(joint), at).value.tolist()),
            tuple(total.tolist()),
            float(torque),
            {unknown[k].name: values[k] for k in mine},
            bool(np.all(free_play[mine] < SHARE)),
        )
    names = redundant_constraints(evaluator, q, t)
    return Reactions(t, joints, count - rank, names, rest / scale if scale > 0 else 0.0)


def redundant_constraints(evaluator: Evaluator, q: Array, t: float = 0.0) -> tuple[str, ...]:
    """Names of the constraints that depend on others, at q and, if the machine can move, at a state beside it too."""
    if evaluator.model.constraints.size == 0:
        return ()
    metric = Metric(evaluator.mass)
    freedom = metric.freedom(evaluator.at(q, t=t).jacobian)
    if freedom.dependent.shape[1] == 0:
        return ()
    if freedom.basis.shape[1]:
        # A fixed combination of all free directions, long enough to leave a singular position.
        step = freedom.basis @ np.cos(1.0 + np.arange(freedom.basis.shape[1]))
        q = q + 0.05 * step / np.max(np.abs(step))
        for _ in range(20):
            evaluation = evaluator.at(q, t=t)
            q = q + metric.freedom(evaluation.jacobian).shift(-evaluation.gap)
        freedom = metric.freedom(evaluator.at(q, t=t).jacobian)
    involved = np.max(np.abs(freedom.dependent), axis=1, initial=0.0) > SHARE
    names = evaluator.model.constraint_names
    return tuple(dict.fromkeys(name for name, yes in zip(names, involved, strict=True) if yes))


def _second(joint: Any) -> Attachment:
    return places(joint)[0] if isinstance(joint, Coupling) else joint.second


class _Moving(NamedTuple):
    """A vector of the free bodies and its derivative: (d,) and (d, unknowns)."""

    value: Array
    slope: Array


def _moving(bodies: FreeBodies, vector: Affine, at: Array) -> _Moving:
    found = points([vector], bodies.unknowns)
    return _Moving(found.at(at)[0], found.matrix[0])


def _place(bodies: FreeBodies, side: Attachment, at: Array) -> _Moving:
    return _moving(bodies, bodies.placement.point(bodies.scene, side), at)


def _gap(bodies: FreeBodies, condition: Any, at: Array) -> _Moving:
    return _moving(bodies, bodies.placement.gap(bodies.scene, condition), at)


def _turning(bodies: FreeBodies, condition: Any, at: Array) -> Array:
    """d(angle of second - angle of first)."""
    lines = [bodies.placement.direction(bodies.scene, side) for side in (condition.first, condition.second)]
    first, second = points(lines, bodies.unknowns).turning(at)
    return np.asarray(second - first)


def _sliding(bodies: FreeBodies, first: Attachment, second: Attachment, turn: float, at: Array) -> tuple[Array, ...]:
    """Unit vector of a slider's line, and the derivatives of the place along and across it [m]."""
    direction = bodies.placement.direction(bodies.scene, first).turned(plane.rotation(turn))
    line, gap = _moving(bodies, direction, at), _gap(bodies, Along(first, second, turn), at)
    size = np.hypot(*line.value)
    e = line.value / size
    # The line is a direction only: its length does no work, only its turn does.
    turning = plane.cross(line.value, line.slope) / size**2
    along = e @ gap.slope + plane.cross(e, gap.value) * turning
    across = plane.cross(e, gap.slope) - (e @ gap.value) * turning
    return e, along, across


def _of_condition(bodies: FreeBodies, name: str, condition: Condition, at: Array) -> list[_Component]:
    """The unknowns of a condition of a joint."""
    if isinstance(condition, Sum):
        axes = ["xyz".index(term.axis) for term in condition.terms]
        rows = [_place(bodies, term.at, at).slope[axis] for term, axis in zip(condition.terms, axes, strict=True)]
        gradient = sum(term.factor * row for term, row in zip(condition.terms, rows, strict=True))
        force = condition.terms[0].factor * np.eye(plane.DIMENSIONS)[axes[0]]
        return [_Component(name, "coupled", np.asarray(gradient), force, False)]
    if isinstance(condition, Turned):
        none = np.zeros(plane.DIMENSIONS)
        return [_Component(name, "torque", _turning(bodies, condition, at), none, True)]
    if isinstance(condition, Along):
        assert not isinstance(condition.direction, tuple)
        e, _, across = _sliding(bodies, condition.first, condition.second, condition.direction, at)
        return [_Component(name, "normal", across, plane.quarter(e), False)]
    if not isinstance(condition, Meet | Apart):
        raise unknown(condition)
    gap = _gap(bodies, condition, at)
    if isinstance(condition, Apart):
        length = np.hypot(*gap.value)
        along = gap.value / length if length > 0 else np.eye(plane.DIMENSIONS)[0]
        return [_Component(name, "axial", along @ gap.slope, along, False)]
    return [
        _Component(name, f"f{axis}", slope, unit, False)
        for axis, slope, unit in zip("xyz", gap.slope, np.eye(plane.DIMENSIONS), strict=False)
    ]


def _friction(bodies: FreeBodies, at: Array, rate: Array) -> tuple[Array, dict[str, tuple[Array, float]]]:
    """Generalised force of all joint friction, and force and torque of each joint's on its second body."""
    total = np.zeros(bodies.unknowns)
    each: dict[str, tuple[Array, float]] = {}
    for name, joint in bodies.scene.joints.items():
        if not (isinstance(joint, Revolute | Slider) and (joint.friction or joint.coulomb)):
            continue
        if isinstance(joint, Revolute):
            line, gradient = np.zeros(plane.DIMENSIONS), _turning(bodies, joint, at)
        else:
            line, gradient, _ = _sliding(bodies, joint.first, joint.second, joint.direction, at)
        speed = float(gradient @ rate)
        drag = -joint.friction * speed - joint.coulomb * float(np.tanh(speed / joint.coulomb_speed))
        total += drag * gradient
        each[name] = (line * drag, 0.0 if np.any(line) else drag)
    return total, each


def _displacements(bodies: FreeBodies, at: Array, lever: float) -> Array:
    """Displacements of the free bodies whose work must vanish, (displacements, unknowns)."""
    rows = []

    def add(vector: Affine, value: Array) -> None:
        row = np.zeros(bodies.unknowns)
        row[list(vector.own or ())] = value
        rows.append(row)

    axes = np.eye(plane.DIMENSIONS)
    for frame in bodies.placement.frames.values():
        order = len(frame.nodes[0]) if isinstance(frame, BeamFrame) else 1
        free = frame.vectors[:1] if isinstance(frame, RigidFrame) else frame.vectors
        for k, vector in enumerate(free):
            for axis in axes:
                add(vector, axis * lever ** -float(k % order))
        if isinstance(frame, RigidFrame):
            add(frame.directors[0], plane.quarter(frame.directors[0].at(at)) / lever)
    return np.array(rows)
