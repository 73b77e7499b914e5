"""Contacts of a scene: stops, ropes and struts, backlash, dry friction that sticks, and pairs of surfaces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import cams, plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.lifted import first_axis
from shoal.mechanics.assembly.measures import ElementForceLaw, Measures
from shoal.mechanics.cams import least_radii, segments
from shoal.mechanics.derived import RowAllocator
from shoal.mechanics.forces import ANGLE, DISTANCE, LAW, NATURAL, PLACE
from shoal.mechanics.frames import RigidFrame
from shoal.mechanics.gaps import DRY, GIVES, LAW_SIZE, LIMIT, PAIR, RIGID, Gaps
from shoal.mechanics.joints import conditions
from shoal.mechanics.numerics.tile import Array, Number, index, stacked
from shoal.mechanics.pairs import FLAT, HOLE, PROFILE, ROUND, Pairs
from shoal.mechanics.profiles import CORNER, SEGMENT, SIZE, Profiles, chains
from shoal.mechanics.reach import span
from shoal.mechanics.ropes import arcs_at_start
from shoal.mechanics.sums import BodyAngle, Measured, angle_sides, axis_of_angle, coordinate, ends, line_of
from shoal.scene import (
    GROUND,
    Attachment,
    Contact,
    ContactSurface,
    Coupling,
    Distance,
    Gear,
    PointMass,
    Revolute,
    Scene,
    Slider,
)
from shoal.scene.clearances import contacts_of
from shoal.scene.formula import Measure
from shoal.scene.joints import Rope, Z, tightened
from shoal.scene.polygons import corners_of, distance, is_concave

RESOLUTION = 1e-12
"""Gaps below this part of the machine's size, or below it in rad, are closed: a thousand times round-off."""
BEYOND = 1e-6
"""Starts farther beyond a limit than this part of the machine's size, or than this in rad, are none."""
LOWER, UPPER = 1.0, -1.0


