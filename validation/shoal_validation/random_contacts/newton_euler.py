"""Newton and Euler's equations of planar rigid bodies with contacts: event by event, every mode of contacts tried.

Coordinates are x, y and angle of each body; pins are equations with multipliers. At an event all combinations of open,
stick and slip of the contacts that touch are solved, and exactly one has to obey Coulomb's law and the signs of gaps
and forces, or the machine is not judged. Between events SciPy's DOP853.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise, product
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

Array = Any
OPEN, STICK, FORTH, BACK = 0, 1, 2, 3
SIGN = {FORTH: 1.0, BACK: -1.0}
TOUCH, FINE, STEP, SAMPLES = 1e-11, 1e-9, 2e-3, 6
"""Gap that is closed [m]; violation of a law that is none; largest step [s]; looks at each."""

MOST = 200
"""Events after which a machine is not judged: at its limit friction may stick and slip ever again."""


class UndecidedError(ArithmeticError):
    """No combination of modes obeys the laws, or several do."""


class NewtonEuler:
    """The motion of a planar scene of rigid bodies and point masses, as data."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        self.names = list(scene["bodies"])
        self.bodies = scene["bodies"]
        size = 3 * len(self.names)
        masses = [[body["mass"]] * 2 + [body.get("inertia", 1.0)] for body in self.bodies.values()]
        self.inverse = np.diag(1.0 / np.ravel(masses))
        fall = scene.get("gravity", (0.0, -9.81))
        self.force = np.tile([*fall, 0.0], len(self.names)) * np.ravel(masses)
        self.q, self.v = np.zeros(size), np.zeros(size)
        for k, name in enumerate(self.names):
            start = scene["initial"][name]
            self.q[3 * k : 3 * k + 3] = [*start["position"], start.get("angle", 0.0)]
            self.v[3 * k : 3 * k + 3] = [*start.get("velocity", (0.0, 0.0)), start.get("rate", 0.0)]
        self.weight, self.jumps = self.force, self._pulses(scene.get("loads", {}))
        self.pins = list(scene.get("joints", {}).values())
        self.contacts = list(scene["contacts"].items())
        self.closed: dict[int, int] = {}
        self.events: list[tuple[float, str]] = []
        self.decisions = 0

    def _pulses(self, loads: Mapping[str, Any]) -> list[tuple[float, Array]]:
        """Return when forces on the bodies jump, and what is added to them then."""
        found = []
        for load in loads.values():
            k = 3 * self.names.index(load["at"]["body"])
            change = np.zeros(len(self.q))
            if load["kind"] == "force":
                change[k : k + 2], law = load["force"], load["scale"]
            else:
                size, law = load["torque"].split("*", 1)
                change[k + 2] = float(size)
            begin, end = map(float, re.findall(r"t - ([0-9.]+)", law))
            found += [(begin, change), (end, -change)]
        return sorted(found, key=lambda jump: jump[0])

    # Kinematics: a place is a body and its coordinates; vectors may be complex, for derivatives along a motion.

    def _place(self, side: Mapping[str, Any], q: Array) -> tuple[Array, Array, int | None]:
        """Return a place, what its arm is in the ground's axes, and the body's number."""
        point = np.array(side.get("point", (0.0, 0.0)))
        if side["body"] == "ground":
            return point.astype(q.dtype), np.zeros(2), None
        k = self.names.index(side["body"])
        c, s = np.cos(q[3 * k + 2]), np.sin(q[3 * k + 2])
        arm = np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])
        return q[3 * k : 3 * k + 2] + arm, arm, k

    def _row(self, direction: Array, arm: Array, body: int | None, q: Array) -> Array:
        """Return the row of the rate of a material point along a direction."""
        row = np.zeros(len(q), dtype=q.dtype)
        if body is not None:
            row[3 * body : 3 * body + 2] = direction
            row[3 * body + 2] = arm[0] * direction[1] - arm[1] * direction[0]
        return row

    def surfaces(self, number: int, q: Array) -> tuple[Any, Array, Array]:
        """Return the gap of a contact and the rows of its normal rate and its slip."""
        contact = self.contacts[number][1]
        first, second = contact["first"], contact["second"]
        (a, arm_a, i), (b, arm_b, j) = self._place(first, q), self._place(second, q)
        radius, x = first.get("radius", 0.0), a - b
        if "line" in second:
            turn = second["line"] + (0.0 if j is None else q[3 * j + 2])
            n = np.array([-np.sin(turn), np.cos(turn)])
            gap = x @ n - radius
        else:
            far = np.sqrt(x @ x)
            n = x / far
            gap = far - radius - second.get("radius", 0.0)
            if "hole" in second:
                n, gap = -n, second["hole"] - radius - far
        t = np.array([n[1], -n[0]])
        touch = a - radius * n
        rows = []
        for u in (n, t):
            one = self._row(u, arm_a - radius * n, i, q)
            rows.append(one - self._row(u, arm_b + touch - b, j, q))
        return gap, rows[0], rows[1]

    def pin_rows(self, q: Array) -> tuple[Array, Array]:
        """Return how far pins are open, and their rows."""
        gaps, rows = [], []
        for pin in self.pins:
            (a, arm_a, i), (b, arm_b, j) = self._place(pin["first"], q), self._place(pin["second"], q)
            gaps.append(a - b)
            rows += [self._row(u, arm_a, i, q) - self._row(u, arm_b, j, q) for u in np.eye(2)]
        if not rows:
            return np.zeros(0), np.zeros((0, len(q)))
        return np.concatenate(gaps), np.array(rows)

    def _known(self, q: Array, v: Array, numbers: Sequence[int]) -> tuple[Array, ...]:
        """Return rows of pins and contacts (normal, slip in turn) and their biases."""

        def rows(at: Array) -> tuple[Array, Array]:
            found = [self.surfaces(k, at)[1:] for k in numbers]
            return self.pin_rows(at)[1], np.array(found).reshape(-1, len(q))

        h = 1e-30
        (pins, contacts), (pins_h, contacts_h) = rows(q), rows(q + 1j * h * v)
        return pins, contacts, (pins_h @ v).imag / h, (contacts_h @ v).imag / h

    def _reduced(self, pins: Array) -> Array:
        """The inverse mass matrix confined to the pins."""
        if not len(pins):
            return self.inverse
        moved = self.inverse @ pins.T
        return self.inverse - moved @ np.linalg.solve(pins @ moved, moved.T)

    def _free(self, pins: Array, bias: Array) -> Array:
        a = self._reduced(pins) @ self.force
        if len(pins):
            moved = self.inverse @ pins.T
            a = a - moved @ np.linalg.solve(pins @ moved, bias)
        return a

    def _forces(self, numbers: Sequence[int], modes: Sequence[int], matrix: Array, load: Array) -> Array:
        """Forces of contacts in given modes, so that the rates that they hold vanish."""
        size = 2 * len(numbers)
        equations, right = np.eye(size), np.zeros(size)
        for i, (number, mode) in enumerate(zip(numbers, modes, strict=True)):
            mu = self.contacts[number][1].get("mu", 0.0)
            if mode != OPEN:
                equations[2 * i], right[2 * i] = matrix[2 * i], -load[2 * i]
            if mode == STICK:
                equations[2 * i + 1], right[2 * i + 1] = matrix[2 * i + 1], -load[2 * i + 1]
            elif mode in SIGN:
                equations[2 * i + 1, 2 * i] = SIGN[mode] * mu
        return np.linalg.lstsq(equations, right, rcond=1e-12)[0]

    def acceleration(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return the acceleration and the forces of the closed contacts."""
        numbers = list(self.closed)
        pins, rows, pin_bias, bias = self._known(q, v, numbers)
        a, reduced = self._free(pins, pin_bias), self._reduced(pins)
        if not numbers:
            return a, np.zeros(0)
        push = self._forces(numbers, list(self.closed.values()), rows @ reduced @ rows.T, rows @ a + bias)
        return a + reduced @ rows.T @ push, push

    def _combinations(
        self, numbers: Sequence[int], slips: Sequence[float], matrix: Array, load: Array
    ) -> Iterator[tuple[tuple[int, ...], Array]]:
        """Yield modes and forces that obey the laws. slips: known slip rates; 0 of one that is to be decided."""
        choices: list[tuple[int, ...]] = []
        for number, slip in zip(numbers, slips, strict=True):
            if not self.contacts[number][1].get("mu", 0.0):
                choices.append((OPEN, FORTH))
            else:
                choices.append((OPEN, STICK, FORTH, BACK) if slip == 0.0 else (OPEN, FORTH if slip > 0.0 else BACK))
        for modes in product(*choices):
            push = self._forces(numbers, modes, matrix, load)
            rest, size = matrix @ push + load, FINE * max(1.0, float(np.max(np.abs(load))))
            for i, (number, mode, slip) in enumerate(zip(numbers, modes, slips, strict=True)):
                mu = self.contacts[number][1].get("mu", 0.0)
                if mode == OPEN and rest[2 * i] < -size:
                    break
                if mode != OPEN and (push[2 * i] < -size or abs(rest[2 * i]) > size):
                    break
                if mode == STICK and (abs(push[2 * i + 1]) > mu * push[2 * i] + size or abs(rest[2 * i + 1]) > size):
                    break
                if mode in SIGN and slip == 0.0 and mu and SIGN[mode] * rest[2 * i + 1] < -size:
                    break
            else:
                yield modes, push

    def _one(
        self, numbers: Sequence[int], slips: Sequence[float], matrix: Array, load: Array, reduced: Array, rows: Array
    ) -> tuple[tuple[int, ...], Array]:
        """Return the one combination; several that move the machine alike are one."""
        found = list(self._combinations(numbers, slips, matrix, load))
        if not found:
            raise UndecidedError("no modes of the contacts obey the laws")
        moves = [reduced @ rows.T @ push for _, push in found]
        if max(float(np.max(np.abs(move - moves[0]))) for move in moves) > 1e-6 * (1.0 + float(np.max(np.abs(load)))):
            raise UndecidedError("several modes of the contacts obey the laws")
        return found[-1]

    def _decide(self, t: float, hits: set[int], stops: set[int], slides: Mapping[int, int]) -> None:
        """Impacts, then modes. hits: contacts that close; stops: whose slip ends; slides: the ways that others slip."""
        self.decisions += 1
        if self.decisions > MOST:
            raise UndecidedError(f"more than {MOST} events")
        q, v = self.q, self.v
        touching = sorted(set(self.closed) | hits | (self._standing() if hits else set()))
        pins, rows, pin_bias, bias = self._known(q, v, touching)
        reduced = self._reduced(pins)
        matrix = rows @ reduced @ rows.T
        if hits:
            rates, load = rows @ v, rows @ v
            for i, number in enumerate(touching):
                load[2 * i] *= 1.0 + self.contacts[number][1].get("restitution", 0.0)
            _, push = self._one(touching, [0.0] * len(touching), matrix, load, reduced, rows)
            v = self.v = v + reduced @ rows.T @ push
            fast = 1e-9 * max(1.0, float(np.max(np.abs(rates))))
            keep = [i for i in range(len(touching)) if rows[2 * i] @ v < fast]
            touching = [touching[i] for i in keep]
            self.events += [(t, self.contacts[number][0]) for number in hits]
        pins, rows, pin_bias, bias = self._known(q, v, touching)
        a = self._free(pins, pin_bias)
        slips = []
        for i, number in enumerate(touching):
            slip = float(rows[2 * i + 1] @ v)
            slips.append(0.0 if number in stops or abs(slip) < 1e-9 else slip)
            slips[-1] = SIGN[slides[number]] if number in slides else slips[-1]
        self.closed = {}
        if touching:
            matrix = rows @ reduced @ rows.T
            modes, push = self._one(touching, slips, matrix, rows @ a + bias, reduced, rows)
            closed = [i for i, mode in enumerate(modes) if mode != OPEN and push[2 * i] > 0.0]
            self.closed = {touching[i]: modes[i] for i in closed}
        self._project()

    def _standing(self) -> set[int]:
        """Return contacts whose surfaces touch and do not separate, though no force holds them."""
        found = {}
        for number in range(len(self.contacts)):
            gap, normal, _ = self.surfaces(number, self.q)
            found[number] = gap <= TOUCH and normal @ self.v <= FINE * float(np.max(np.abs(self.v)))
        return {number for number, stands in found.items() if stands}

    def _project(self) -> None:
        """Close pins and contacts again."""
        for _ in range(3):
            gaps, rows = self.pin_rows(self.q)
            found = [self.surfaces(k, self.q) for k in self.closed]
            gaps, rows = np.concatenate([gaps, [one[0] for one in found]]), [*rows, *(one[1] for one in found)]
            if len(rows):
                matrix = np.array(rows)
                self.q = self.q - self.inverse @ matrix.T @ np.linalg.lstsq(
                    matrix @ self.inverse @ matrix.T, gaps, rcond=1e-12)[0]  # fmt: skip
        rows = [*self.pin_rows(self.q)[1]]
        for k, mode in self.closed.items():
            _, normal, slip = self.surfaces(k, self.q)
            rows += [normal, slip] if mode == STICK else [normal]
        if len(rows):
            matrix = np.array(rows)
            self.v = self.v - self.inverse @ matrix.T @ np.linalg.lstsq(
                matrix @ self.inverse @ matrix.T, matrix @ self.v, rcond=1e-12)[0]  # fmt: skip

    def _watched(self, y: Array) -> dict[tuple[str, int], float]:
        """Return what an event is a root of, by kind and contact: each is positive before."""
        n = len(self.q)
        q, v = y[:n], y[n:]
        found: dict[tuple[str, int], float] = {}
        _, push = self.acceleration(q, v)
        for i, (number, mode) in enumerate(self.closed.items()):
            found["lift", number] = push[2 * i]
            mu = self.contacts[number][1].get("mu", 0.0)
            if mode == STICK:
                found["slide", number] = mu * push[2 * i] - abs(push[2 * i + 1])
            elif mu:
                found["stop", number] = SIGN[mode] * float(self.surfaces(number, q)[2] @ v)
        for number in range(len(self.contacts)):
            if number not in self.closed:
                found["hit", number] = float(self.surfaces(number, q)[0]) + TOUCH
        return found

    def run(self, times: Array, most: int) -> Array:
        """Return coordinates at times [s], (times, bodies, 3), until a number of impacts: later ones are nan."""
        t, out = 0.0, np.full((len(times), len(self.names), 3), np.nan)
        n = len(self.q)
        touching = {k for k in range(len(self.contacts)) if self.surfaces(k, self.q)[0] < 1e-9}
        self._decide(0.0, {k for k in touching if self.surfaces(k, self.q)[1] @ self.v < 1e-12}, touching, {})
        self.events.clear()
        sample, last_time = 0, float(times[-1])
        while t < last_time and len(self.events) < most:
            end = min([last_time, *(jump for jump, _ in self.jumps if jump > t)])
            solver = DOP853(
                lambda _, y: np.concatenate([y[n:], self.acceleration(y[:n], y[n:])[0]]), t,
                np.concatenate([self.q, self.v]), end, rtol=1e-12, atol=1e-13, max_step=STEP,
            )  # fmt: skip
            event: list[tuple[str, int]] = []
            before = self._watched(solver.y)
            started = {key for key, value in before.items() if value <= 1e-10}
            while not event and solver.status == "running":
                solver.step()
                inside = solver.dense_output()
                looks = np.linspace(solver.t_old, solver.t, SAMPLES)
                for left, right in pairwise(looks):
                    now = self._watched(inside(right))
                    roots = {key: _root(self, inside, key, left, right) for key in now
                             if now[key] < 0.0 and (before[key] > 0.0 or key in started)}  # fmt: skip
                    started -= {key for key in started if now[key] > 1e-10}
                    if roots:
                        stop = min(roots.values())
                        event = [key for key, value in roots.items() if value <= stop + 1e-13]
                        break
                    before = now
                last = stop if event else solver.t
                while sample < len(times) and times[sample] <= last:
                    out[sample] = inside(times[sample])[:n].reshape(-1, 3)
                    sample += 1
                y = inside(last)
            t, self.q, self.v = float(last), y[:n], y[n:]
            if event:
                self._leave(t, event)
            elif t < last_time:
                self.force = self.weight + sum(change for jump, change in self.jumps if jump <= t)
                self._decide(t, set(), {k for k, mode in self.closed.items() if mode == STICK}, {})
        return out

    def _leave(self, t: float, event: Sequence[tuple[str, int]]) -> None:
        _, push = self.acceleration(self.q, self.v)
        order = list(self.closed)
        slides = {k: BACK if push[2 * order.index(k) + 1] > 0.0 else FORTH for kind, k in event if kind == "slide"}
        for kind, k in event:
            if kind == "lift":
                del self.closed[k]
        hits = {k for kind, k in event if kind == "hit"}
        self._decide(t, hits, {k for kind, k in event if kind == "stop"}, slides)


def _root(machine: NewtonEuler, inside: Any, key: tuple[str, int], left: float, right: float) -> float:
    def value(t: float) -> float:
        found: float = machine._watched(inside(t))[key]
        return found

    if value(left) <= 0.0:
        return left
    return float(brentq(value, left, right, xtol=1e-15, rtol=1e-15))
