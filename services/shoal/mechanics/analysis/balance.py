"""Static equilibrium of a model: Newton's method and descent of the potential, on the constraints.

Both work in the free directions Z with Z' M Z = I, so that lengths are in kg^1/2 m and the eigenvalues of the reduced
stiffness Z' (K + sum lambda_k C_k,qq) Z are squared frequencies; of a large machine the lowest ones (`sparse_freedom`).
Descent replaces negative ones by their absolute values, so that it leaves saddles and maxima (Dauphin et al. 2014), and
shortens its step as Levenberg and Marquardt do. Loads that follow the motion have no potential: with them the machine
creeps, as if overdamped, by implicit steps that grow as it comes to rest (pseudo-transient continuation, Kelley and
Keyes 1998).

One-sided constraints g >= 0 are the active set of the descent (Nocedal and Wright, Numerical Optimization, section
16.5): closed ones are constraints like any other, a step ends where the first open gap closes, and at rest the contact
that pulls most opens.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.optimize
import scipy.sparse

from shoal.mechanics.analysis.evaluate import SIZES, Evaluation, Evaluator, Pressing
from shoal.mechanics.analysis.freedom import Freedom, Metric
from shoal.mechanics.analysis.lanczos import is_firm, lowest
from shoal.mechanics.analysis.rest_contacts import RestContacts
from shoal.mechanics.analysis.small_motions import ROUND, BoundedMatrix, Spectrum, parts_of, spectrum
from shoal.mechanics.analysis.sparse_freedom import SparseFreedom, SparseMetric
from shoal.mechanics.numerics.newton import Root, newton
from shoal.mechanics.numerics.tile import Array

CLOSE = 1e-11
"""Converged: a correction of the bodies [rms displacement / size of the machine] below this,"""
STALLED = 1e-7
"""or one below this that round-off keeps from getting smaller."""
CLOSED = 1e-14
"""Joints that gape by less [m] are closed to round-off."""
DIVERGENT = 3.0
"""A correction of so many times the machine's size leads nowhere."""
LONGEST = 0.2
"""Longest step of the descent, as a fraction of the machine's size,"""
WIDEST = 1.5
"""and its largest turn [rad] of any body or section, so that turns can be counted."""
NARROW = 0.3
"""The largest turn [rad] in one step of a machine that creeps, which keeps to its way."""
FAR = 30.0
"""A machine whose bodies have moved (rms) by so many times its own size falls for ever."""
STRAINED = 1e-9
"""Forces that strain the machine by less than this count for nothing."""
SEEN = 1e-9
"""Unbalanced forces below this fraction of all forces are round-off."""
BALANCED = 1e-5
"""Forces of which a smaller part than this is left are in balance."""
OFF = 16.0
"""So many times what is left of the forces may be off by, over the machine's size, is the stiffness off."""


LARGE = 400
"""Machines of more unknowns have no explicit basis of the free directions; from here on it takes longer."""
LOWEST = 6
"""So many of the lowest motions are asked for, where no others say how many."""
ACTIVE = 0.03
"""Parts of a step that are longer than this share of the longest one."""

IDLE = 1e-9
"""Contacts press with more than this part of all forces, as far as round-off tells."""
STILL = 1e-9
"""States that change by less than this part of their size in a second rest, whatever they depend on."""
GROWN = 1e9
"""A state that has become so many times its size grows for ever."""
TOUCHING = 1e-9
"""Gaps below this part of the machine's size touch at an equilibrium, whose corrections are below it."""

FALLS = "falls without end"
"""Why a machine that has gone `FAR` does not come to rest."""


class View(NamedTuple):
    """A state at rest: its forces, the free directions, and the multipliers.

    acceleration: by the unbalanced forces, Z Z' Q; turning: the force along each motion that is left out
    """

    evaluation: Evaluation
    freedom: Freedom | SparseFreedom
    multipliers: Array
    acceleration: Array
    turning: Array

    @property
    def basis(self) -> Array:
        """The basis Z of the free directions of a machine that has one, see `metric_of`; states are the last ones."""
        assert isinstance(self.freedom, Freedom)
        return self.freedom.basis

    @property
    def motions(self) -> Array:
        """The same without states of the user."""
        assert isinstance(self.freedom, Freedom)
        return self.freedom.motions


