"""Moreau's and Jean's time stepping (Moreau 1988, Jean 1999) of planar rigid bodies: rates and impulses step by step.

Half a step with the old rates gives places at which gaps and rows are taken. Contacts whose gaps are closed there obey
Newton's law of impact in Moreau's form and Coulomb's law, in rates and impulses of the step; the rest of the step goes
with the new rates. Impacts are not located: the method is of first order, its results are a staircase of its data. The
kinematics are those of `newton_euler`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from shoal_validation.random_contacts.newton_euler import NewtonEuler

Array = Any
SWEEPS, SETTLED = 10_000, 1e-12
"""Most sweeps over the contacts of a step, and the change [N s per kg of inverse mass] at which they end."""


class MoreauJean:
    """The motion of a planar scene of rigid bodies on pins and with contacts, as data."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        self.bodies = NewtonEuler(scene)
        self.laws = [(law.get("restitution", 0.0), law.get("mu", 0.0)) for _, law in self.bodies.contacts]

    def run(self, times: Array, step: float) -> Array:
        """Return coordinates at times [s] that are multiples of a step [s], (times, bodies, 3)."""
        q, v, out = self.bodies.q.copy(), self.bodies.v.copy(), []
        done = 0
        for count in np.rint(np.asarray(times) / step).astype(int):
            for _ in range(done, count):
                q, v = self._stepped(q, v, step)
            done = count
            out.append(q.reshape(-1, 3).copy())
        return np.array(out)

    def _stepped(self, q: Array, v: Array, step: float) -> tuple[Array, Array]:
        bodies, middle = self.bodies, q + 0.5 * step * v
        after = v + step * bodies.inverse @ bodies.force
        pins = bodies.pin_rows(middle)[1]
        if len(pins):
            moved = bodies.inverse @ pins.T
            after = after - moved @ np.linalg.solve(pins @ moved, pins @ after)
        found = [(k, *bodies.surfaces(k, middle)) for k in range(len(bodies.contacts))]
        closed = [(k, normal, slip) for k, gap, normal, slip in found if gap <= 0.0]
        if closed:
            rows = np.array([row for _, normal, slip in closed for row in (normal, slip)])
            spread = bodies._reduced(pins) @ rows.T
            laws = [self.laws[k] for k, _, _ in closed]
            after = after + spread @ _impulses(rows @ spread, rows @ after, rows @ v, laws)
        return middle + 0.5 * step * after, after


def _impulses(matrix: Array, free: Array, before: Array, laws: list[tuple[float, float]]) -> Array:
    """Return impulses (normal, tangential in turn) that obey both laws, by Gauss and Seidel's projected sweeps.

    matrix: rates by impulses; free, before: rates without impulses, and before the step
    """
    push = np.zeros(len(free))
    for _ in range(SWEEPS):
        change = 0.0
        for i, (restitution, mu) in enumerate(laws):
            n, t = 2 * i, 2 * i + 1
            old = push[n], push[t]
            want = free[n] + matrix[n] @ push + restitution * min(before[n], 0.0)
            push[n] = max(push[n] - want / matrix[n, n], 0.0)
            if mu:
                slip = free[t] + matrix[t] @ push
                push[t] = np.clip(push[t] - slip / matrix[t, t], -mu * push[n], mu * push[n])
            change = max(change, abs(push[n] - old[0]) * matrix[n, n], abs(push[t] - old[1]) * matrix[t, t])
        if change < SETTLED:
            break
    return push
