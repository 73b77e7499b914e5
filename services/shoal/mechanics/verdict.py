"""Checks of a run of the native solver: finite, within reach, energy balanced, joints closed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.findings import Finding, Kind
from shoal.mechanics import findings as kinds
from shoal.mechanics import reach as reaches
from shoal.mechanics.affine import NEGLIGIBLE
from shoal.mechanics.constraints import OPEN
from shoal.mechanics.contact import coulomb, decision, impact
from shoal.mechanics.forces import ANGLE, LAW, STIFFNESS
from shoal.mechanics.functions import value
from shoal.mechanics.integrators import Choice, facts
from shoal.mechanics.least.work import HERE
from shoal.mechanics.marched import (
    CONSTRAINT_DRIFT,
    ENDED,
    ENERGY_SCALE,
    FARTHEST,
    REACHED,
    SINGULAR,
    STEPS,
    UNCLOSED,
    UNDECIDED,
)
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, Flags
from shoal.mechanics.signals import CHATTERS
from shoal.scene import GROUND, Function, Scene
from shoal.scene.joints import Joint

SINKING = 3000.0
"""A weight that nothing holds yet falls for as long as the error of its rate is below the absolute tolerance; by then
it is 14 times as fast as that. Twice as much is no error by the default tolerance of energies, a hundredth."""
RESOLVED = 1e4
"""Of rates of so many absolute tolerances the errors of 50 steps, added up, are a hundredth of the energy."""

REACH = "let the drives ask for no more than the joints can reach"
"""Advice where a machine is driven."""

CROSSING = (
    "the machine is at a singular position there, where branches of its motion cross and so small a motion does not "
    "show which one it is on"
)
"""Reason where a motion creeps at a singular position."""

CONTACT_TROUBLES = {
    coulomb.NO_FORCE: kinds.NO_CONTACT_FORCE,
    coulomb.SEVERAL: kinds.SEVERAL_MOTIONS,
    coulomb.UNDECIDED: kinds.UNDECIDED_CONTACTS,
    coulomb.JAMS: kinds.JAMMED_JOINT,
    decision.TOO_MANY: kinds.TOO_MANY_EVENTS,
    impact.GAINS: kinds.IMPACT_GAINS,
}
"""Why contacts end a motion."""
_JUDGED = slice(FARTHEST, CONSTRAINT_DRIFT + 1)
"""What has a largest value."""


class Limits:
    """Limits of the checks of a scene's runs, computed once.

    numbers, here and below: results of `reduce_record` for every lane, (NUMBERS, lanes).
    """

    def __init__(self, scene: Scene, model: Model) -> None:
        self._scene, self._solver, self._model = scene, scene.solver, model
        self.span = reaches.span(scene)
        """The machine's size [m]."""
        self.anchors = reaches.anchors(model.scene)
        """Where the ground holds the machine [m], (anchors, d, lanes) or (anchors, d, 1)."""
        # Modal rods that turn faster than they vibrate fly apart, as they do not know that tension makes them stiff.
        modal = any(body.element == "modal" for body in scene.bodies.values())
        self._remark = ("modal rods are right for small bending: use element: ancf-cable for more",) if modal else ()
        laws = [model.function(int(number)).breaks[1:-1] for number in model.forces.table if number >= 0]
        known = max((law[0] for law in laws), default=0.0), min((law[-1] for law in laws), default=0.0)
        self._laws = (f"`elastic` of the loads is known from {known[0]:.3g} to {known[1]:.3g}",) if laws else ()
        self._driven = any(not _constant(joint) for joint in scene.joints.values()) or bool(scene.ground_points)
        self._weight = float(np.max(np.abs(model.weight), initial=0.0))
        stiff = max(np.max(family.coefficients, initial=0.0) for family in model.elements)
        self._mass = float(sum(np.max(part) for (row, column), part in model.mass_entries.items() if row == column))
        self._still = self._weight * 1e-9 * self.span + 1e-12 * float(stiff) + self._sprung() * NEGLIGIBLE**2 / 2
        # So far away a marker may be whatever the energy of the run.
        near = np.minimum(self._reach(np.zeros(1)), np.finfo(float).max)
        tolerances = np.array([[scene.solver.energy_tolerance], [OPEN]])
        self._fine = np.concatenate([near[None], np.broadcast_to(tolerances, (2, len(near)))])

    def _reach(self, energy: Array) -> Array:
        """Return the largest distance of a marker [m]; round-off for a wheel's centre, which does not move."""
        return reaches.MARGIN * reaches.reach(self._model.scene, energy) + NEGLIGIBLE * self.span

    def _sprung(self) -> float:
        """The sum of what springs are stiff by where they are relaxed, by the machine's size or by 1 rad [J]."""
        forces = self._model.forces
        stiff = np.max(np.abs(forces.law[STIFFNESS::LAW]), axis=1, initial=0.0)
        laws = [abs(value(self._model.function(int(k)), 0.0, 1)) if k >= 0 else 0.0 for k in forces.table]
        return float(np.sum((stiff + laws) * np.where(forces.kind == ANGLE, 1.0, self.span) ** 2))

    def energy_floor(self, end: float) -> float:
        """The energy [J] that the energy error of a run up to `end` [s] is compared with at least.

        That error is relative to the largest energy in motion. A machine that never moves has none: then its
        weight lifted by its span and the energy of stretching its rods and springs set the scale, as far as round-off
        goes. Rates near the tolerance of rates are not known: a motion by them, such as an elastic law begins that
        vanishes at rest but for round-off, is compared with their energy. Nor is it an error if the weight sinks at a
        rate that this tolerance allows: between two bars in one line, which hold it to the second order only, it does
        until they feel it.
        """
        tolerance = self._solver.absolute_tolerance
        moving = 0.5 * self._mass * (RESOLVED * tolerance) ** 2
        return self._still + moving + self._weight * SINKING * tolerance * end + 1e-300

    def check(self, numbers: Array, choice: Choice, failed: Flags) -> list[list[Finding]]:
        """Return the findings about every lane; nothing if all are ok. failed: lanes that have no start."""
        lanes = numbers.shape[1]
        fine = numbers[_JUDGED] <= self._fine
        if fine.all() and not failed.any():
            return []
        # Lanes may be machines of different lengths.
        reach = np.broadcast_to(self._reach(numbers[ENERGY_SCALE]), lanes)
        failed = np.broadcast_to(failed, lanes)
        found: list[list[Finding]] = [[] for _ in range(lanes)]
        for lane in np.flatnonzero(~fine.all(axis=0) | failed):
            one = self._check_lane(choice, numbers[:, lane], float(reach[lane]), bool(failed[lane]))
            found[lane] = [] if one is None else [replace(one, steps=(*one.steps, *self._remark))]
        return found

    def _check_lane(self, choice: Choice, numbers: Array, reach: float, failed: bool) -> Finding | None:
        """Return the finding about one lane, whose numbers are (NUMBERS,); None if it is ok."""
        farthest, energy_drift, constraint_drift = numbers[_JUDGED]
        steps = numbers[STEPS]
        adaptive, allowed = facts(choice.name).adaptive, self._solver.energy_tolerance
        finite = np.isfinite(farthest) and np.isfinite(energy_drift)
        if failed:
            return kinds.NO_START.found("no start agrees with the joints and with what is stated")
        if not finite and numbers[UNCLOSED] >= 0:
            return self._open(kinds.NOT_CLOSED if self._driven else kinds.TORN_OPEN, numbers, adaptive)
        if not finite and numbers[UNDECIDED] == CHATTERS:
            fields, time = ", ".join(self._model.signal_fields), float(numbers[ENDED])
            return kinds.CHATTERS.found(f"signals of {fields} switch without end at t = {time:.6g} s", time=time)
        if not finite and numbers[UNDECIDED] >= 0:
            return self._contact(int(numbers[UNDECIDED]), float(numbers[ENDED]))
        singular = numbers[SINGULAR] == HERE
        if not finite and np.isfinite(energy_drift) and adaptive and (singular or steps >= self._solver.max_steps):
            there = f"{steps:.0f} steps of {choice.name} led to {numbers[REACHED]:.4g} s only"
            reached = {"steps": float(steps), "time": float(numbers[REACHED])}
            if singular:
                return kinds.SINGULAR.found(f"{there}: {CROSSING}", **reached)
            return kinds.STEPS_EXHAUSTED.found(there, "raise solver.max_steps or solver.relative_tolerance", **reached)
        if not finite:
            advice = "no step is short enough for it" if adaptive else "use a smaller step"
            ended = f"the motion is not finite {self._since(numbers[ENDED])}"
            advice = f"{advice}{', or ' + REACH if self._driven else ''}"
            formulas = ", ".join(self._model.signal_fields)
            values = (f"see that {formulas} has a value all the way",) if formulas else ()
            return kinds.NOT_FINITE.found(ended, *values, advice, *self._laws, time=float(numbers[ENDED]))
        if farthest > reach:
            text = f"a marker is {farthest:.3g} m away, the reach is {reach:.3g} m"
            return kinds.OUT_OF_REACH.found(text, distance=float(farthest), reach=reach)
        if energy_drift > allowed:
            text = f"energy is off by {energy_drift:.2g}, allowed {allowed:g} (relative)"
            steps_ = () if adaptive else ("use a smaller step",)
            return kinds.ENERGY.found(text, *steps_, drift=float(energy_drift), allowed=allowed)
        if not constraint_drift <= OPEN:
            return self._open(kinds.NOT_CLOSED, numbers, adaptive)
        return None

    def _contact(self, trouble: int, time: float) -> Finding:
        """Name the contact that could not be decided on, and when."""
        contact, outcome = divmod(trouble, coulomb.TROUBLES)
        field = self._model.gap_fields[contact]
        return CONTACT_TROUBLES[outcome].found(f"{field} ends the motion at t = {time:.6g} s", time=time)

    def _open(self, kind: Kind, numbers: Array, adaptive: bool) -> Finding:
        """Name the joint that no position closes, since when, and the likely causes."""
        field = self._field(self._model.constraint_names[int(numbers[UNCLOSED])])
        cause = REACH if self._driven else "use a smaller step"
        if self._driven and not adaptive:
            cause = f"use a smaller step, or {REACH}"
        text = f"constraints are violated: {field} cannot be closed {self._since(numbers[ENDED])}"
        return kind.found(text, cause, drift=float(numbers[CONSTRAINT_DRIFT]), time=float(numbers[ENDED]))

    def _since(self, t: float) -> str:
        """An instant [s], and the drives that move then."""
        model = self._model
        moving = {
            self._field(name): None
            for name, k in zip(model.constraint_names, model.constraints.drive, strict=True)
            if k >= 0 and any(value(model.function(int(k)), t, order) for order in (1, 2, 3))
        }
        return f"from t = {t:.6g} s on" + (f", where {', '.join(moving)} moves" if moving else "")

    def _field(self, name: str) -> str:
        """The field that states a constraint."""
        return f"joints.{name}" if name in self._scene.joints else name.replace(GROUND, "ground_points", 1)


def _constant(joint: Joint) -> bool:
    """Return whether a joint has no part that a function of time moves."""
    functions = (getattr(joint, field, None) for field in ("angle", "length", "value"))
    return all(f.number is not None for f in functions if isinstance(f, Function))
