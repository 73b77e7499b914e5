"""Ropes over pulleys, drums and eyes: straight spans along common tangents of circles, and arcs around them.

A span leaves a circle of the signed radius a = +-R_1 (positive where the rope turns counter-clockwise around it) and
meets one of b = +-R_2. With the vector D between the centres, c = a - b, the unit vector t along the span and its
length s, D = s t - c n, n being t turned by 90 degrees. Of s + c angle(t) the gradient by D is t. The sum of these over
the spans of a part of a rope, and of R times the turns of drums on which its ends are wound, is its length.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.conditions import JointCondition
from shoal.mechanics.numerics.tile import Number
from shoal.mechanics.rope_path import tangents, wraps
from shoal.scene import GROUND
from shoal.scene.ropes import Rope, RopePlace

NEARER = 1.0 / 3.0
"""Of a span's length at the start, at which the added mass of its direction is that of the bodies it is a part of.

The part grows with the square of what a span is shorter; iterative refinement converges to a thirtieth of it.
"""


@dataclass(frozen=True)
class Part:
    """A part of a rope that shares its length: places one after the other, between ends or wheels that it grips."""

    places: tuple[RopePlace, ...]

    @property
    def spans(self) -> Iterator[tuple[RopePlace, RopePlace, Number]]:
        """Yield both places of each span, and its c [m]."""
        for one, other in zip(self.places[:-1], self.places[1:], strict=True):
            yield one, other, one.signed_radius - other.signed_radius

    @property
    def drums(self) -> Iterator[tuple[RopePlace, Number]]:
        """Yield the ends that are wound on drums, and the factors of their angles in its length [m/rad]."""
        for end, sign in ((self.places[0], -1.0), (self.places[-1], 1.0)):
            if np.any(end.radius):
                yield end, sign * end.signed_radius


def parts_of_rope(rope: Rope) -> list[Part]:
    """Return the parts of a rope, which wheels that it grips separate."""
    whole = (rope.first, *rope.over, rope.second)
    cuts = [0, *(k + 1 for k, guide in enumerate(rope.over) if guide.grips), len(whole) - 1]
    return [Part(whole[begin : end + 1]) for begin, end in pairwise(cuts)]


@dataclass(frozen=True)
class Reeved(JointCondition):
    """Each part of a rope has the length that it has at the start; or its spans are known only.

    holds: whether it keeps the length by constraints, not by contacts that pull only
    """

    parts: tuple[Part, ...]
    holds: bool

    @property
    def is_of_start(self) -> bool:
        """Return true: its lengths are those of the start."""
        return True

    def turned(self, scene: Any) -> Iterator[RopePlace]:
        """Yield the drums and wheels whose angles count."""
        for part in self.parts:
            yield from (drum for drum, _ in part.drums)

    def constrain(self, name: str, bodies: Any) -> None:
        """Define the spans, and require the lengths where constraints hold them."""
        for number, part in enumerate(self.parts):
            spans = [bodies.span(name, gap_of(bodies, one, other), c) for one, other, c in part.spans]
            if spans[0] is not None:
                bodies.ropes[name, number] = spans
            if self.holds:
                self._require(name, part, spans, bodies)

    def _require(self, name: str, part: Part, spans: list[Any], bodies: Any) -> None:
        first = fixed(np.eye(bodies.scene.dimensions)[0][:, None])
        total, roots = fixed(0.0 * first.constant), []
        angles = [(factor, bodies.angle(name, drum, None)) for drum, factor in part.drums if drum.body != GROUND]
        levers: list[float | None] = [None] * len(angles)
        for span, (one, other, c) in zip(spans, part.spans, strict=True):
            if span is None:
                roots.append((1.0, gap_of(bodies, one, other), c))
                continue
            length, direction = span
            total = total + length
            if direction is not None:
                angles.append((c, direction))
                levers.append(lever_of(bodies, length))
        period = 1.0
        if angles and not _is_one_size([factor for factor, _ in angles]):
            for (factor, vector), lever in zip(angles, levers, strict=True):
                total = total + bodies.count(name, vector, lever) * factor
            angles = []
        elif angles:
            period = 2.0 * np.pi * abs(float(angles[0][0]))
        bodies.terms.tensions.setdefault(name, []).append(len(bodies.terms.held))
        bodies.terms.sum(name, [(first, total)], angles=angles, period=period, roots=roots, lengths=1)


def _is_one_size(factors: list[Number]) -> bool:
    """Return whether factors differ by their signs alone, so that whole turns of any make no difference."""
    if any(np.ndim(factor) for factor in factors):
        return False
    sizes = np.abs(np.array(factors, dtype=float))
    return bool(np.all(np.abs(sizes - sizes[0]) <= 1e-12 * sizes[0]))


def lever_of(bodies: Any, length: Affine) -> float:
    """Return the length of a span [m] at which its turn moves a place as bodies do, see `assembly.lifted`."""
    return NEARER * float(np.min(bodies.start_of(length)[0][0]))


def gap_of(bodies: Any, one: RopePlace, other: RopePlace) -> Affine:
    """Return the vector from one place of a rope to the next [m]."""
    way: Affine = bodies.point(bodies.scene, other) - bodies.point(bodies.scene, one)
    return way


def arcs_at_start(rope: Rope, bodies: Any) -> Number:
    """Return the length of a rope with fixed ends that lies on its pulleys at the start [m], of each lane."""
    places = (rope.first, *rope.over, rope.second)
    centres = np.stack(np.broadcast_arrays(*(bodies.start_of(bodies.point(bodies.scene, at))[0] for at in places)))
    radii = [float(np.max(at.signed_radius)) for at in places]
    if not any(radii):
        return 0.0
    along, _ = tangents(np.moveaxis(centres, -1, 0), radii)
    wrapped = wraps(np.moveaxis(along, 0, -1)[None], radii, [guide.turns for guide in rope.over])[0]
    return np.sum(np.abs(np.array(radii[1:-1]))[:, None] * wrapped, axis=0)
