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
import numpy.typing as npt

from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.free_bodies import FreeBodies, vectors
from shoal.mechanics.analysis.freedom import Metric
from shoal.mechanics.analysis.motion_state import states
from shoal.mechanics.assembly.affine import Affine
from shoal.mechanics.assembly.frames import BeamFrame, PointFrame
from shoal.mechanics.assembly.pose import unit
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Coupling, Distance, Revolute, Scene, Slider, Weld
from shoal.trajectory import plain

Complex = npt.NDArray[np.complex128]
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
    at: tuple[float, float]
    force: tuple[float, float]
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
    force: complex
    torque: bool


def reactions(scene: Scene, times: Sequence[float] = (0.0,)) -> list[Reactions]:
    """Reactions in the motion of a scene at requested times [s]. Raises InputError, ComputationError."""
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
    lever = _lever(bodies, at)
    unknown = [part for name in bodies.scene.joints for part in _components(bodies, name, at)]
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
        total = sum((unknown[k].force * values[k] for k in mine), 0j) + rubbed.get(name, (0j, 0.0))[0]
        torque = sum(values[k] for k in mine if unknown[k].torque) + rubbed.get(name, (0j, 0.0))[1]
        joint = bodies.scene.joints[name]
        place = complex(_value(bodies, _second(joint), at)[0])
        joints[name] = JointReaction(
            name,
            joint.kind,
            (place.real, place.imag),
            (float(total.real), float(total.imag)),
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
    return joint.terms[0].at if isinstance(joint, Coupling) else joint.second


def _rows(bodies: FreeBodies, vector: Affine) -> Complex:
    row = np.zeros(bodies.unknowns, dtype=complex)
    for unknown, coefficient in vector.terms.items():
        row[unknown] = complex(coefficient)
    return row


def _value(bodies: FreeBodies, side: Attachment, at: Array) -> tuple[complex, Complex]:
    """Place [m] of an attachment and its derivative."""
    vector = bodies.placement.point(bodies.scene, side)
    row = _rows(bodies, vector)
    return complex(row @ at + vector.constant), row


def _direction(bodies: FreeBodies, side: Attachment, at: Array) -> tuple[complex, Complex]:
    """Direction vector at an attachment and its derivative."""
    vector = bodies.placement.direction(bodies.scene, side)
    row = _rows(bodies, vector)
    return complex(row @ at + vector.constant), row


def _turning(bodies: FreeBodies, joint: Any, at: Array) -> Array:
    """d(angle of second - angle of first)."""
    total = np.zeros(bodies.unknowns)
    for side, sign in ((joint.first, -1.0), (joint.second, 1.0)):
        direction, row = _direction(bodies, side, at)
        total += sign * np.imag(np.conj(direction) * row) / abs(direction) ** 2
    return total


def _sliding(bodies: FreeBodies, joint: Slider, at: Array) -> tuple[complex, Array, Array]:
    """Unit vector of a slider's line, and the derivatives of the place along and across it [m]."""
    line, line_row = _direction(bodies, joint.first, at)
    turn = complex(unit(joint.direction))
    line, line_row = line * turn, line_row * turn
    (p, p_row), (q, q_row) = (_value(bodies, side, at) for side in (joint.first, joint.second))
    size = abs(line)
    both = (np.conj(line) * (q_row - p_row) + np.conj(line_row) * (q - p)) / size
    # The line is a direction only: its length does no work.
    both = both - np.conj(line) * (q - p) * np.real(np.conj(line) * line_row) / size**3
    return line / size, both.real, both.imag


def _components(bodies: FreeBodies, name: str, at: Array) -> list[_Component]:
    """The unknowns of a joint."""
    joint = bodies.scene.joints[name]
    if isinstance(joint, Coupling):
        gradient = np.zeros(bodies.unknowns)
        for term in joint.terms:
            _, row = _value(bodies, term.at, at)
            gradient += term.factor * (row.real if term.axis == "x" else row.imag)
        first = joint.terms[0]
        return [_Component(name, "coupled", gradient, first.factor * (1.0 if first.axis == "x" else 1j), False)]
    (p, p_row), (q, q_row) = (_value(bodies, side, at) for side in (joint.first, joint.second))
    gap = q_row - p_row
    found = []
    if isinstance(joint, Revolute | Weld):
        found += [_Component(name, "fx", gap.real, 1.0, False), _Component(name, "fy", gap.imag, 1j, False)]
    elif isinstance(joint, Slider):
        line, _, across = _sliding(bodies, joint, at)
        found.append(_Component(name, "normal", across, 1j * line, False))
    elif isinstance(joint, Distance):
        along = (q - p) / abs(q - p) if q != p else 1.0
        found.append(_Component(name, "axial", np.real(np.conj(along) * gap), along, False))
    if not isinstance(joint, Revolute | Distance) and not (isinstance(joint, Slider) and joint.rotation == "free"):
        found.append(_Component(name, "torque", _turning(bodies, joint, at), 0.0, True))
    return found


def _friction(bodies: FreeBodies, at: Array, rate: Array) -> tuple[Array, dict[str, tuple[complex, float]]]:
    """Generalised force of all joint friction, and force and torque of each joint's on its second body."""
    total = np.zeros(bodies.unknowns)
    each: dict[str, tuple[complex, float]] = {}
    for name, joint in bodies.scene.joints.items():
        if not (isinstance(joint, Revolute | Slider) and (joint.friction or joint.coulomb)):
            continue
        if isinstance(joint, Revolute):
            line, gradient = 0j, _turning(bodies, joint, at)
        else:
            line, gradient, _ = _sliding(bodies, joint, at)
        speed = float(gradient @ rate)
        drag = -joint.friction * speed - joint.coulomb * float(np.tanh(speed / joint.coulomb_speed))
        total += drag * gradient
        each[name] = (line * drag, 0.0 if line else drag)
    return total, each


def _displacements(bodies: FreeBodies, at: Array, lever: float) -> Array:
    """Displacements of the free bodies whose work must vanish, (displacements, unknowns)."""
    rows = []

    def add(*parts: tuple[Any, complex]) -> None:
        row = np.zeros(bodies.unknowns)
        for vector, value in parts:
            x, y = vector.pair
            row[x], row[y] = value.real, value.imag
        rows.append(row)

    for frame in bodies.placement.frames.values():
        if isinstance(frame, PointFrame | BeamFrame):
            order = len(frame.nodes[0]) if isinstance(frame, BeamFrame) else 1
            for k, vector in enumerate(vectors(frame)):
                scale = lever ** -float(k % order)
                add((vector, scale + 0j))
                add((vector, 1j * scale))
            continue
        add((frame.origin, 1.0 + 0j))
        add((frame.origin, 1j))
        assert frame.axis.pair is not None
        x, y = frame.axis.pair
        add((frame.axis, 1j * complex(at[x], at[y]) / lever))
    return np.array(rows)


def _lever(bodies: FreeBodies, at: Array) -> float:
    """The size of the machine [m]: its largest distance between joints, or 1."""
    places = [_value(bodies, _second(joint), at)[0] for joint in bodies.scene.joints.values()]
    for body in bodies.scene.bodies.values():
        places += [complex(*point) for point in body.points.values()]
    return float(max((abs(a - b) for a in places for b in places), default=0.0)) or 1.0
