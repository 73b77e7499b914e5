"""Forward kinematics along a spanning tree of the joints, from the ground and from bodies with a stated position."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.conditions import JointCondition, unknown
from shoal.mechanics.joints import Along, Apart, Meet, Turned, of_scene
from shoal.mechanics.numerics.tile import Array, Number
from shoal.mechanics.plane import as_complex, phasor
from shoal.mechanics.start.rigid_bodies import bending_rate, lead, place_of, rate_of, value_of
from shoal.scene import GROUND, Attachment, Function, Scene

Step = tuple[str, Attachment | None, Attachment | None, Number]
"""A body, the known attachment it hangs on, its own attachment there, and how far apart they are [m]."""


_TWO_SIDED = (Meet, Along, Apart, Turned)


class Walk:
    """The spanning tree in whose order joints place the bodies. Raises InputError where nothing determines a place."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.steps: list[Step] = []
        known = {GROUND}
        waiting = dict.fromkeys(scene.bodies)
        while waiting:
            step = self._next(waiting, known)
            self.steps.append(step)
            known.add(step[0])
            waiting.pop(step[0])

    def _next(self, waiting: dict[str, None], known: set[str]) -> Step:
        for kind in (Meet, None, Along, Apart):
            if kind is None:
                for name in waiting:
                    if self.scene.start(name).position is not None:
                        return name, None, None, 0.0
                continue
            for _, condition in of_scene(self.scene):
                if not isinstance(condition, JointCondition):
                    raise unknown(condition)
                if not isinstance(condition, Meet | Along | Apart) or not isinstance(condition, kind):
                    continue
                for here, there in _both_ways(condition):
                    if here.body in known and there.body in waiting:
                        if not isinstance(condition, Apart):
                            return there.body, here, there, 0.0
                        if condition.length is not None:
                            return there.body, here, there, value_of(condition.length)
        # Any other condition than these may determine it; in space it starts at the origin.
        if self.scene.dimensions == 3 or any(
            not isinstance(condition, _TWO_SIDED) and not condition.is_of_start for _, condition in of_scene(self.scene)
        ):
            return next(iter(waiting)), None, None, 0.0
        name = next(iter(waiting))
        raise InputError(f"initial.{name}.position: say where {name} starts; no joint point tells it")

    def _moving(self, at: Attachment, u: Array, v: Array, column: dict[str, int]) -> tuple[Number, Number]:
        """Place x + iy [m] and velocity [m/s] of an attachment."""
        if at.body == GROUND and isinstance(at.point, str):
            path = self.scene.ground_points[at.point]
            place, speed = (part(path.x) + 1j * part(path.y) for part in (value_of, rate_of))
            return place, speed
        if at.body == GROUND:
            return as_complex(at.point), 0.0
        x, y, turn = range(column[at.body], column[at.body] + 3)
        arm, turning = self._arm(at, u[:, turn], v[:, turn])
        return u[:, x] + 1j * u[:, y] + arm, v[:, x] + 1j * v[:, y] + turning

    def _arm(self, at: Attachment, angle: Array, rate: Array) -> tuple[Array, Array]:
        """The way x + iy [m] from a body's origin to an attachment, and its rate."""
        axis = phasor(angle)
        arm = axis * place_of(self.scene, at)
        return arm, 1j * rate * arm + axis * bending_rate(self.scene, at)

    @property
    def closing(self) -> list[str]:
        """Joints that are not in the tree: they close loops."""
        used = {(id(here), id(there)) for _, here, there, _ in self.steps}
        needed = {
            name
            for name, condition in of_scene(self.scene)
            if isinstance(condition, _TWO_SIDED)
            and any((id(here), id(there)) in used for here, there in _both_ways(condition))
        }
        return [name for name in self.scene.joints if name not in needed]

    def poses(self, angles: Array, rates: Array) -> tuple[Array, Array]:
        """Poses and their rates for angles [rad] and rates [rad/s] of all bodies, each (lanes, bodies)."""
        u, v = np.zeros((2, len(angles), 3 * len(self.scene.bodies)))
        u[:, 2::3], v[:, 2::3] = angles, rates
        column = {name: 3 * number for number, name in enumerate(self.scene.bodies)}
        for name, here, there, away in self.steps:
            k = column[name]
            if here is None or there is None:
                start = self.scene.start(name)
                position, speed = as_complex(start.position or (0.0, 0.0)), as_complex(start.velocity)
            else:
                place, speed = self._moving(here, u, v, column)
                arm, turning = self._arm(there, u[:, k + 2], v[:, k + 2])
                position, speed = place + away - arm, speed - turning
            u[:, k], u[:, k + 1] = np.real(position), np.imag(position)
            v[:, k], v[:, k + 1] = np.real(speed), np.imag(speed)
        return u, v


def guessed_angles(scene: Scene, lanes: int) -> tuple[Array, Array]:
    """Return angles [rad] and rates [rad/s] of all bodies: as stated, by a neighbour, or zero; each (lanes, bodies)."""
    both, ties = [], [condition for _, condition in of_scene(scene) if isinstance(condition, Turned)]
    for quantity, level in (("angle", 0), ("rate", 1)):
        found: dict[str, Number] = {
            name: value for name, start in scene.initial.items() if (value := getattr(start, quantity)) is not None
        }
        found[GROUND] = 0.0
        waiting = [name for name in scene.bodies if name not in found]
        while waiting:
            tied = next(_tied(scene, ties, found, level), None)
            name, value = tied if tied is not None else (waiting[0], 0.0)
            found[name] = value
            waiting.remove(name)
        both.append(np.stack([np.broadcast_to(np.asarray(found[n], dtype=float), lanes) for n in scene.bodies], 1))
    return both[0], both[1]


def _both_ways(condition: Meet | Along | Apart | Turned) -> tuple[tuple[Attachment, Attachment], ...]:
    return (condition.first, condition.second), (condition.second, condition.first)


def _tied(scene: Scene, ties: list[Turned], found: dict[str, Number], level: int) -> Iterator[tuple[str, Number]]:
    """Yield bodies whose angle (level 0) or rate (level 1) follows by a joint from that of a neighbour."""
    for tie in ties:
        if (tie.first.body in found) == (tie.second.body in found):
            continue
        sign, here, there = (1, tie.first, tie.second) if tie.first.body in found else (-1, tie.second, tie.first)
        if isinstance(tie.angle, Function):
            turn: Number = (value_of, rate_of)[level](tie.angle)
        elif level:
            turn = 0.0
        elif not tie.is_of_start:
            turn = tie.angle if tie.either is None else tie.either[0]
        else:
            continue
        if scene.bodies[there.body].kind != "point-mass":
            shift = 0.0 if level else lead(scene, here) - lead(scene, there)
            yield there.body, found[here.body] + shift + sign * turn
