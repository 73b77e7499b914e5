"""A door to the compiled kernels for one state of a model: forces, constraints, energies and tangents, as arrays.

The equations of motion are M a = Q - C_q' lambda with C(q, t) = 0; at rest, Q(q, 0, t) = C_q' lambda. For checks,
statics and small motions; the time loop does not come this way.

A state x of the user is the rate of an unknown, times its size. Where no rates are given, at rest, that unknown is the
state itself, and its row of Q is its rate, which the balance of forces lets vanish with all others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse

from shoal.compile import structures
from shoal.errors import InputError
from shoal.mechanics import forces, functions, plane, signals
from shoal.mechanics.analysis import evaluations
from shoal.mechanics.analysis.load_stiffness import driven, in_plane, in_space, of_drives
from shoal.mechanics.applied import Applied
from shoal.mechanics.assembly.masses import STATE
from shoal.mechanics.closed_loop import feedback_at
from shoal.mechanics.dynamics import derived_rows, work_space
from shoal.mechanics.elements.families import KERNELS, lay
from shoal.mechanics.functions import Functions
from shoal.mechanics.gaps import DRY, KEPT, STICK, Gaps, enter
from shoal.mechanics.kernels import ready
from shoal.mechanics.machine import Machine
from shoal.mechanics.model import Arrays, Model, laid
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import SINGLE, Array, Index
from shoal.mechanics.reach import span
from shoal.mechanics.tangent import Tangent, damping_at, stiffness_at, tangent_tile
from shoal.scene import Scene
from shoal.scene.signals import continuous_states, refuse_sampled

Sparse = scipy.sparse.csr_array
_LANE = slice(0, 1)
SIZES = 100.0
"""States of the user that change by so many of their sizes count as a machine that moves by its size."""


@dataclass(frozen=True)
class Evaluation:
    """One state, looked at.

    force: generalised force Q, elastic and applied, without the constraints, (unknowns,); elastic: its elastic part.
    gap: C(q, t); rate: C_t; bias: C_qq v v + C_tt, so that C_q a = -bias; each (constraints,).
    jacobian: C_q, (constraints, unknowns). kinetic, strain, gravity: energies [J]; applied: potential [J] of the loads
    that are constant at the time of the state (nan with loads that turn with a body, which have none).
    """

    force: Array
    elastic: Array
    gap: Array
    rate: Array
    bias: Array
    jacobian: Sparse
    kinetic: float
    strain: float
    gravity: float
    applied: float

    @property
    def potential(self) -> float:
        """Strain energy, gravity and applied loads together [J]."""
        return self.strain + self.gravity + self.applied


class Probe(NamedTuple):
    """Formulas f of the model at a state, and its forces by the constants c of signals.

    value: f, (probes,); by_place, by_rate: df/dq and df/dv, (probes, unknowns); by_constants: df/dc, (probes,
    constants); force: dQ/dc, (unknowns, constants); kink: whether a formula is where its derivative jumps
    """

    value: Array
    by_place: Array
    by_rate: Array
    by_constants: Array
    force: Array
    kink: bool


class Pressing(NamedTuple):
    """Forces of contacts at a state.

    force: along their normal and tangents [N or N m], (contacts, 3); mode: `gaps.STICK` or `gaps.SLIP` of those that
    rub, (contacts,); axes: normal and tangents of pairs of surfaces, (contacts, 3, 3); gap [m or rad], and of pairs its
    second derivative for accelerations of zero, (contacts,). No forces at an impact.
    """

    force: Array
    mode: Array
    axes: Array
    gap: Array
    bias: Array


class Sticking(NamedTuple):
    """Forces of contacts that hold a machine at rest, with friction.

    acceleration: that is left, (unknowns,); rows: gradients along which contacts hold it, (rows, unknowns); share: of
    the limit of its friction that each contact takes, (contacts,).
    """

    acceleration: Array
    pressing: Pressing
    rows: Array
    share: Array


class Evaluator:
    """Evaluates a model at any state; not for threads, as it keeps the turns that angle forces counted.

    lane: of the model; forces and accelerations are available in any lane, all else in the first. one_sided: whether
    the caller sees to contacts, which are open unless their state is put in (`contacts`); held: whether it takes
    samples as what they begin with. Raises InputError else.
    """

    def __init__(self, model: Model, lane: int = 0, *, one_sided: bool = False, held: bool = False) -> None:
        if not held:
            law = "reactions, sensors, equilibria, modes and channels of signals are of laws in continuous time"
            refuse_sampled(model.scene, law)
        if model.gaps.size and not one_sided:
            raise InputError(
                f"{model.gap_fields[0]}: motions, reactions, sensors, equilibria and modes take one-sided constraints, "
                "but not yet steady motions and starts from the end of a run"
            )
        self.model, self._strikes = model, False
        self.states = np.arange(model.unknowns - len(continuous_states(model.scene)), model.unknowns)
        self._arrays = model.tile(SINGLE, slice(lane, lane + 1))
        self._room = work_space(SINGLE, self._arrays)
        self._arrays = ready(SINGLE, self._arrays, self._room)
        evaluations.enter(self._arrays, self._room)
        self._enter(model.q0[:, lane % model.q0.shape[1]], None)
        derived_rows(SINGLE, self._arrays, self._room)
        start = model.start_angles[:, lane % model.start_angles.shape[1]]
        self._room.memory[:] = forces.initial_memory(SINGLE, self._arrays.forces, self._room.z, start)
        if followed := self._arrays.followed:
            begun = model.signal_angles[:, lane % model.signal_angles.shape[1]]
            turned = forces.initial_memory(SINGLE, followed.measures, self._room.z, begun)
            self._room.signals[: turned.size] = turned
            none = np.zeros(followed.torques.size)
            self._torque_turns = forces.initial_memory(SINGLE, followed.torques, self._room.z, none)

    @cached_property
    def _tangent(self) -> Tangent:
        return tangent_tile(self.model, SINGLE, _LANE)

    @cached_property
    def mass(self) -> scipy.sparse.csc_array:
        """The mass matrix, (unknowns, unknowns); with `weight` of a state of the user."""
        return scipy.sparse.csc_array(self._raised @ sparse.matrix(self._arrays.pattern, self._arrays.mass))

    @cached_property
    def weight(self) -> float:
        """Mass of a state of the user [kg m^2], of which `SIZES` sizes count as the machine's size."""
        scene = self.model.scene
        mass = sum(float(np.max(body.mass)) for body in scene.bodies.values())
        return mass * (span(scene) / SIZES) ** 2

    @cached_property
    def _raised(self) -> scipy.sparse.dia_array:
        """The factor of the rows of states, whose mass is negligible in motions."""
        factor = np.ones(self.model.unknowns)
        factor[self.states] = self.weight / STATE if len(self.states) else 1.0
        return scipy.sparse.diags_array(factor)

    @cached_property
    def pattern(self) -> scipy.sparse.csc_array:
        """Ones where the stiffness may have entries, (unknowns, unknowns)."""
        pattern = self._tangent.pattern
        return sparse.matrix(pattern, np.ones(pattern.slots))

    @property
    def gaps(self) -> Gaps:
        """The one-sided constraints."""
        return self._arrays.gaps

    @property
    def functions(self) -> Functions:
        """The functions of time and of places."""
        return self._arrays.functions

    def rows_at(self, q: Array) -> Array:
        """Return all rows of a state, coordinates and what follows from them, (rows,)."""
        self._enter(q, None)
        derived_rows(SINGLE, self._arrays, self._room)
        return self._room.z[: self.model.rows].copy()

    @cached_property
    def expansion(self) -> Sparse:
        """The derivatives of all rows of a state by the unknowns, (rows, unknowns)."""
        return _expansion(self.model)

    @classmethod
    def of(cls, scene: Scene, *, horizon: float = 0.0) -> Evaluator:
        """The evaluator of a scene; horizon [s]: latest time that will be asked for. Raises InputError."""
        return cls(Machine.of(scene).model(horizon))

    @property
    def turns(self) -> Array:
        """The continuous angles [rad] that angle forces and then signals have counted; may be set."""
        return np.concatenate([self._room.memory, self.signal_turns])

    @turns.setter
    def turns(self, angles: Array) -> None:
        own = len(self._room.memory)
        self._room.memory[:], followed = angles[:own], angles[own:]
        self.signal_turns[: len(followed)] = followed

    @property
    def force_turns(self) -> Array:
        """Those of angle forces alone, (forces,)."""
        return self._room.memory.copy()

    @property
    def signal_turns(self) -> Array:
        """The continuous angles [rad] of the measures of signals, as they are kept, (measures,)."""
        followed = self._arrays.followed
        return self._room.signals[: followed.measures.size if followed else 0]

    def put_contacts(self, kept: Array) -> None:
        """Let contacts be open, stick or slip as they did at a sample, (contacts, KEPT), see `gaps.keep`."""
        self._strikes = bool(np.any(np.isnan(kept)))
        enter(self.gaps, self._room.gaps, np.nan_to_num(kept))

    @property
    def pressing(self) -> Pressing:
        """Forces of contacts at the state of the last acceleration."""
        g, size = self._room.gaps, self.gaps.size
        force, ways = np.zeros((size, 3)), 1 + self.gaps.tangents
        force[:, :ways] = np.where(g.closed[:, None] != 0.0, g.force.reshape(size, ways), 0.0)
        force[:] = np.nan if self._strikes else force
        return self._exerting(force, g.mode * (g.closed != 0.0))

    def pressed(self, q: Array, normal: Array) -> Pressing:
        """Return the forces of contacts at rest without friction. normal: [N or N m], (contacts,)."""
        evaluations.follow_gaps(SINGLE, self._arrays, self._room, q[None], np.zeros((1, len(q))))
        return self._exerting(np.stack([normal, 0.0 * normal, 0.0 * normal], axis=1), 0.0 * normal)

    def sticking(self, q: Array, t: float = 0.0) -> Sticking:
        """Forces that hold a machine at rest, with friction."""
        g, gaps, size, n = self._room.gaps, self.gaps, self.gaps.size, self.model.unknowns
        ways = 1 + gaps.tangents
        self._enter(q, None)
        enter(gaps, g, np.zeros((size, KEPT)))
        evaluations.rest(SINGLE, self._arrays, self._room, t, self.model.scene.solver.rank_tolerance)
        closed, force = g.closed != 0.0, g.force.reshape(size, ways)
        held = np.zeros((size, ways), dtype=bool)
        held[:, 0], held[:, 1:] = closed & (gaps.kind != DRY), (closed & (g.mode == STICK))[:, None]
        held[gaps.kind == DRY, 2:] = False
        rows = g.gradient.reshape(size, ways, n)[held]
        limit = gaps.mu_static.ravel() * force[:, 0] + g.given
        needed = np.where(closed, np.linalg.norm(force[:, 1:], axis=1), 0.0)
        share = np.divide(needed, limit, out=np.zeros(size), where=(limit > 0.0) & (gaps.rolls == 0))
        found = Sticking(self._room.a[:n].copy(), self.pressing, rows, share)
        enter(gaps, g, np.zeros((size, KEPT)))
        return found

    def _exerting(self, force: Array, mode: Array) -> Pressing:
        g, size = self._room.gaps, len(force)
        bias = g.bias.reshape(size, -1)[:, 0] if size else g.bias
        return Pressing(force, mode, g.axes.reshape(size, 3, 3).copy(), g.value.copy(), bias.copy())

    def remember(self, q: Array) -> None:
        """Count the turns of angle forces after a move of less than half a turn to q."""
        self._enter(q, None)
        evaluations.count_turns(SINGLE, self._arrays, self._room)
        if followed := self._arrays.followed:
            turned = forces.initial_memory(SINGLE, followed.torques, self._room.z, self._torque_turns)
            self._torque_turns = turned

    def at(self, q: Array, v: Array | None = None, t: float = 0.0, *, load: float = 1.0) -> Evaluation:
        """Look at the state q, v (default: at rest) at time t [s]; `load` scales gravity and applied loads."""
        self._enter(q, v)
        arrays, room, n = self._loaded(load), self._room, self.model.unknowns
        held = arrays.constraints
        gap, rate, bias, entries = evaluations.look(SINGLE, arrays, room, t)
        force = self._raised @ room.a[:n]
        kinetic, strain, gravity = (float(part) for part in room.energy[:3])
        applied = self._applied(arrays, t)
        evaluations.elastic(SINGLE, arrays, room)
        jacobian = Sparse((entries, held.column, held.entry), shape=(held.size, n))
        return Evaluation(force, room.a[:n].copy(), gap, rate, bias, jacobian, kinetic, strain, gravity, applied)

    def acceleration(self, q: Array, v: Array, t: float = 0.0) -> Array:
        """The acceleration by Gauss's principle, (unknowns,)."""
        self._enter(q, v)
        evaluations.accelerate(SINGLE, self._arrays, self._room, t, self.model.scene.solver.rank_tolerance)
        return self._room.a[: self.model.unknowns] * (np.nan if self._strikes else 1.0)

    def along(
        self, way: Array, sample: Index, v: Array, times: Array, contacts: Array
    ) -> tuple[Array, Array, list[Pressing], list[dict[str, float]]]:
        """Accelerations along a motion, (samples, unknowns), and the angles that angle forces count, (samples, forces).

        Then what contacts exert, and `strengths`. way: poses less than half a turn apart, from where they are counted,
        (poses, unknowns); sample: which one each is, or -1, (poses,); v, (samples, unknowns), times [s] and contacts,
        (samples, contacts, KEPT): of the samples
        """
        a, turns, pressing = np.empty_like(v), np.empty((len(v), len(self._room.memory))), list[Pressing]()
        strengths = list[dict[str, float]]()
        n, tolerance = self.model.unknowns, self.model.scene.solver.rank_tolerance
        self._enter(way[0], None)
        for k, number in enumerate(sample.tolist()):
            self._room.z[:n] = way[k]
            if k > 0:
                evaluations.count_turns(SINGLE, self._arrays, self._room)
            if number >= 0:
                self._room.zdot[:n] = v[number]
                turns[number] = self._room.memory
                self.put_contacts(contacts[number])
                evaluations.accelerate(SINGLE, self._arrays, self._room, float(times[number]), tolerance)
                a[number] = np.nan if self._strikes else self._room.a[:n]
                pressing.append(self.pressing)
                strengths.append(self._strengths_now(float(times[number])))
        return a, turns, pressing, strengths

    def stored(self, way: Array, turns: Array) -> Array:
        """Strain energy [J] at poses, (poses, unknowns), at which angle forces have counted `turns`, (poses,)."""
        energy = np.empty(len(way))
        for k, pose in enumerate(way):
            self._room.z[: self.model.unknowns] = pose
            self._room.memory[:] = turns[k]
            evaluations.find_energies(SINGLE, self._arrays, self._room)
            energy[k] = self._room.energy[1]
        return energy

    def force(self, q: Array, v: Array, t: float = 0.0) -> Array:
        """Generalised force, elastic and applied, without the constraints, (unknowns,)."""
        return self._force(q, v, self._arrays, t)

    def stiffness(
        self, q: Array, t: float = 0.0, *, multipliers: Array | None = None, load: float = 1.0
    ) -> scipy.sparse.csc_array:
        """-dQ/dq at rest, (unknowns, unknowns), with the curvature sum lambda_k C_k,qq of the constraints.

        Forces that turn with a body make it unsymmetric.
        """
        self._enter(q, None)
        arrays = self._loaded(load)
        values = stiffness_at(SINGLE, arrays, self._tangent, self._room)
        if multipliers is not None:
            tangent = self._tangent
            np.add.at(values, tangent.curvature, tangent.bend * multipliers[tangent.owner])
        found = sparse.matrix(self._tangent.pattern, values) + self._load_stiffness(arrays, t)
        if not arrays.followed:
            return scipy.sparse.csc_array(found)
        # States stand in place of their unknowns.
        kept = scipy.sparse.diags_array(np.isin(np.arange(self.model.unknowns), self.states).astype(float))
        found = found + self._feedback(arrays, t, signals.BY_PLACE) + self._feedback(arrays, t, signals.BY_RATE) @ kept
        return scipy.sparse.csc_array(found)

    def damping(self, q: Array, v: Array | None = None, t: float = 0.0, *, dry: bool = False) -> scipy.sparse.csc_array:
        """-dQ/dv, (unknowns, unknowns); dry: with the slope of smoothed dry friction, which is huge at rest.

        Signals make it unsymmetric.
        """
        self._enter(q, v)
        arrays = self._arrays
        if not dry:
            law = arrays.forces.law.copy()
            law[forces.COULOMB :: forces.LAW] = 0.0
            arrays = self._changed(forces=arrays.forces._replace(law=law))
        found = sparse.matrix(self._tangent.pattern, damping_at(SINGLE, arrays, self._tangent, self._room))
        if not arrays.followed:
            return found
        kept = scipy.sparse.diags_array((~np.isin(np.arange(self.model.unknowns), self.states)).astype(float))
        return scipy.sparse.csc_array(found + self._feedback(arrays, t, signals.BY_RATE) @ kept)

    def _feedback(self, arrays: Arrays, t: float, by: int) -> scipy.sparse.csc_array:
        """-dQ/dq or -dQ/dv by the signals that loads follow, at the state that was entered."""
        n, blocks = self.model.unknowns, feedback_at(arrays, self._room, t)
        force = self._raised @ scipy.sparse.csc_array(blocks[:, signals.FORCE, :n].T)
        return scipy.sparse.csc_array(-force @ scipy.sparse.csr_array(blocks[:, by, :n]))

    def values(self, q: Array, v: Array | None, t: float = 0.0) -> Array:
        """Return the formulas of the model that are probed, at a state, (probes,)."""
        self._enter(q, v)
        feedback_at(self._arrays, self._room, t)
        followed = self._arrays.followed
        return np.asarray(signals.register(followed, self._room.signals)[followed.strength[list(self.model.probed)]])

    def probe(self, q: Array, v: Array | None = None, t: float = 0.0) -> Probe:
        """Look at the formulas of the model that are probed, and at how signals that are numbers act on it."""
        self._enter(q, v)
        model, own, followed = self.model, self._room.signals, self._arrays.followed
        assert followed
        blocks, probed = feedback_at(self._arrays, self._room, t)[..., : model.unknowns], list(model.probed)
        by_constants, register = signals.by_constants(followed, own), signals.register(followed, own)
        return Probe(
            register[followed.strength[probed]],
            blocks[probed, signals.BY_PLACE],
            blocks[probed, signals.BY_RATE],
            by_constants[probed],
            self._raised @ (blocks[:, signals.FORCE].T @ by_constants),
            signals.on_a_kink(followed, own),
        )

    def strengths(self, q: Array, v: Array | None, t: float = 0.0) -> dict[str, float]:
        """Return the values of what loads follow at a state, by their fields."""
        self._enter(q, v)
        return self._strengths_now(t)

    def _strengths_now(self, t: float) -> dict[str, float]:
        followed = self._arrays.followed
        if not followed:
            return {}
        feedback_at(self._arrays, self._room, t)
        values = signals.register(followed, self._room.signals)[followed.output].tolist()
        found = zip(self.model.recorded, values, strict=True)
        return {field: value for field, value in found if field.startswith("loads.")}

    def put(self, numbers: Mapping[str, float]) -> None:
        """Let signals that are numbers have other values, by name."""
        for k, name in enumerate(self.model.signal_names):
            if name in numbers:
                self._arrays.followed.constant[k] = numbers[name]

    def strain_energies(self, q: Array) -> dict[str, float]:
        """Strain energy [J] of every flexible body."""
        bodies = dict.fromkeys(name for owners in self.model.owners for name in owners)
        return {body: self._energy(q, self._only(body)) for body in bodies}

    def element_forces(self, q: Array, v: Array, body: str) -> list[Array]:
        """Elastic and viscous generalised force of each element of a flexible body by itself, (unknowns,) each."""
        count = sum(owners.count(body) for owners in self.model.owners)
        return [self._force(q, v, self._only(body, number)) for number in range(count)]

    @property
    def follows(self) -> bool:
        """Return whether a load turns with a body, or a torque in space does not, or a load follows the motion.

        Then, and with states of the user, there is no potential.
        """
        followed = self._arrays.followed
        loads = [self._arrays.applied, followed.applied] if followed else [self._arrays.applied]
        turns = any(one.following + one.turning + one.twisting > 0 for one in loads)
        measured = bool(followed) and followed.measures.size + followed.positions + followed.velocities > 0
        return turns or measured or len(self.states) > 0

    def _enter(self, q: Array, v: Array | None) -> None:
        n = self.model.unknowns
        self._room.z[:n] = q
        self._room.zdot[:n] = 0.0 if v is None else v
        if v is None:
            self._room.zdot[self.states] = self._room.z[self.states]
        if self.model.constraints.size == 0 and self.model.forces.size == 0:
            self._room.power[:] = 0.0

    def _loaded(self, load: float) -> Arrays:
        """The arrays with gravity and applied loads scaled."""
        arrays = self._arrays
        if load == 1.0:
            return arrays
        law = arrays.forces.law.copy()
        law[forces.AMPLITUDE :: forces.LAW] *= load
        return self._changed(
            weight=arrays.weight * load,
            forces=arrays.forces._replace(law=law),
            **_scaled(arrays, load, self.states),
        )

    def _only(self, body: str, number: int | None = None) -> Arrays:
        """The arrays with the stiffness of one element of a body (or of all of them), and with no loads."""
        arrays = self._arrays
        elements = []
        for family, owners in zip(arrays.elements, self.model.owners, strict=True):
            kernel = KERNELS[type(family)]
            values = family.coefficients.reshape(-1, kernel.coefficients).copy()
            for row, owner in enumerate(owners):
                if owner != body or number not in (None, row - owners.index(owner)):
                    values[row, kernel.first_stiffness :] = 0.0
            elements.append(family._replace(coefficients=values.ravel()))
        law = np.zeros_like(arrays.forces.law)
        law[forces.SPEED :: forces.LAW] = 1.0
        none = np.full_like(arrays.forces.table, -1)
        return self._changed(
            weight=0.0 * arrays.weight,
            families=lay(tuple(elements)),
            elements=tuple(elements),
            forces=arrays.forces._replace(law=law, table=none, energy=none),
            **_scaled(arrays, 0.0),
        )

    def _changed(self, **parts: Any) -> Arrays:
        """The arrays with other parts, in storage of their own."""
        arrays = self._arrays._replace(storage=structures.storage(), **parts)
        evaluations.enter(arrays, self._room)
        return arrays

    def _force(self, q: Array, v: Array | None, arrays: Arrays, t: float = 0.0) -> Array:
        """The force of chosen parts; their energies are left in the room."""
        self._enter(q, v)
        evaluations.look(SINGLE, arrays, self._room, t)
        return self._room.a[: self.model.unknowns].copy()

    def _energy(self, q: Array, arrays: Arrays) -> float:
        self._force(q, None, arrays)
        return float(self._room.energy[1])

    def _strengths(self, arrays: Arrays, numbers: Index, t: float) -> Array:
        """Functions of time by number, -1 for the constant 1."""
        return np.array([1.0 if k < 0 else functions.evaluate(arrays.functions, int(k), t, 0) for k in numbers])

    def _drives(self, arrays: Arrays, t: float) -> list[tuple[int, float]]:
        """(force element, applied torque [N m] or force [N]) of motors."""
        law = arrays.forces.law.reshape(-1, forces.LAW)
        return [
            (k, law[k, forces.AMPLITUDE] * functions.evaluate(arrays.functions, int(arrays.forces.drive[k]), t, 0))
            for k in range(arrays.forces.size)
            if arrays.forces.drive[k] >= 0 and law[k, forces.AMPLITUDE] != 0.0
        ]

    def _applied(self, arrays: Arrays, t: float) -> float:
        """Potential of the applied loads [J]; the derived rows must be filled."""
        applied, z = arrays.applied, self._room.z
        if self.follows:
            return float("nan")
        strength = self._strengths(arrays, applied.fixed_function, t)
        total = -float(np.sum(applied.coefficient * strength * z[applied.row])) if applied.fixed else 0.0
        for k, size in self._drives(arrays, t):
            total -= size * driven(arrays, z, k, self._room.memory[k])
        if followed := arrays.followed:  # by signals that are numbers
            feedback_at(arrays, self._room, t)
            register, loads = signals.register(followed, self._room.signals), followed.applied
            if loads.fixed:
                total -= float(np.sum(loads.coefficient * register[loads.fixed_function] * z[loads.row]))
            for k, size in enumerate(self._torques(arrays, register)):
                total -= size * driven(arrays._replace(forces=followed.torques), z, k, self._torque_turns[k])
        return total

    @staticmethod
    def _torques(arrays: Arrays, register: Array) -> list[float]:
        """Torques of the plane [N m] that follow signals."""
        torques = arrays.followed.torques
        return list(map(float, register[torques.drive] * torques.law[forces.AMPLITUDE :: forces.LAW]))

    def _load_stiffness(self, arrays: Arrays, t: float) -> scipy.sparse.csc_array:
        """-dQ/dq of motors, of forces that turn with a body and of torques."""
        n, z = self.model.unknowns, self._room.z

        def strengths(numbers: Index) -> Array:
            return self._strengths(arrays, numbers, t)

        following = in_plane if self.model.dimensions == plane.DIMENSIONS else in_space
        parts = [*following(arrays, z, strengths), *of_drives(arrays, z, self._drives(arrays, t))]
        if followed := arrays.followed:
            feedback_at(arrays, self._room, t)
            register = signals.register(followed, self._room.signals)
            acting = arrays._replace(applied=followed.applied, forces=followed.torques)
            parts += [
                *following(acting, z, lambda numbers: register[numbers]),
                *of_drives(acting, z, list(enumerate(self._torques(arrays, register)))),
            ]
        if not parts:
            return scipy.sparse.csc_array((n, n))
        row = np.concatenate([np.repeat(to, len(source)) for to, source, _ in parts])
        column = np.concatenate([np.tile(source, len(to)) for to, source, _ in parts])
        value = np.concatenate([block.ravel() for _, _, block in parts])
        size = self.model.rows
        block = scipy.sparse.csr_array((value, (row, column)), shape=(size, size))
        return scipy.sparse.csc_array(self.expansion.T @ block @ self.expansion)


