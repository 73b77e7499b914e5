"""Static equilibrium of a scene, with large deflections: a stable place of rest, or the reason why there is none.

A machine that its own stiffness holds is loaded step by step by Newton's method; steps are halved where a step does
not converge, turns a body by too much or ends in an unstable place. A machine without stiffness of its own (a
pendulum, a chain), and one that snaps through, goes down in its potential instead, or creeps where its loads have none.
Dry friction is left out, and drives stand still where they are at the stated time.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse

from shoal.arguments import check
from shoal.errors import InputError
from shoal.findings import Finding
from shoal.mechanics import plane
from shoal.mechanics.affine import points
from shoal.mechanics.analysis import findings as kinds
from shoal.mechanics.analysis import left_out
from shoal.mechanics.analysis.balance import BALANCED, FALLS, WIDEST, Balance, View
from shoal.mechanics.analysis.damped import small
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.evaluate import Evaluator, Sticking
from shoal.mechanics.analysis.findings import EquilibriumStatus, status_of
from shoal.mechanics.analysis.going_on import as_stated
from shoal.mechanics.analysis.idle_spins import idle_spins
from shoal.mechanics.analysis.joint_reactions import reactions_of
from shoal.mechanics.analysis.movers import movers
from shoal.mechanics.analysis.small_motions import LEAST, ROUND, TENSION, hides, pull
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.ended import named_turns
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.newton import Root
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.scene import Attachment, Scene
from shoal.scene.loads import Torque
from shoal.scene.signals import continuous_states, following

TURN = 0.8
"""Largest turn [rad] of any body or section in one load step."""
STILL = 1e-3
"""A machine that turns by less [rad] was put into its equilibrium."""
WAY = 0.3
"""Longest way (rms) of the bodies in one load step, relative to the machine's size."""
SMALLEST = 1.0 / 1024
"""Smallest load step."""
KICK = 1e-3
"""An unstable place is left by so much, relative to the machine's size,"""
ALIKE = 1e-3
"""in the sum of all modes whose squared frequencies differ by less than this from the lowest."""
PULLED = 1e-3
"""Part of the unbalanced forces from which they tell to which side a machine buckles."""
TURNS = 5.0
"""A body that has made so many full turns about z and is still not at rest is held by nothing."""
GAPE = 1e-9
"""Joints that gape by more than this [m, relative to the machine's size] are not closed."""


def statics(scene: Scene, time: float = 0.0, *, leave_unstable: bool = True, reactions: bool = True) -> Equilibrium:
    """Return the equilibrium that a machine reaches from the start of its scene, with drives as they are at `time` [s].

    leave_unstable: go on from an unstable equilibrium (a column beyond its buckling load) to a stable one, where the
    loads have a potential. Without a potential it is stable where no small motion grows, with the damping of the
    machine. The message names neglected effects. reactions: compute those in the joints as well.

    Where dry friction that sticks (of contacts, or `stick: exact`) holds the machine at its start, this is the start.

    Raises InputError if the scene cannot be modelled.
    """
    check(time=time)
    search = _Search(scene, as_stated(scene, horizon=time), time, reactions)
    return search.stuck() or search.run(leave_unstable)


def seek(
    scene: Scene, time: float = 0.0, *, leave_unstable: bool = True, reactions: bool = True
) -> tuple[Equilibrium, Balance]:
    """Return the equilibrium without friction as `statics` does, and the balance that was looked at there last."""
    search = _Search(scene, as_stated(scene, horizon=time), time, reactions)
    return search.run(leave_unstable), search.balance


