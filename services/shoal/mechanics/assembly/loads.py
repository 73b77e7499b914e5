"""Springs, dampers, joint friction, forces and torques on the vectors that the placement gave."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import fitting, plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.applied import Applied
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.masses import STATE
from shoal.mechanics.assembly.measures import ElementForceLaw, Measures, naming
from shoal.mechanics.assembly.rods import rod_axis
from shoal.mechanics.assembly.signals import SignalLoads
from shoal.mechanics.assembly.space.bushings import axes_of, law_of_turn
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.hinges import axis_of, turning
from shoal.mechanics.derived import RowAllocator
from shoal.mechanics.forces import ANGLE, DISTANCE, PLACE
from shoal.mechanics.frames import BeamFrame, ModalFrame, RigidFrame
from shoal.mechanics.numerics.tile import Number, index, stacked
from shoal.mechanics.reach import span
from shoal.mechanics.signals import Signals
from shoal.scene import (
    GROUND,
    Attachment,
    Bushing,
    DistributedForce,
    Force,
    Revolute,
    Rod,
    Scene,
    SignalFunction,
    Slider,
    Spring,
    Thrust,
    Torque,
    TorsionSpring,
)
from shoal.scene.dimensions import padded

FOLLOWED = -2
"""Loads with this number in place of a function's, and below, follow signals: that of strength k is FOLLOWED - k."""