class Balance:
    """The balance of forces of one model at time t [s]. size: of the machine [m]; mass: of all bodies [kg].

    left_out: motions z that are not taken, with z' M z = 1, as rows z' M, (motions, unknowns); contacts: one-sided
    constraints, of which those are closed whose numbers are in `closed`
    """

    def __init__(self, evaluator: Evaluator, t: float, size: float, mass: float) -> None:
        self.evaluator, self.t = evaluator, t
        self.metric = metric_of(evaluator)
        self.left_out = np.zeros((0, evaluator.model.unknowns))
        self.contacts, self.closed = RestContacts(evaluator), list[int]()
        self.size, self.unit = size, size * np.sqrt(mass)
        q = evaluator.model.q0[:, 0]
        stiff = abs(evaluator.stiffness(q, t, load=0.0)) @ np.abs(q)
        self._least = STRAINED * self.metric.size(stiff)
        self.learn(q)

    def learn(self, q: Array) -> None:
        """Let forces be small beside those by which loads that follow answer a displacement at q."""
        if self.evaluator.follows:
            freedom = self.metric.freedom(self.evaluator.at(q, t=self.t).jacobian)
            assert isinstance(freedom, Freedom)
            ways = freedom.motions
            stiff = float(np.linalg.norm(ways.T @ (self.evaluator.stiffness(q, self.t) @ ways)))
            self._least = max(self._least, STRAINED * self.unit * stiff)

    def look(self, q: Array, load: float = 1.0) -> View:
        """Forces, free directions and multipliers at q."""
        evaluation = self._seen(q, load)
        freedom, count = self._freedom(evaluation), evaluation.jacobian.shape[0]
        acceleration, lagrange = freedom.split(evaluation.force)
        return View(evaluation, freedom, lagrange[:count], acceleration, lagrange[count:])

    def _seen(self, q: Array, load: float = 1.0) -> Evaluation:
        """A state at rest, with closed contacts among its constraints."""
        evaluation = self.evaluator.at(q, t=self.t, load=load)
        if not self.closed:
            return evaluation
        gaps, rows = self.contacts.at(q)
        return replace(
            evaluation,
            gap=np.append(evaluation.gap, gaps[self.closed]),
            jacobian=scipy.sparse.csr_array(scipy.sparse.vstack([evaluation.jacobian, rows[self.closed]])),
        )

    def pressing(self, view: View) -> Array:
        """Return the forces of closed contacts [N or N m], in their order, those that pull negative."""
        return np.asarray(-view.multipliers[self.evaluator.model.constraints.size :])

    def _weights(self, view: View) -> Array:
        """Return these forces over the size of all forces, in the metric of M^-1."""
        rows = view.evaluation.jacobian[self.evaluator.model.constraints.size :]
        sizes = np.array([self.metric.size(row) for row in rows.toarray()][: len(self.closed)])
        return np.asarray(self.pressing(view) * sizes / max(self._scale(view), 1e-300))

    def hold(self, q: Array) -> dict[str, float]:
        """Close those contacts that press at a state, and return the forces [N or N m] of all that touch, by name.

        Those without a force stay open, with the force zero.
        """
        if not self.contacts.size:
            return {}
        gaps, _ = self.contacts.at(q)
        self.closed = touching = np.flatnonzero(np.abs(gaps) <= TOUCHING * self.size).tolist()
        while self._open(self.look(q)):
            pass
        view = self.look(q)
        pressing = dict(zip(self.closed, self.pressing(view).tolist(), strict=True))
        idle = {number for number, part in zip(self.closed, self._weights(view), strict=True) if part <= IDLE}
        self.closed = [number for number in self.closed if number not in idle]
        return {self.contacts.names[k]: pressing[k] if k in self.closed else 0.0 for k in touching}

    @property
    def rough(self) -> list[str]:
        """Closed contacts that have friction or roll, by which small motions stick to them, which they do not know."""
        rubs = self.evaluator.gaps.rubs
        return [self.contacts.names[k] for k in self.closed if rubs[self.contacts.numbers[k]] > 0]

    def pressed(self, q: Array) -> Pressing:
        """Return what the closed contacts exert at a state, among all contacts of the model."""
        normal = np.zeros(self.evaluator.gaps.size)
        normal[self.contacts.numbers[self.closed]] = self.pressing(self.look(q))
        return self.evaluator.pressed(q, normal)

    def _freedom(self, evaluation: Evaluation) -> Freedom | SparseFreedom:
        rows = evaluation.jacobian
        if len(self.left_out):
            rows = scipy.sparse.vstack([rows, scipy.sparse.csr_array(self.left_out)])
        return self.metric.freedom(rows)

    def _closing(self, evaluation: Evaluation, freedom: Freedom | SparseFreedom) -> Array:
        """The smallest move that closes the joints."""
        return freedom.shift(np.append(-evaluation.gap, np.zeros(len(self.left_out))))

    def stiffness(self, q: Array, view: View, load: float = 1.0) -> scipy.sparse.csc_array:
        """The stiffness K + sum lambda_k C_k,qq in all coordinates."""
        count = self.evaluator.model.constraints.size
        found = self.evaluator.stiffness(q, self.t, multipliers=view.multipliers[:count], load=load)
        if not self.closed:
            return found
        bent = self.contacts.curvature(q, np.array(self.closed), view.multipliers[count:])
        return scipy.sparse.csc_array(found + bent)

    def holding(self, stiffness: scipy.sparse.csc_array) -> scipy.sparse.csc_array:
        """Return a stiffness that holds those states that act on nothing and are rates of motions, as a work done."""
        own = np.zeros(stiffness.shape[0])
        for k in self.evaluator.states:
            idle = not (stiffness[[k]].count_nonzero() or stiffness[:, [k]].count_nonzero())
            own[k] = self.evaluator.weight if idle else 0.0
        return scipy.sparse.csc_array(stiffness + scipy.sparse.diags_array(own)) if np.any(own) else stiffness

    def tangent(self, q: Array, view: View, load: float = 1.0) -> BoundedMatrix:
        """The same with the bound of its round-off."""
        loose = self.evaluator.stiffness(q, self.t, load=load)
        full = self.stiffness(q, view, load)
        return BoundedMatrix(full, ROUND * (abs(loose) + abs(full - loose)))

    def at_rest(self, q: Array, view: View) -> BoundedMatrix:
        """Return the tangent at an equilibrium, where the remaining forces are round-off."""
        found, evaluation = self.tangent(q, view), view.evaluation
        if self.residual(view) > BALANCED:
            return found
        left = np.abs(evaluation.force - evaluation.jacobian.T @ view.multipliers) / self.size
        return BoundedMatrix(found.matrix, found.bound + OFF * scipy.sparse.diags_array(left))

    def is_firm(self, q: Array, view: View, load: float = 1.0) -> bool:
        """Return whether every displacement is pulled back by more than round-off, where the loads have a potential."""
        stiffness = self.tangent(q, view, load)
        if isinstance(view.freedom, SparseFreedom):
            mass, parts = self.evaluator.mass, parts_of(self.evaluator.mass, view.evaluation.jacobian)
            if is_firm(view.freedom, stiffness, mass, parts):
                return True
        found = self.spectrum_of(stiffness, view)
        return bool(np.all(found.values > found.levels))

    def spectrum(self, q: Array, view: View, load: float = 1.0, least: int = LOWEST) -> Spectrum:
        """The squared frequencies of small motions, where the loads have a potential; least: see `spectrum_of`."""
        return self.spectrum_of(self.tangent(q, view, load), view, least)

    def spectrum_of(self, stiffness: BoundedMatrix, view: View, least: int = LOWEST) -> Spectrum:
        """Return the spectrum of a symmetric stiffness; of a large machine at least so many of the lowest."""
        parts = parts_of(self.evaluator.mass, view.evaluation.jacobian)
        if isinstance(view.freedom, SparseFreedom):
            return lowest(view.freedom, stiffness, self.evaluator.mass, parts, least)
        return spectrum(stiffness, view.motions, self.evaluator.mass, parts)

    def residual(self, view: View) -> float:
        """Unbalanced force over the elastic and the applied force, all in the metric of M^-1.

        Where neither acts, over the force that a strain of 1e-9 would take. Rates of states count in `rates`.
        """
        scale = self._scale(view)
        left = np.hypot(self.length(self._moving(view.acceleration)), np.linalg.norm(view.turning))
        return float(left) / scale if scale > 0 else 0.0

    def rates(self, view: View) -> Array:
        """Return the rates of the states of the user [their size per second], (states,)."""
        return np.asarray(view.acceleration[self.evaluator.states])

    def restless(self, q: Array, view: View) -> dict[str, float]:
        """Return the rates of those states that do not rest [their size per second], by name.

        A state rests if the smallest change of the machine and of all states that would let its rate vanish is small.
        """
        states, rates = self.evaluator.states, self.rates(view)
        if not len(states):
            return {}
        ways = np.linalg.norm(self.stiffness(q, view)[states] @ view.basis, axis=1)
        off = np.abs(rates) > np.maximum(BALANCED * ways * self.unit / self.evaluator.weight, STILL)
        return {name: float(rates[k]) for k, name in enumerate(self.evaluator.model.scene.states) if off[k]}

    def _moving(self, parts: Array) -> Array:
        """Return a displacement or a force without states."""
        if not len(self.evaluator.states):
            return parts
        parts = parts.copy()
        parts[self.evaluator.states] = 0.0
        return parts

    def _bounded(self, parts: Array, q: Array) -> Array:
        """Return a displacement or an acceleration with those of states over these, where they are large."""
        parts = parts.copy()
        parts[self.evaluator.states] /= np.maximum(1.0, np.abs(q[self.evaluator.states]) / SIZES)
        return parts

    def _scale(self, view: View) -> float:
        parts = (view.evaluation.elastic, self._moving(view.evaluation.force - view.evaluation.elastic))
        return max(self._least, *(self.metric.size(part) for part in parts))

    def restore(self, q: Array) -> tuple[Array, float]:
        """Return the nearest position (metric of M) that satisfies the joints, and the remaining violation."""
        if self.evaluator.model.constraints.size == 0 and not self.closed:
            return q, 0.0

        def correct(q: Array) -> tuple[Array, float]:
            evaluation = self._seen(q)
            if np.max(np.abs(evaluation.gap)) <= CLOSED:
                return np.zeros_like(q), 0.0
            move = self._closing(evaluation, self._freedom(evaluation))
            return move, float(np.max(np.abs(move)) / np.max(np.abs(q), initial=1.0))

        q = newton(correct, q, close=CLOSE, most=12).point
        return q, float(np.max(np.abs(self._seen(q).gap)))

    def newton(self, q: Array, load: float = 1.0, most: int = 20) -> Root[Array]:
        """Newton's method with full steps; corrections relative to the machine's size."""

        def correct(q: Array) -> tuple[Array, float]:
            view = self.look(q, load)
            stiffness = self.holding(self.stiffness(q, view, load))
            back = self._closing(view.evaluation, view.freedom)
            move = view.freedom.step(stiffness, self._unbalanced(view) - stiffness @ back)
            return back + move, self.length(move) / self.unit + float(np.max(np.abs(back), initial=0.0))

        return newton(correct, q, close=CLOSE, round_off=STALLED, divergent=DIVERGENT, most=most)

    def descend(
        self, q: Array, turn: Callable[[Array, Array], float], follow: Callable[[Array], None], most: int = 400
    ) -> Root[Array]:
        """Descend in the potential to a stationary point, by Newton steps with absolute curvatures.

        Unlike in `newton` the potential judges each step, and the damping depends on what lowers it.
        turn: the largest turn [rad] of a body between two states; follow: counts the turns, called after every step.
        """
        q = self._closed_at(q)
        begin, shift, correction = q, 0.0, np.inf
        view = self.look(q)
        for iteration in range(1, most + 1):
            slope = self._slope(q, view)
            if self.residual(view) < SEEN**1.3:
                if not self._open(view):
                    return Root(q, True, iteration, correction)
                view, shift = self.look(q), 0.0
                slope = self._slope(q, view)
            potential = view.evaluation.potential
            noise = 1e-13 * (abs(view.evaluation.strain) + abs(view.evaluation.gravity) + abs(potential))
            while True:
                move, active = slope.step(shift)
                length = self.length(move)
                if length > LONGEST * self.unit:
                    move = move * (LONGEST * self.unit / length)
                    length = LONGEST * self.unit
                trial, gap = self.restore(q + move)
                correction = length / self.unit
                trial, hit = self._until_contact(q, trial)
                ahead = self.look(trial)
                change = ahead.evaluation.potential - potential
                if hit is None and gap < 1e-10 and not change <= noise:
                    # Turning along straight lines stretches: take the stiff directions back before judging.
                    trial, gap = self._relax(trial, 10.0 * active)
                    trial, hit = self._until_contact(q, trial)
                    ahead = self.look(trial)
                    change = ahead.evaluation.potential - potential
                if gap < 1e-10 and change <= noise and turn(q, trial) < WIDEST:
                    break
                if correction < CLOSE:
                    good = self.residual(view) < np.sqrt(SEEN)
                    return Root(q, good, iteration, correction, "" if good else "the descent of the potential stalls")
                shift = max(4.0 * shift, slope.size / max(length, 1e-300))
            follow(trial)
            q, view, shift = trial, ahead, shift / 8.0 if correction > 1e-6 else 0.0
            if hit is not None:
                self.closed.append(hit)
                q, _ = self.restore(q)
                view = self.look(q)
            elif slope.holds and correction < CLOSE:
                if not self._open(view):
                    return Root(q, True, iteration, correction)
                view, shift = self.look(q), 0.0
            if self.length(q - begin) > FAR * self.unit:
                return Root(q, False, iteration, correction, FALLS)
        return Root(q, False, most, correction, f"not at rest after {most} steps downhill")

    def _closed_at(self, q: Array) -> Array:
        """Close the joints, and the contacts whose gaps are not open."""
        q, _ = self.restore(q)
        if self.contacts.size:
            while True:
                gaps, _ = self.contacts.at(q)
                shut = [int(k) for k in np.flatnonzero(gaps < self.contacts.resolution) if k not in self.closed]
                if not shut:
                    break
                self.closed += shut
                q, _ = self.restore(q)
        return q

    def _until_contact(self, q: Array, trial: Array) -> tuple[Array, int | None]:
        """Return a step from q, cut where the first open gap closes, and the number of that."""
        if not self.contacts.size:
            return trial, None
        open_gaps = [k for k in range(self.contacts.size) if k not in self.closed]
        if not open_gaps or np.min(self.contacts.at(trial)[0][open_gaps]) >= -self.contacts.resolution:
            return trial, None

        def way(share: float) -> Array:
            return self.restore(q + share * (trial - q))[0]

        def least(share: float) -> float:
            return float(np.min(self.contacts.at(way(share))[0][open_gaps]))

        share = float(scipy.optimize.brentq(least, 0.0, 1.0, xtol=1e-14)) if least(0.0) > 0.0 else 0.0
        there = way(share)
        return there, open_gaps[int(np.argmin(self.contacts.at(there)[0][open_gaps]))]

    def _open(self, view: View) -> bool:
        """Open the contact that pulls most, and return whether there was one."""
        if not self.closed:
            return False
        weights = self._weights(view)
        pulls = bool(np.min(weights) < -IDLE)
        if pulls:
            del self.closed[int(np.argmin(weights))]
        return pulls

    def _unbalanced(self, view: View) -> Array:
        """Return the generalised force that is not balanced."""
        return np.asarray(self.evaluator.mass @ view.acceleration)

    def _slope(self, q: Array, view: View) -> _Slope:
        """Return the slope and the curvatures of the potential."""
        stiffness = self.tangent(q, view)
        found, force = self.spectrum_of(stiffness, view), self._unbalanced(view)
        pull = found.shapes.T @ force
        # What nothing pulls and nothing holds stays where it is.
        idle = (np.abs(found.values) <= found.levels) & (np.abs(pull) <= SEEN * self._scale(view))
        left = force - self.evaluator.mass @ (found.shapes @ pull)
        is_whole = len(found.values) == view.freedom.degrees
        holds = bool(np.all((found.values > found.levels) | idle))
        pull = np.where(idle, 0.0, pull)
        rest = 0.0 if is_whole else self.length(view.acceleration - found.shapes @ pull)
        size = float(np.hypot(np.linalg.norm(pull), rest))
        return _Slope(self, view.freedom, stiffness.matrix, found, pull, None if is_whole else left, size, holds)

    def creep(
        self, q: Array, turn: Callable[[Array, Array], float], follow: Callable[[Array], None], most: int = 400
    ) -> Root[Array]:
        """Follow the overdamped motion M dq/ds = Q, and states with it, to rest (pseudo-transient continuation).

        Unlike in `newton` the damping is the time step of that motion: no step goes back to where it is unstable.
        turn, follow: see `descend`
        """
        q, _ = self.restore(q)
        begin, view, slower, correction = q, self.look(q), 1.0, np.inf
        states = self.evaluator.states
        for iteration in range(1, most + 1):
            if self.residual(view) < SEEN**1.3 and np.all(np.abs(self.rates(view)) < STILL):
                return Root(q, True, iteration, correction)
            full, basis = self.holding(self.stiffness(q, view)), view.basis
            stiffness = basis.T @ (full @ basis)
            pushed = max(0.0, -2.0 * float(np.min(scipy.linalg.eigvals(stiffness).real)))
            pull = self.length(self._bounded(view.acceleration, q)) / (LONGEST * self.unit)
            while True:
                shift = max(slower * pull, pushed)
                move = view.freedom.step(full, self._unbalanced(view), shift)
                correction = self.length(move) / self.unit
                trial, gap = self.restore(q + move)
                if (gap < 1e-10 and turn(q, trial) < NARROW) or correction < CLOSE:
                    break
                slower = 4.0 * shift / pull
            follow(trial)
            q, view, slower = trial, self.look(trial), max(1.0, slower / 4.0)
            if correction < CLOSE or (correction < STALLED and self.residual(view) < SEEN):
                return Root(q, True, iteration, correction)
            if self.length(self._bounded(q - begin, q)) > FAR * self.unit or np.any(np.abs(q[states]) > GROWN):
                return Root(q, False, iteration, correction, FALLS)
        return Root(q, False, most, correction, f"not at rest after {most} steps")

    def length(self, move: Array) -> float:
        """Return the length of a move [kg^1/2 m]; its components include curvatures, which may be large."""
        return float(np.sqrt(max(0.0, float(move @ (self.evaluator.mass @ move)))))

    def _relax(self, q: Array, stiff: float) -> tuple[Array, float]:
        """Newton's method, damped so that it moves directions stiffer than `stiff` [rad^2/s^2]; as `restore`."""

        def correct(q: Array) -> tuple[Array, float]:
            view = self.look(q)
            move = view.freedom.step(self.stiffness(q, view), self._unbalanced(view), stiff)
            return move, self.length(move) / self.unit

        relaxed = newton(correct, q, close=1e-6, most=4, move=lambda q, step: self.restore(q + step)[0])
        return self.restore(relaxed.point)