def _scaled(arrays: Arrays, load: float, states: Index | None = None) -> dict[str, Any]:
    """Return the parts of the arrays in which applied loads are scaled, also those that follow signals.

    states: unknowns whose rows are no loads, but rates of states
    """
    applied, followed = arrays.applied, arrays.followed
    found: dict[str, Any] = {"applied": _scaled_loads(applied, load, states)}
    if followed:
        torques = followed.torques._replace(law=followed.torques.law * load)
        followed = followed._replace(applied=_scaled_loads(followed.applied, load, states), torques=torques)
        found |= {"followed": followed, "signals": laid(followed)}
    return found


def _scaled_loads(applied: Applied, load: float, states: Index | None) -> Applied:
    kept = np.zeros(applied.fixed, dtype=bool) if states is None else np.isin(applied.row, states)
    return applied._replace(
        coefficient=np.where(kept, applied.coefficient, applied.coefficient * load),
        factor=applied.factor * load,
        share=applied.share * load,
    )


def _expansion(model: Model) -> Sparse:
    """dz/dq: all rows of a state by the unknowns."""
    d, n = model.derived, model.unknowns
    row = np.concatenate([np.arange(n), n + np.repeat(np.arange(len(d.start) - 1), np.diff(d.start))])
    column = np.concatenate([np.arange(n), d.source])
    value = np.concatenate([np.ones(n), d.coefficient[:, 0] if len(d.source) else np.zeros(0)])
    return Sparse((value, (row, column)), shape=(model.rows, n))