class Loads(Measures):
    """Springs, dampers, joint friction, forces and torques."""

    def __init__(self, scene: Scene, placement: Placement, rows: RowAllocator, horizon: float) -> None:
        super().__init__(scene, placement, rows, horizon)
        self.rubbing: list[tuple[str, int, Number]] = []
        """Joints whose friction depends on their force, its element's number, and mu, of a pin times its radius."""
        measures, torques = (Measures(scene, placement, rows, 0.0) for _ in range(2))
        self.signals = SignalLoads(measures, torques, self._fit)
        self.fixed: list[tuple[int, Number, int]] = []
        self.following: list[tuple[list[int], Number, int]] = []
        self.turning: list[tuple[list[int], int]] = []
        self.twisting: list[tuple[list[int], int]] = []
        for name, joint in scene.joints.items():
            if isinstance(joint, Revolute | Slider) and joint.resists:
                self._friction(name, joint)
        for name, frame in placement.frames.items():
            if isinstance(frame, ModalFrame):
                self._bend(name, frame)
        for name, load in scene.loads.items():
            if type(load) not in LOADS:
                raise NotImplementedError(f"the mechanics knows no load of kind {load.kind!r}")
            LOADS[type(load)](self, name, load)
        for name, state in self.signals.states.items():
            number = self._function(f"states.{name}.rate", state.rate)
            self.fixed.append((placement.states[name], STATE / state.size, number))

    def _friction(self, name: str, joint: Revolute | Slider) -> None:
        smoothed = 0.0 if joint.stick == "exact" else joint.coulomb  # else a contact, see `contacts`
        law = ElementForceLaw(damping=joint.friction, coulomb=smoothed, speed=joint.coulomb_speed, drag=joint.drag)
        if np.any(joint.share) and joint.stick == "smooth":
            self.rubbing.append((name, len(self.kinds), joint.share))
        if isinstance(joint, Revolute):
            self._angle(name, joint.first, joint.second, law, joint.axis)
            return
        line = self.placement.line(joint.first, joint.direction if joint.axis is None else joint.axis)
        ends = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        self._measure(name, PLACE, [*ends, line], law, 0.0)

    def _bend(self, name: str, frame: ModalFrame) -> None:
        """Stiffness and damping of modes: springs along the frame, from zero to a mode, and from mode to mode."""
        stiffness, damping = frame.modes.stiffness, frame.modes.damping
        nowhere, measured = fixed(0.0 * frame.origin.constant[:, :1]), frame.measured
        for i, (one, rest) in enumerate(measured):
            for j, (other, other_rest) in enumerate(measured[: i + 1]):
                # 1/2 q'Kq = 1/2 sum of (sum_j K_ij) q_i^2 - 1/2 sum over i > j of K_ij (q_i - q_j)^2
                both = [np.sum(part[i], axis=0) if i == j else -part[i, j] for part in (stiffness, damping)]
                if any(np.any(part) for part in both):
                    base, natural = (nowhere, rest) if i == j else (other, rest - other_rest)
                    law = ElementForceLaw(stiffness=both[0], damping=both[1], natural=natural)
                    self._measure(name, PLACE, [base, one, frame.directors[0]], law, 0.0)

    def _torsion_spring(self, name: str, load: TorsionSpring) -> None:
        places = load.first_to is not None or load.second_to is not None
        ways = self._ways(name, load) if places else []
        start = self._opening(ways) if places else self._rest(name, load)
        rest = start if load.angle is None else load.angle
        if places:  # which tell no whole turns: straight is pi on either side
            start = start + 2 * np.pi * np.round((rest - start) / (2 * np.pi))
        law = ElementForceLaw(load.stiffness, load.cubic, load.damping, rest)
        if places:
            self._measure(name, ANGLE, ways, law, start, elastic=load.elastic)
        else:
            self._angle(name, load.first, load.second, law, load.axis, elastic=load.elastic)

    def _ways(self, name: str, load: TorsionSpring) -> list[Affine]:
        """The directions of both sides: of bodies, or from place to place."""
        found = []
        for field, side, to in (("first", load.first, load.first_to), ("second", load.second, load.second_to)):
            if to is None:
                self._require_angle(f"loads.{name}.{field}", side)
                found.append(self.placement.direction(self.scene, side))
                continue
            way = self.placement.point(self.scene, to) - self.placement.point(self.scene, side)
            if np.any(sum(self.placement.start_of(way)[0] ** 2) < (1e-9 * span(self.scene)) ** 2):
                raise InputError(f"loads.{name}.{field}_to: is where {field} is at the start; no direction leads there")
            found.append(way)
        return found

    def _opening(self, ways: list[Affine]) -> Number:
        """The angle between two directions at the start, within half a turn."""
        first, second = (self.placement.start_of(way)[0] for way in ways)
        return np.arctan2(plane.cross(first, second), sum(first * second))

    def _rest(self, name: str, load: TorsionSpring) -> Number:
        """The angle between two bodies at the start."""
        if not isinstance(self.placement, SpatialPlacement):
            return self._turn(load.first, load.second)
        a, b, ahead = turning(self.scene, name, self.placement, load.first, load.second, load.axis)
        first, second, third = (self.placement.start_of(one)[0] for one in (a, b, ahead))
        return np.arctan2(sum(third * second), sum(first * second))

    def _torque(self, name: str, load: Torque) -> None:
        if isinstance(self.placement, SpatialPlacement):
            self._turn_body(name, load, self.placement)
            return
        law = ElementForceLaw(amplitude=1.0)
        base = load.reaction or Attachment(body=GROUND, point=(0.0, 0.0))
        torque, node = self.signals.resolve(load.torque)
        if node is None:
            self._angle(name, base, load.at, law, load.axis, drive=torque)
        else:
            self.signals.turn(name, base, load.at, self.signals.strength(f"loads.{name}.torque", node))

    def _thrust(self, name: str, load: Thrust) -> None:
        joint = load.guide(self.scene.joints)
        assert isinstance(joint, Slider)
        line = self.placement.line(joint.first, joint.direction if joint.axis is None else joint.axis)
        ends = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        law = ElementForceLaw(amplitude=1.0)
        force, node = self.signals.resolve(load.force)
        if node is None:
            self._measure(name, PLACE, [*ends, line], law, 0.0, drive=force)
        else:
            self.signals.push(name, [*ends, line], self.signals.strength(f"loads.{name}.force", node))

    def _turn_body(self, name: str, load: Torque, placement: SpatialPlacement) -> None:
        """A torque in space about an axis of the body that takes it, or of the ground."""
        holder = load.reaction or Attachment(body=GROUND, point=(0.0, 0.0, 0.0))
        axis = axis_of(self.scene, name, placement, holder, load.axis)
        number = self._function(f"loads.{name}.torque", load.torque)
        for side, sense in ((load.at, 1.0), (load.reaction, -1.0)):
            if side is not None and side.body != GROUND:
                frame = placement.frames[side.body]
                if isinstance(frame, RigidFrame):
                    self.turning.append((self.rows.of_all([axis * sense, *frame.directors]), number))
                    continue
                node = frame.node(self.scene.location(side)) if isinstance(frame, BeamFrame) else None
                if not isinstance(frame, BeamFrame) or frame.element.director is None or node is None:
                    raise InputError(
                        f"loads.{name}: in space a torque acts on rigid bodies and on nodes of director rods, and "
                        f"{side.body} has none there"
                    )
                self.twisting.append((self.rows.of_all([axis * sense, *frame.nodes[node][1:]]), number))

    def _function(self, field: str, f: SignalFunction) -> int:
        """Number of a function of time; -1 for the constant 1; of what follows signals see FOLLOWED."""
        function, node = self.signals.resolve(f)
        if node is not None:
            return FOLLOWED - self.signals.strength(field, node)
        return -1 if f.number == 1.0 else self._fit(field, function)

    def _fit(self, field: str, f: Any) -> int:
        """Number of a function of time; -1 where its values are not asked for."""
        if self.horizon == 0.0:
            return -1
        with naming(field):
            self.fitted.append(fitting.fit(f, self.horizon, f.knots))
        return len(self.fitted) - 1

    def _spring(self, name: str, load: Spring) -> None:
        ends = [self.placement.point(self.scene, side) for side in (load.first, load.second)]
        rest: Number = load.length
        if rest is None:
            first, second = (self.placement.start_of(end)[0] for end in ends)
            rest = np.sqrt(sum((second - first) ** 2))
        law = ElementForceLaw(load.stiffness, load.cubic, load.damping, rest)
        self._measure(name, DISTANCE, ends, law, 0.0, elastic=load.elastic)

    def _bushing(self, name: str, load: Bushing) -> None:
        assert isinstance(self.placement, SpatialPlacement)
        ends = [self.placement.point(self.scene, side) for side in (load.first, load.second)]
        axes, _ = axes_of(load, self.placement)
        first, second = (self.placement.start_of(end)[0] for end in ends)
        for axis, stiffness, damping in zip(axes, load.stiffness, load.damping, strict=True):
            if np.any(stiffness) or np.any(damping):
                natural = sum((second - first) * self.placement.start_of(axis)[0])
                law = ElementForceLaw(stiffness, damping=damping, natural=natural)
                self._measure(name, PLACE, [*ends, axis], law, 0.0)
        if not load.resists_turns:
            return
        w, v = self.placement.turns[name]
        nowhere, units = fixed(np.zeros((3, 1))), np.eye(3)[..., None]
        if np.any(load.turn_stiffness):
            if np.ndim(load.turn_stiffness):
                raise InputError(f"loads.{name}.turn_stiffness: cannot vary; state each in a scene of its own")
            self._measure(
                name, DISTANCE, [nowhere, v], ElementForceLaw(), 0.0, elastic=law_of_turn(load.turn_stiffness)
            )
        if np.any(load.turn_damping):
            # |omega|^2 is four times the sum of the squares of the rates.
            law = ElementForceLaw(damping=4.0 * load.turn_damping)
            for vector, along in [(w, units[0]), *((v, unit) for unit in units)]:
                self._measure(name, PLACE, [nowhere, vector, fixed(along)], law, 0.0)

    def _force(self, name: str, load: Force) -> None:
        point = self.placement.point(self.scene, load.at)
        number = self._function(f"loads.{name}.scale", load.scale)
        force = padded(load.force, self.scene.dimensions)
        if load.follows:
            turning = [self.placement.direction(self.scene, load.at)]
            if self.scene.dimensions == 3:
                frame = self.placement.frames[load.at.body]
                if not isinstance(frame, RigidFrame):
                    raise InputError(f"loads.{name}.follows: in space a force turns with rigid bodies only")
                turning = list(frame.directors)
            self.following.append((self.rows.of_all([point, *turning]), force, number))
        else:
            self._fix(point, force, number)

    def _fix(self, vector: Affine, force: tuple[Number, ...], number: int) -> None:
        """A force on a vector; number: of the function of time that scales it."""
        self.fixed += [(row, part, number) for row, part in zip(self.rows.of(vector), force, strict=True)]

    def _distributed(self, name: str, load: DistributedForce) -> None:
        rod, frame = self.scene.bodies[load.body], self.placement.frames[load.body]
        assert isinstance(rod, Rod)
        number = self._function(f"loads.{name}.scale", load.scale)
        if isinstance(frame, BeamFrame):
            parts = frame.element.weight(1.0, frame.element_length)
            loads = [pair for k in range(rod.elements) for pair in zip(frame.of_element(k), parts, strict=True)]
        else:
            assert isinstance(frame, RigidFrame)
            nodes, weights = np.polynomial.legendre.leggauss(24)
            axis = (padded(rod_axis(rod, (x + 1) / 2 * rod.length), self.scene.dimensions) for x in nodes)
            loads = [(frame.point(place), w / 2 * rod.length) for place, w in zip(axis, weights, strict=True)]
        for vector, size in loads:
            self._fix(vector, tuple(part * size for part in padded(load.force, self.scene.dimensions)), number)

    def applied(self) -> Applied:
        """Applied loads that are functions of time, as arrays."""
        return self._applied(lambda number: number if number > FOLLOWED else None)

    def followed(self) -> Signals | tuple[()]:
        """Signals, and the loads that follow them, as arrays."""
        return self.signals.signals(
            lambda register: self._applied(lambda number: register(FOLLOWED - number) if number <= FOLLOWED else None)
        )

    def _applied(self, number_of: Callable[[int], int | None]) -> Applied:
        """Applied loads whose functions have a number, by that."""
        fixed, following, turning, twisting = (
            [(*one[:-1], number) for one in part if (number := number_of(one[-1])) is not None]
            for part in (self.fixed, self.following, self.turning, self.twisting)
        )
        factors = [part for _, value, _ in following for part in value]
        return Applied(
            self.scene.dimensions,
            len(fixed),
            index([row for row, _, _ in fixed]),
            stacked([part for _, part, _ in fixed]),
            index([number for _, _, number in fixed]),
            len(following),
            index([rows for rows, _, _ in following]).ravel(),
            stacked(factors),
            index([number for _, _, number in following]),
            len(turning),
            index([rows for rows, _ in turning]).ravel(),
            index([number for _, number in turning]),
            len(twisting),
            index([rows for rows, _ in twisting]).ravel(),
            index([number for _, number in twisting]),
        )


LOADS: dict[type, Callable[[Loads, str, Any], None]] = {
    Spring: Loads._spring,
    TorsionSpring: Loads._torsion_spring,
    Bushing: Loads._bushing,
    Force: Loads._force,
    Torque: Loads._torque,
    Thrust: Loads._thrust,
    DistributedForce: Loads._distributed,
}