class _Slope(NamedTuple):
    """The slope of the potential along the lowest motions, and what is left of it along the others, None if there are
    none. size: of all, in the metric of M^-1; holds: whether nothing is held by less than round-off, or pushed away.
    """

    balance: Balance
    freedom: Freedom | SparseFreedom
    stiffness: scipy.sparse.csc_array
    lowest: Spectrum
    pull: Array
    left: Array | None
    size: float
    holds: bool

    def step(self, damping: float) -> tuple[Array, float]:
        """Return the step of Newton's method with absolute curvatures, and the largest one that matters to it."""
        curvature, shapes, levels = self.lowest
        y = self.pull / (np.maximum(np.abs(curvature), levels) + damping)
        active = np.abs(y) > ACTIVE * np.max(np.abs(y), initial=0.0)
        stiff, move = float(np.max(np.abs(curvature[active]), initial=0.0)), shapes @ y
        if self.left is not None:
            mass = self.balance.evaluator.mass
            rest = self.freedom.step(self.stiffness, self.left, damping)
            rest = rest - shapes @ (shapes.T @ (mass @ rest))
            move, square = move + rest, self.balance.length(rest) ** 2
            if square > (ACTIVE * np.max(np.abs(y), initial=0.0)) ** 2:
                stiff = max(stiff, float(rest @ (self.stiffness @ rest)) / square)
        return move, stiff


def metric_of(evaluator: Evaluator) -> Metric | SparseMetric:
    """Return the mass matrix of a machine, factored as its size and its loads want it.

    The stiffness of loads that follow the motion is not symmetric, and such a machine has its whole basis.
    """
    if evaluator.model.unknowns <= LARGE or evaluator.follows:
        return Metric(evaluator.mass, len(evaluator.states))
    return SparseMetric(evaluator.mass, evaluator.pattern)