class Contacts(Measures):
    """Contacts in the order of the arrays of `gaps.Gaps`; limits are the natural values of measures without force."""

    def __init__(self, scene: Scene, placement: Placement, rows: RowAllocator) -> None:
        super().__init__(scene, placement, rows, 0.0)
        self.beyond: Any = np.zeros(1, dtype=bool)
        """Which lanes start beyond a limit, (lanes,) or (1,)."""
        self.fields: list[str] = []
        """What states each contact."""
        self._each: list[tuple[int, int, int]] = []
        """Kind, number and number after the last of its measures of each contact."""
        self._weights: list[Number] = []
        """Of the measures in the gaps."""
        self._numbers: list[tuple[Number, ...]] = []
        """Restitution, tangential restitution, mu, mu_static, given friction and share of each contact."""
        self._rolls: list[bool] = []
        self._laws: list[tuple[int, tuple[Number, ...]]] = []
        """Whether a contact gives way, and the numbers of its law."""
        self._pairs: list[tuple[int, bool, list[bool], list[int], Number, Number]] = []
        """Shape, whether a disc, turning sides, rows, radius and reach of each pair of surfaces."""
        self._chains: list[tuple[int, int, bool, int, tuple[int, int]]] = []
        """First feature, their number, whether the last leads to the first, twin and outline of each pair."""
        self._features: list[tuple[Array, Array]] = []
        """Kinds and numbers of the features of all outlines."""
        for name, joint in scene.joints.items():
            if isinstance(joint, Revolute | Slider):
                self._stops(name, joint)
            elif isinstance(joint, Distance) and joint.keeps != "exactly":
                self._rope(name, joint)
            elif isinstance(joint, Rope) and joint.keeps != "exactly":
                self._reeved(name, joint)
            elif isinstance(joint, Gear | Coupling) and joint.backlash is not None:
                self._backlash(name, joint)
        for name, joint in scene.joints.items():
            if isinstance(joint, Revolute | Slider) and joint.stick == "exact":
                self._dry(name, joint)
        for path, contact in contacts_of(scene).items():
            self._pair(path, contact)

    def gaps(self, pressed: Mapping[str, tuple[int, int]]) -> Gaps:
        """Return the contacts as arrays. pressed: first constraint and number of those of joints whose force counts."""
        size, rubs = len(self._each), [self._is_rough(k) for k in range(len(self._each))]
        shapes, discs, turns, rows, radii, reaches = zip(*self._pairs, strict=True) if self._pairs else ((),) * 6
        pairs = Pairs(
            self.scene.dimensions, len(self._pairs), index(shapes), index(discs),
            index(turns).ravel(), index(rows).ravel(), stacked(radii), stacked(reaches), self._profiles(),
        )  # fmt: skip
        numbers = tuple(zip(*self._numbers, strict=True)) if size else ((),) * 6
        restitution, tangential, mu, mu_static, given, share = (stacked(part) for part in numbers)
        held = [pressed.get(field.split(".")[1], (0, 0)) if field.endswith(".mu") else (0, 0) for field in self.fields]
        return Gaps(
            size,
            self.scene.dimensions - 1 if any(rubs) else 0,
            index([kind for kind, _, _ in self._each]),
            index([number for _, number, _ in self._each]),
            index([last for _, _, last in self._each]),
            index(rubs),
            index(self._rolls),
            self.forces(),
            pairs,
            stacked(self._weights),
            restitution,
            tangential,
            mu,
            mu_static,
            given,
            share,
            index([first for first, _ in held]),
            index([parts for _, parts in held]),
            index([soft for soft, _ in self._laws]),
            stacked([part for _, law in self._laws for part in law]),
            RESOLUTION * float(np.max(span(self.scene))) if size else 0.0,
        )

    def _profiles(self) -> Profiles:
        """Return the outlines as arrays."""
        begin, length, closed, twin, whole = zip(*self._chains, strict=True) if self._chains else ((),) * 5
        kinds = [kind for kinds, _ in self._features for kind in kinds.tolist()]
        numbers = np.concatenate([np.zeros(0), *(numbers.ravel() for _, numbers in self._features)])
        outline = index(whole).ravel()
        return Profiles(index(begin), index(length), index(closed), index(twin), outline, index(kinds), numbers)

    def _is_rough(self, k: int) -> bool:
        return self._each[k][0] == DRY or self._rolls[k] or bool(np.any(self._numbers[k][3]))

    def _add(
        self, field: str, kind: int, number: int, weights: Sequence[Number] = (), *, restitution: Number = 0.0,
        tangential: Number = 0.0, mu: Number = 0.0, mu_static: Number = 0.0, given: Number = 0.0, share: Number = 0.0,
        rolls: bool = False, law: tuple[Number, ...] | None = None,
    ) -> None:  # fmt: skip
        """Add a contact. weights: of its measures, the last ones, in its gap."""
        self.fields.append(field)
        self._each.append((kind, number, number + len(weights)))
        self._weights += weights
        self._numbers.append((restitution, tangential, mu, mu_static, given, share))
        self._rolls.append(rolls)
        self._laws.append((RIGID, (0.0,) * LAW_SIZE) if law is None else (GIVES, law))

    def _limit(self, field: str, side: str, place: Number, sign: float, limit: Number, restitution: Number) -> None:
        """Limit the last measure on one side; place: where it is at the start [rad or m]."""
        self._add(field, LIMIT, len(self.kinds) - 1, [sign], restitution=restitution)
        where = ".".join(filter(None, (field, side)))
        self._check(where, place, limit, sign)

    def _check(self, where: str, place: Number, limit: Number, sign: float) -> None:
        """Keep which lanes start beyond a limit. Raises InputError where a scene without lanes does."""
        beyond = np.ravel(sign * (np.asarray(place) - limit) < -BEYOND * np.max(span(self.scene)))
        if len(beyond) == 1 and beyond[0]:
            start, stop = float(np.ravel(place)[0]), float(np.ravel(limit)[0])
            raise InputError(f"{where}: the machine starts beyond this limit, at {start:.6g} where it is {stop:.6g}")
        self.beyond = self.beyond | beyond

    def _stops(self, name: str, joint: Revolute | Slider) -> None:
        """Limit the free motion of a joint."""
        for field, sign in (("min", LOWER), ("max", UPPER)):
            limit = None if joint.stops is None else getattr(joint.stops, field)
            if joint.stops is not None and limit is not None:
                place = self._free_motion(name, joint, limit)
                self._limit(f"joints.{name}.stops", field, place, sign, limit, joint.stops.restitution)

    def _dry(self, name: str, joint: Revolute | Slider) -> None:
        """Let a joint stick by dry friction of a given force, or by a part of its own."""
        self._free_motion(name, joint, 0.0)
        field = f"joints.{name}.{'mu' if np.any(joint.share) else 'coulomb'}"
        self._add(field, DRY, len(self.kinds) - 1, [1.0], mu_static=1.0, given=joint.coulomb, share=joint.share)

    def _free_motion(self, name: str, joint: Revolute | Slider, limit: Number) -> Number:
        """Measure the free motion of a joint; returns where it is at the start [rad or m]."""
        law = ElementForceLaw(natural=limit)
        if isinstance(joint, Revolute):
            self._angle(name, joint.first, joint.second, law, joint.axis)
            return self.angles[-1]
        line = self.placement.line(joint.first, joint.direction if joint.axis is None else joint.axis)
        ends = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        self._measure(name, PLACE, [*ends, line], law, 0.0)
        first, second, along = (self.placement.start_of(one)[0] for one in (*ends, line))
        return np.asarray(sum((second - first) * along) / np.sqrt(sum(along**2)))

    def _rope(self, name: str, joint: Distance) -> None:
        """Limit a distance."""
        ends = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        first, second = (self.placement.start_of(end)[0] for end in ends)
        start = np.sqrt(sum((second - first) ** 2))
        limit = start if joint.length is None or joint.length.number is None else joint.length.number
        self._measure(name, DISTANCE, ends, ElementForceLaw(natural=limit), 0.0)
        sign = UPPER if joint.keeps == "at-most" else LOWER
        self._limit(f"joints.{name}.keeps", "", start, sign, limit, joint.restitution)

    def _reeved(self, name: str, joint: Rope) -> None:
        """Limit the length of each part of a rope over pulleys, as the sum of its spans, arcs and wound ends."""
        (condition,), axis = conditions(joint, self.scene.dimensions), first_axis(self.scene.dimensions)
        zero, one = fixed(0.0 * axis), fixed(axis)
        ground = Attachment(body=GROUND, point=(0.0, 0.0))
        for number, part in enumerate(condition.parts):
            first, weights, start = len(self.kinds), list[Number](), np.zeros(1)
            spans = zip(self.placement.ropes[name, number], part.spans, strict=True)
            for (length, direction), (_, _, c) in spans:
                begin = self.placement.start_of(length)[0][0]
                self._measure(name, PLACE, [zero, length, one], ElementForceLaw(natural=begin), 0.0)
                weights.append(-1.0)
                start = start + begin
                if direction is not None:
                    x, y = self.placement.start_of(direction)[0]
                    angle = np.arctan2(y, x)
                    self._measure(name, ANGLE, [one, direction], ElementForceLaw(natural=angle), angle)
                    weights.append(-c)
            for drum, factor in part.drums:
                if drum.body != GROUND:
                    self._angle(name, ground, drum, ElementForceLaw(), Z)
                    self.laws[-LAW + NATURAL] = self.angles[-1]
                    weights.append(-factor)
            field = f"joints.{name}.tension" + str(number + 1) * (len(condition.parts) > 1)
            if joint.length is not None:
                whole = start + arcs_at_start(joint, self.placement)
                self.laws[LAW * first + NATURAL] += joint.length - whole
                if joint.law is None:
                    self._check(f"joints.{name}.length", whole, joint.length, UPPER)
            law = None if joint.law is None else joint.law.numbers
            self._add(field, LIMIT, first, weights, restitution=joint.restitution, law=law)

    def _backlash(self, name: str, joint: Gear | Coupling) -> None:
        """Limit the sum that a gear or a coupling keeps to both sides of what it is at the start."""
        assert joint.backlash is not None
        for sign in (LOWER, UPPER):
            first = len(self.kinds)
            factors = self._counted(name, joint)
            self.laws[LAW * first + NATURAL] += -0.5 * sign * joint.backlash / factors[0]
            weights = [sign * factor for factor in factors]
            self._add(f"joints.{name}.backlash", LIMIT, first, weights, restitution=joint.restitution)

    def _counted(self, name: str, joint: Gear | Coupling) -> list[Number]:
        """Measure what a gear or a coupling counts from where it starts; return the factors."""
        (condition,) = conditions(tightened(joint), self.scene.dimensions)
        factors = []
        for factor, one in condition.parts:
            if np.any(factor) and self._count(name, one):
                factors.append(factor / condition.scale)
        return factors

    def _count(self, name: str, one: Measured) -> bool:
        """Add a measure of a sum, from where it starts; return whether there is one, as the ground has no angle."""
        scene, law = self.scene, ElementForceLaw()
        if isinstance(one, BodyAngle):
            if one.side.body == GROUND:
                return False
            self.placement.angle(name, one.side, one.axis)  # refuses axes in space that move
            self._angle(name, Attachment(body=GROUND, point=(0.0, 0.0)), one.side, law, one.axis)
            begin = self.angles[-1]
        elif isinstance(one, Measure) and one.kind == "angle":
            self._angle(name, *angle_sides(scene, one), law, axis_of_angle(scene, one) or Z)
            begin = self.angles[-1]
        elif isinstance(one, Measure) and one.kind == "distance":
            points = [self.placement.point(scene, end) for end in ends(scene, one)]
            self._measure(name, DISTANCE, points, law, 0.0)
            first, second = (self.placement.start_of(point)[0] for point in points)
            begin = np.sqrt(sum((second - first) ** 2))
        else:
            begin = self._along(name, one, law)
        self.laws[-LAW + NATURAL] = begin
        return True

    def _along(self, name: str, one: Measured, law: ElementForceLaw) -> Number:
        """Measure a slide or a coordinate; return where it starts [m]."""
        if isinstance(one, Measure) and one.kind == "slide":
            joint, along = line_of(self.scene, one)
            line = self.placement.line(joint.first, along)
            points = [self.placement.point(self.scene, side) for side in (joint.first, joint.second)]
        else:
            side, axis = coordinate(self.scene, one)
            unit = np.eye(self.scene.dimensions)[axis][:, None]
            line, points = fixed(unit), [fixed(0.0 * unit), self.placement.point(self.scene, side)]
        self._measure(name, PLACE, [*points, line], law, 0.0)
        first, second, way = (self.placement.start_of(vector)[0] for vector in (*points, line))
        return sum((second - first) * way)

    def _pair(self, path: str, contact: Contact) -> None:
        """Let two surfaces touch. path: of what states the contact."""
        first, second = contact.first, contact.second
        places = [self.placement.point(self.scene, side) for side in (first, second)]
        shape = {"hole": HOLE, "round": ROUND, "polygon": PROFILE, "cam": PROFILE}.get(second.shape, FLAT)
        normal = places[0]
        if shape == FLAT:
            direction = second.plane if second.line is None else second.line + math.pi / 2
            normal = self.placement.line(second, direction)
        axle = normal if first.axis is None else self.placement.line(first, first.axis)
        rows, turns = [], []
        for side, place in zip((first, second), places, strict=True):
            turning = contact.rubs or shape in (FLAT, PROFILE) or first.axis is not None
            directors = self._directors(side) if turning else []
            turns.append(bool(directors))
            rows += [place, *(directors or [place] * (1 if self.scene.dimensions == 2 else 3))]
        reach = second.radius if second.hole is None else second.hole
        parts = self._outline(path, contact)
        static = contact.mu if contact.mu_static is None else contact.mu_static
        for chain in parts:
            self._chains.append(chain)
            self._pairs.append(
                (shape, first.axis is not None, turns, self.rows.of_all([*rows, normal, axle]), first.radius, reach)
            )
            self._add(
                path, PAIR, len(self._pairs) - 1, restitution=contact.restitution,
                tangential=contact.tangential_restitution, mu=contact.mu, mu_static=static, rolls=contact.rolling,
                law=None if contact.law is None else contact.law.numbers,
            )  # fmt: skip
        flat = None if first.axis is None else axle
        if contact.law is None:
            if shape == PROFILE:
                gap = self._outside(second, places) - first.radius
            else:
                gap = self._start_gap(shape, places, normal, flat, first.radius, reach)
            self._check(path, gap, 0.0, LOWER)

    def _outline(self, path: str, contact: Contact) -> list[tuple[int, int, bool, int, tuple[int, int]]]:
        """Add the chains of an outline; return them for every pair of surfaces, of which some chains want two."""
        begin = sum(len(one) for one, _ in self._features)
        second, radius = contact.second, float(np.max(contact.first.radius))
        if second.cam is not None:
            numbers = segments(second.cam, SIZE)
            least, hollow = least_radii(numbers)
            if least <= 0.0:
                raise InputError(f"{path}.second.cam.table: the outline goes through its place; state larger radii")
            if radius >= hollow:
                raise InputError(
                    f"{path}.first.radius: a roller of {radius:g} m does not fit into a hollow of the cam, of a radius "
                    f"of curvature of {hollow:.3g} m"
                )
            self._features.append((np.full(len(numbers), SEGMENT), numbers))
            return [(begin, len(numbers), True, 0, (begin, begin))]
        if second.polygon is None:
            return [(0, 0, False, 0, (0, 0))]
        corners = corners_of(second.polygon)
        found, every = [], chains(corners, is_concave(corners))
        whole = begin, begin + sum(len(kinds) for kinds, _, _ in every)
        for kinds, numbers, turn in every:
            self._features.append((kinds, numbers))
            closed = kinds[0] == CORNER
            # A body outside a chain that turns by less than half a turn touches it once.
            twins = [1, -1] if not closed and turn >= math.pi else [0]
            found += [(begin, len(kinds), closed, twin, whole) for twin in twins]
            begin += len(kinds)
        return found

    def _outside(self, second: ContactSurface, places: list[Affine]) -> Number:
        """Return how far the first place is outside the outline of the second surface at the start [m]."""
        one, other = (self.placement.start_of(place)[0] for place in places)
        directors = self._directors(second)
        axis = self.placement.start_of(directors[0])[0] if directors else np.array([[1.0], [0.0]])
        way = one - other
        local = np.stack(np.broadcast_arrays(sum(axis * way), plane.cross(axis, way))) / np.sqrt(sum(axis**2))
        if second.cam is not None:
            return cams.distance(segments(second.cam, SIZE), local)
        return distance(corners_of(second.polygon or ()), local)

    def _directors(self, side: ContactSurface) -> list[Affine]:
        """Return vectors that turn with a body; none for the ground, point masses, and rods, which touch at a point."""
        if side.body == GROUND or isinstance(self.scene.bodies[side.body], PointMass):
            return []
        frame = self.placement.frames[side.body]
        if not isinstance(frame, RigidFrame):
            return []
        return [frame.directors[0]] if self.scene.dimensions == 2 else list(frame.directors)

    def _start_gap(
        self, shape: int, places: list[Affine], normal: Affine, axle: Affine | None, radius: Number, reach: Number
    ) -> Number:
        """Return the gap at the start [m]; axle: of a disc."""
        first, second, n = (self.placement.start_of(one)[0] for one in (*places, normal))
        if shape == FLAT:
            n = n / np.sqrt(sum(n**2))
            a = 0.0 * n if axle is None else self.placement.start_of(axle)[0]
            across = 1.0 if axle is None else np.sqrt(1.0 - sum(a * n) ** 2 / sum(a**2))
            return sum((first - second) * n) - radius * across
        apart = np.sqrt(sum((first - second) ** 2))
        return reach - radius - apart if shape == HOLE else apart - radius - reach