class _Search:
    """One search for an equilibrium."""

    def __init__(self, scene: Scene, evaluator: Evaluator, time: float, reactions: bool) -> None:
        self.reactions = reactions
        self.stated, self.placement = scene, Machine.of(scene).placement
        scene = self.placement.scene
        self.scene, self.evaluator, self.time = scene, evaluator, time
        unknowns = evaluator.model.unknowns
        every = _directions(self.placement)
        self.directions = points([one for of_body in every.values() for one in of_body], unknowns)
        self.owners = [name for name, of_body in every.items() for _ in of_body]
        self.marker_points = points([self.placement.point(scene, at) for at in scene.markers.values()], unknowns)
        self.marker_lines = points([self.placement.direction(scene, at) for at in scene.markers.values()], unknowns)
        angles, known = start_angle if scene.dimensions == plane.DIMENSIONS else self._start_angle, None
        if evaluator.model.marker_angles is not None:
            known = evaluator.model.marker_angles[:, 0]
        self.angles = np.array([float(angles(scene, at)) for at in scene.markers.values()]) if known is None else known
        mass = sum(float(body.mass) for body in scene.bodies.values())
        self.balance = Balance(evaluator, time, span(scene), mass)
        self.iterations = self.steps = 0
        self.spinning: list[str] = []
        self.pressing: dict[str, float] = {}
        self.friction: Sticking | None = None
        self.kept: tuple[Array, tuple[Array, Array, Array]] | None = None
        self.wound = np.zeros(len(self.owners))
        self.last = self.directions.at(evaluator.model.q0[:, 0])

    def run(self, leave_unstable: bool) -> Equilibrium:
        q = self._assembled()
        q, gap = self.balance.restore(q)
        if gap > GAPE * self.balance.size:
            text = f"the joints cannot be closed: they gape by {gap:.2g}"
            return self._ending(q, [kinds.JOINTS_OPEN.found(text, gap=gap)])
        self._leave_out_spins(q)
        has_potential = not self.evaluator.follows
        if self.balance.contacts.size and not has_potential:
            raise InputError(
                f"{self.evaluator.model.gap_fields[0]}: statics takes one-sided constraints where the loads have a "
                f"potential; {self._driving()} has none"
            )
        met = list[Finding]()
        found = None if self.balance.contacts.size else self._at(q) or self._loaded(q)
        if (found is None or not found.converged) and not leave_unstable and not self.balance.contacts.size:
            start = q if found is None else found.point
            straight = self._count(self.balance.newton(start))
            if straight.converged and self._turn(start, straight.point) < TURN:
                found = straight
        if found is None or not found.converged:
            if found is not None:
                met = [kinds.SNAPPED.found("snapped or buckled on the way")]
                q = self._nudged(found.point) if has_potential else found.point
            found = self._descended(q)
        for attempt in range(4):
            if not found.converged:
                break
            found = self._polished(found)
            eigenvalues, levels, _ = self._eigen(found.point)
            if not (leave_unstable and has_potential) or not np.any(np.real(eigenvalues) < -levels):
                break
            met = [kinds.LEFT_UNSTABLE.found("left an unstable equilibrium")]
            found = self._descended(found.point + KICK * (1 + attempt) * self._soft(found.point)[0])
        else:
            found = self._polished(found) if found.converged else found
        if not found.converged and len(self.evaluator.states):
            straight = self._count(self.balance.newton(q))
            found = straight if straight.converged and self._turn(q, straight.point) < WIDEST else found
        if found.converged:
            self.pressing = self.balance.hold(found.point)
        if not found.converged and (endless := self._endless(found)):
            return self._ending(found.point, endless)
        return self._ending(found.point, self._assess(found, met), found)

    def stuck(self) -> Equilibrium | None:
        """Return the start, where friction holds all of the machine; None where it does not."""
        if not self.evaluator.gaps.tangents:
            return None
        q = self._assembled()
        if left_out.driving(self.evaluator, q, self.time):
            return None
        held, seen = self.evaluator.sticking(q, self.time), self.evaluator.at(q, t=self.time)
        rows = scipy.sparse.vstack([seen.jacobian, scipy.sparse.csr_array(held.rows)])
        scale = self.balance.metric.size(seen.force)
        still = self.balance.length(held.acceleration) <= BALANCED * scale
        if not still or self.balance.metric.freedom(scipy.sparse.csr_array(rows)).degrees:
            return None
        self.friction = held
        names, numbers = self.balance.contacts.names, self.balance.contacts.numbers
        normal = held.pressing.force[numbers, 0]
        self.pressing = {name: float(size) for name, size in zip(names, normal, strict=True) if size > 0.0}
        worst = int(np.argmax(held.share))
        text = f"friction holds it where it starts, by {held.share[worst]:.3g} of its limit"
        where = f" ({self.evaluator.model.gap_fields[worst]})" if held.share[worst] else ""
        found = self._ending(
            q, [kinds.STICKS.found(text + where, share=float(held.share[worst]))], Root(q, True, 0, 0.0)
        )
        residual = self.balance.length(held.acceleration) / scale if scale else 0.0
        return replace(found, residual=residual, eigenvalues=np.zeros(0), levels=np.zeros(0))

    def _polished(self, found: Root[Array]) -> Root[Array]:
        """Return an equilibrium to the digits that Newton's method has."""
        refined = self._count(self.balance.newton(found.point, most=6))
        if not refined.converged or self._turn(found.point, refined.point) >= 1e-3:
            return found
        self._follow(refined.point)
        return refined

    def _nudged(self, q: Array) -> Array:
        """Return a position to descend from, perturbed to one side where both are equal, as in buckling."""
        move, pull = self._soft(q)
        return q + KICK * move if pull < PULLED else q

    def _soft(self, q: Array) -> tuple[Array, float]:
        """The displacement of the lowest mode as large as the machine, and the part of the forces that pull that way.

        Of the two sides it is that to which a marker moves along an axis of the ground, and of modes that are as low,
        as those of a round column, the sum that moves it most: other meshes buckle to the same side.
        """
        view = self.balance.look(q)
        values, shapes, _ = self.balance.spectrum(q, view)
        shapes = shapes[:, values - values[0] < ALIKE * abs(values[0])]
        moves = self.marker_points.rows @ shapes
        if np.max(np.abs(moves)) < 1e-6 * np.max(np.abs(shapes)):
            moves = shapes
        sizes = np.linalg.norm(moves, axis=1)
        along = moves[int(np.argmax(sizes > 0.9 * np.max(sizes)))]
        lowest = shapes @ along
        mass, accelerated = self.evaluator.mass, view.acceleration
        pull = abs(float(lowest @ (mass @ accelerated))) / float(np.linalg.norm(along))
        total = self.balance.length(accelerated)
        return lowest * (self.balance.size / float(np.max(np.abs(lowest)))), pull / total if total > 0 else 0.0

    def _start_angle(self, scene: Scene, at: Attachment) -> float:
        """Return the start angle of an attachment, in space about z."""
        along = self.placement.start_of(self.placement.direction(scene, at))[0][:, 0]
        return float(plane.angle(along))

    def _assess(self, found: Root[Array], met: list[Finding]) -> list[Finding]:
        """Return the findings about the end of a search. met: on the way."""
        eigenvalues, levels, lowest = self._eigen(found.point)
        view = self.balance.look(found.point)
        self.balance.learn(found.point)
        residual = self.balance.residual(view)
        if restless := self.balance.restless(found.point, view):
            return [*met, self._restless(restless)]
        if not found.converged:
            return [*met, self._unfinished(found)]
        if residual > BALANCED:
            text = f"the forces do not balance, {residual:.1g} of them is left"
            return [*met, kinds.UNBALANCED.found(text, residual=residual)]
        growth = self._growth(found.point, view) if self.evaluator.follows else None
        if growth is not None and growth > 0:
            text = f"forces that follow the motion make it grow with exp(t * {growth:.4g}/s)"
            return [kinds.GROWS.found(text, rate=growth)]
        complex_pair = np.any(np.abs(np.imag(eigenvalues)) > 1e-9 * np.abs(eigenvalues) + levels)
        if growth is None and complex_pair:
            return [kinds.GROWS.found("forces that follow the motion make it flutter")]
        if growth is None and len(eigenvalues) and np.real(eigenvalues[0]) < -levels[0]:
            rate = float(np.sqrt(-np.real(eigenvalues[0])))
            text = f"unstable: it leaves with exp(t * {rate:.4g}/s); moves first: {self._movers(lowest)}"
            return [*met, kinds.UNSTABLE.found(text, rate=rate)]
        # What is damped and does not grow may have negative eigenvalues of an unsymmetric stiffness, in pairs.
        loose = (np.real(eigenvalues) if growth is None else np.abs(eigenvalues)) <= levels
        if np.any(loose) and hides(levels[loose], eigenvalues, pull(self.scene)):
            least = float(np.sqrt(np.max(levels[loose])))
            text = f"round-off hides whether {self._movers(lowest)} is held, by less than {least:.1g} rad/s"
            return [*met, kinds.INDETERMINATE.found(text, frequency=least)]
        if np.any(loose):
            text = f"nothing holds {self._movers(lowest)}; it may rest in other places as well"
            return [*met, kinds.LOOSE.found(text)]
        if self.spinning:
            axes = "its axis" if len(self.spinning) == 1 else "their axes"
            text = f"{', '.join(self.spinning)}: free to spin about {axes}, which moves nothing"
            return [*met, kinds.FREE_SPIN.found(text)]
        return met

    def _endless(self, found: Root[Array]) -> list[Finding]:
        """Return a finding where the machine falls or turns without end."""
        if found.message == FALLS:
            moved = found.point - self.evaluator.model.q0[:, 0]
            if restless := self.balance.restless(found.point, self.balance.look(found.point)):
                return [self._restless(restless)]
            return [kinds.FALLS.found(f"nothing holds {self._movers(moved)}; it falls without end")]
        turns = np.abs(self.wound) / (2 * np.pi)
        if np.max(turns, initial=0.0) <= TURNS:
            return []
        name, most = self.owners[int(np.argmax(turns))], float(np.max(turns))
        text = f"nothing holds {name} against {self._driving()}; after {most:.0f} turns it goes on turning"
        return [kinds.WINDS_UP.found(text, turns=most)]

    def _restless(self, rates: dict[str, float]) -> Finding:
        """Return the finding that states go on changing. rates: of their sizes [1/s]."""
        sizes = {name: rate * float(continuous_states(self.scene)[name].size) for name, rate in rates.items()}
        changes = ", ".join(f"states.{name} by {rate:.4g}/s" for name, rate in sizes.items())
        return kinds.RESTLESS.found(f"no rest: it goes on changing {changes}", **sizes)

    def _unfinished(self, found: Root[Array]) -> Finding:
        """Return the finding that a search did not come to rest."""
        text = found.message
        if self.evaluator.follows:
            text += f" under what follows its motion ({self._driving()}); a start nearer to rest may help"
        return kinds.NOT_AT_REST.found(text)

    def _ending(self, q: Array, findings: list[Finding], found: Root[Array] | None = None) -> Equilibrium:
        view = self.balance.look(q)
        e = view.evaluation
        at = self.marker_points.at(q)
        failed = status_of(findings) is EquilibriumStatus.FAILED
        balanced = not failed and found is not None
        rest = np.zeros_like(q)
        eigenvalues, levels, _ = self._eigen(q)
        is_pressed = any(self.pressing.values())
        pressed = self.balance.pressed(q) if is_pressed else None
        pressed = pressed if self.friction is None else self.friction.pressing
        react = (
            cache(lambda: reactions_of(self.evaluator, q, rest, rest, self.time, pressing=pressed, resting=True))
            if balanced
            else None
        )
        neglected = [left_out.driven(self.evaluator, q, self.time)]
        if self.friction is None:
            neglected.insert(0, left_out.friction(self.scene, react))
        rubbing = (name for name, one in self.scene.contacts.items() if one.rubs)
        rough = [name for name in rubbing if f"contacts.{name}" in self.pressing]
        if self.friction is None and rough:
            neglected.append(f"friction is left out ({', '.join(rough)}): the surfaces may stick at other places, too")
        return Equilibrium(
            scene=self.stated,
            time=self.time,
            findings=[*findings, *(kinds.NEGLECTED.found(text) for text in neglected if text)],
            balanced=balanced,
            q=q,
            multipliers=view.multipliers[: self.evaluator.model.constraints.size],
            contacts=self.pressing,
            markers=tuple(self.scene.markers),
            points=at,
            angles=self.angles.copy(),
            energy={"strain": e.strain, "gravity": e.gravity, "applied": float(e.applied)},
            strain_energy=self.evaluator.strain_energies(q),
            residual=self.balance.residual(view),
            gap=float(np.max(np.abs(e.gap), initial=0.0)),
            correction=found.correction if found else float("inf"),
            eigenvalues=eigenvalues,
            levels=levels,
            iterations=self.iterations,
            steps=self.steps,
            reactions=react() if react is not None and self.reactions else None,
            turns=named_turns(self.evaluator.model, self.evaluator.turns),
            gap_angles=self.balance.contacts.angles,
            signal_angles=self.evaluator.signal_turns.copy(),
        )

    def _assembled(self) -> Array:
        """The start of the scene, moved with its drives up to the stated time."""
        q = self.evaluator.model.q0[:, 0].copy()
        if self.time > 0 and np.any(self.evaluator.model.constraints.drive >= 0):
            for instant in np.linspace(0.0, self.time, 33):
                self.balance.t = float(instant)
                q, _ = self.balance.restore(q)
                self._follow(q)
        self.balance.t = self.time
        return q

    def _at(self, q: Array) -> Root[Array] | None:
        """The stable equilibrium in which the machine is put already, but for a thousandth of a turn."""
        found = self.balance.newton(q)
        if not found.converged or self._turn(q, found.point) > STILL or not self._firm(found.point, 1.0):
            return None
        return self._count(found)

    def _descended(self, q: Array) -> Root[Array]:
        """Return the minimum of the potential downhill from q, or the rest position after creeping from q."""
        go = self.balance.creep if self.evaluator.follows else self.balance.descend
        return self._count(go(q, self._turn, self._follow))

    def _loaded(self, q: Array) -> Root[Array] | None:
        """Load step by step; None if the unloaded machine has no stiffness that holds it."""
        if not self._firm(q, 0.0):
            return None
        unloaded = self._count(self.balance.newton(q, 0.0))
        if not unloaded.converged or self._turn(q, unloaded.point) > TURN or not self._firm(unloaded.point, 0.0):
            return None
        q, load, step = unloaded.point, 0.0, 1.0
        self._follow(q)
        before, before_load = q, 0.0
        correction = unloaded.correction
        while load < 1.0:
            ahead = min(1.0, load + step)
            guess = q + (q - before) * ((ahead - load) / (load - before_load)) if load > before_load else q
            found = self._count(self.balance.newton(guess, ahead))
            near = self._turn(q, found.point) < TURN and self._way(q, found.point) < WAY
            if found.converged and near and self._firm(found.point, ahead):
                before, before_load = q, load
                q, load = found.point, ahead
                correction = found.correction
                self._follow(q)
                self.steps += 1
                step *= 1.5
            else:
                step /= 2.0
                if step < SMALLEST:
                    text = f"the loads cannot be raised beyond {load:.4g} of their size"
                    return Root(q, False, found.iterations, correction, text)
        return Root(q, True, self.iterations, correction)

    def _firm(self, q: Array, load: float) -> bool:
        """Return whether the reduced stiffness pulls every displacement back."""
        if self.evaluator.follows and load > 0:
            return True
        return self.balance.is_firm(q, self.balance.look(q, load), load)

    def _eigen(self, q: Array) -> tuple[Array, Array, Array]:
        """Eigenvalues of the reduced stiffness (complex with loads that follow), their levels, the lowest one's shape.

        Those of the last state are kept.
        """
        state = np.append(q, self.balance.closed)
        if self.kept is None or not np.array_equal(self.kept[0], state):
            self.kept = state, self._eigen_of(q)
        return self.kept[1]

    def _eigen_of(self, q: Array) -> tuple[Array, Array, Array]:
        """The same; with loads that follow they are quotients w' K x / w' M x of their left and right shapes."""
        view = self.balance.look(q)
        tangent = self.balance.at_rest(q, view)
        if not view.freedom.degrees:
            return np.zeros(0), np.zeros(0), np.zeros_like(q)
        if not self.evaluator.follows:
            own = self.balance.spectrum_of(tangent, view)
            return own.values, own.levels, own.shapes[:, 0]
        basis = view.basis
        tangent = tangent._replace(matrix=self.balance.holding(tangent.matrix))
        found, left, right = scipy.linalg.eig(basis.T @ (tangent.matrix @ basis), left=True)
        along, w, x = np.sum(np.conj(left) * right, axis=0), basis @ np.conj(left), basis @ right
        simple = np.abs(along) > np.sqrt(ROUND)
        found = np.where(simple, np.sum(w * (tangent.matrix @ x), axis=0) / np.where(simple, along, 1.0), found)
        levels = np.maximum(LEAST, tangent.worth(w, x) / np.maximum(np.abs(along), np.sqrt(ROUND)))
        levels = np.maximum(levels, TENSION * np.max(np.abs(found)))
        order = np.argsort(found.real)
        found, levels, lowest = found[order], levels[order], np.real(x[:, order[0]])
        return found if np.any(found.imag) else found.real, levels, lowest

    def _growth(self, q: Array, view: View) -> float | None:
        """The largest real part [1/s] of small motions with the damping of the machine; None where it has none.

        States of the user are as good as damping.
        """
        if not len(self.evaluator.states) and not np.any(self.evaluator.damping(q, t=self.time).data):
            return None
        return float(np.max(small(self.balance, q, view).values.real, initial=0.0))

    def _count(self, found: Root[Array]) -> Root[Array]:
        self.iterations += found.iterations
        return found

    def _turn(self, one: Array, other: Array) -> float:
        """Largest turn [rad] of a body or section between two states."""
        here, there = (self.directions.at(state).T for state in (one, other))
        across = plane.cross(here, there) if len(here) == plane.DIMENSIONS else np.cross(here.T, there.T).T
        change = np.arctan2(np.linalg.norm(np.atleast_2d(across), axis=0), np.sum(here * there, axis=0))
        return float(np.max(np.abs(change), initial=0.0))

    def _way(self, one: Array, other: Array) -> float:
        """Return the distance of the bodies in two states (RMS), relative to the machine's size."""
        return self.balance.length(other - one) / float(self.balance.unit)

    def _driving(self) -> str:
        """The loads that can turn a body without end."""
        loads = self.scene.loads.items()
        names = [name for name, load in loads if isinstance(load, Torque) or getattr(load, "follows", False)]
        names += [name for name in following(self.scene) if name.split(".")[1] not in names]
        return ", ".join(names) or "its loads"

    def _movers(self, displacement: Array) -> str:
        states = displacement[self.evaluator.states] * self.evaluator.weight**0.5
        moved = displacement - 0.0
        moved[self.evaluator.states] = 0.0
        if len(states) and np.max(np.abs(states)) > self.balance.length(moved):
            return f"states.{list(self.scene.states)[int(np.argmax(np.abs(states)))]}"
        return movers(self.placement, self.balance.size, displacement)

    def _follow(self, q: Array) -> None:
        """Count the turns of springs, bodies and markers."""
        self.evaluator.remember(q)
        self.balance.contacts.remember(q)
        here = self.directions.at(q)
        self.wound += _remainder(plane.angle(here.T) - plane.angle(self.last.T))
        self.last = here
        if self.spinning and not self.evaluator.model.flexible:
            self._leave_out_spins(q)
        self.angles = self.angles + _remainder(plane.angle(self.marker_lines.at(q).T) - self.angles)

    def _leave_out_spins(self, q: Array) -> None:
        """Exclude rotations of bodies about their own axes, which are no motion of the machine."""
        self.balance.left_out = self.balance.left_out[:0]
        self.balance.left_out, self.spinning = idle_spins(self.balance, self.placement, q)


def _remainder(change: Array) -> Array:
    """Angles [rad] less full turns."""
    return np.asarray(change - 2 * np.pi * np.rint(change / (2 * np.pi)))


def _directions(placement: Placement) -> dict[str, list[Any]]:
    """Those of every body: of a rigid one, and of every node of a rod."""
    found: dict[str, list[Any]] = {}
    for name, frame in placement.frames.items():
        found[name] = []
        if isinstance(frame, RigidFrame):
            found[name] += frame.directors[: len(frame.directors) - 1]
        elif isinstance(frame, BeamFrame):
            count = len(frame.nodes)
            found[name] += [frame.direction((float(frame.length) * k / (count - 1), 0.0)) for k in range(count)]
            if frame.element.director is not None:
                found[name] += [node[2] for node in frame.nodes]
    return found
