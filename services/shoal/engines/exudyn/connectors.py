"""Springs, dampers and friction inside Exudyn: one law over a distance, an angle or the way along a line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from shoal.engines.exudyn import user
from shoal.engines.exudyn.bodies import System
from shoal.engines.exudyn.chain import cross
from shoal.engines.exudyn.ends import SystemAttachments
from shoal.mechanics.fitting import fit_law
from shoal.scene import Attachment, Function, Resisted
from shoal.trajectory import Array


class Exchange(NamedTuple):
    """Energy balance of a force element, from times [s] (rows,), q and v (rows, unknowns).

    lost: power it takes out of the machine [W], negative where it feeds it, (rows,); stored: energy [J], (rows,).
    crossed: the share of the narrowest part of its law that each step crosses, (rows - 1,); from q and v.
    """

    lost: Callable[[Array, Array, Array], Array]
    stored: Callable[[Array, Array, Array], Array] | None = None
    crossed: Callable[[Array, Array], Array] | None = None


@dataclass(frozen=True)
class ForceLaw:
    """Force [N or N m] of an elongation x [m or rad] and its rate.

    It is k x + k3 x^3 + table(x) + c x' + c2 |x'| x' + F tanh(x'/v).
    """

    stiffness: float = 0.0
    cubic: float = 0.0
    damping: float = 0.0
    drag: float = 0.0
    coulomb: float = 0.0
    speed: float = 1.0
    elastic: Function | None = None

    @classmethod
    def of(cls, joint: Resisted) -> ForceLaw:
        """With which a joint resists its rate."""
        return cls(damping=joint.friction, drag=joint.drag, coulomb=joint.coulomb, speed=joint.coulomb_speed)

    @property
    def linear(self) -> bool:
        """Return whether Exudyn's own linear law is enough; it takes no negative stiffness."""
        return self.stiffness >= 0 and not (self.cubic or self.drag or self.coulomb or self.elastic)

    def stored(self, x: Array) -> Array:
        """Energy [J] of the polynomial part."""
        return self.stiffness / 2 * x**2 + self.cubic / 4 * x**4

    def resisting(self, x: Array, rate: Array) -> Array:
        """The rest of the force, whose work is followed along the way."""
        return np.asarray(user.law_resisting(self.numbers, self.elastic, x, rate))

    @property
    def numbers(self) -> dict[str, float]:
        """The law without its function, by name."""
        return {key: value for key, value in vars(self).items() if key != "elastic"}

    def options(self, system: System, keyword: str) -> dict[str, Any]:
        """Return the options of Exudyn's connectors; keyword: their name for a force in Python."""
        options: dict[str, Any] = {"stiffness": max(self.stiffness, 0.0), "damping": self.damping}
        if not self.linear:
            make = user.spring_torque if keyword == "springTorqueUserFunction" else user.spring_force
            options[keyword] = system.function(make, self.numbers, self.elastic)
        return options


def add_spring(
    ends: SystemAttachments, first: Attachment, second: Attachment, law: ForceLaw, length: float | None
) -> Exchange:
    """Enter a law over the distance of two places; length: where x is 0 [m], else that of the start."""

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        a, b = ends.motion(first, q, v), ends.motion(second, q, v)
        apart = b.position - a.position
        distance = np.linalg.norm(apart, axis=1)
        return distance, np.sum(apart * (b.velocity - a.velocity), axis=1) / np.maximum(distance, 1e-300)

    rest = ends.start_distance(first, second) if length is None else length
    ends.system.add(
        "ObjectConnectorSpringDamper",
        markerNumbers=[ends.hold(first), ends.hold(second)],
        referenceLength=rest,
        **law.options(ends.system, "springForceUserFunction"),
    )
    return exchange_of(law, lambda q, v: (measure(q, v)[0] - rest, measure(q, v)[1]))


def add_torsion(
    ends: SystemAttachments, first: Attachment, second: Attachment, law: ForceLaw, angle: float | None
) -> Exchange:
    """Enter a law over the angle between two bodies; angle: where x is 0 [rad], else that of the start."""
    start = ends.start_turn(first, second)
    rest = start if angle is None else angle
    system, options = ends.system, law.options(ends.system, "springTorqueUserFunction")
    if law.stiffness or law.cubic or law.elastic:
        # A data coordinate lets Exudyn count full turns.
        options |= {
            "markerNumbers": ends.level(first, second, start),
            "nodeNumber": system.add("NodeGenericData", initialCoordinates=[0.0], numberOfDataCoordinates=1),
            "offset": rest - start,
        }
    else:
        options["markerNumbers"] = [ends.turn(first), ends.turn(second)]
    system.add("ObjectConnectorTorsionalSpringDamper", **options)

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        a, b = ends.motion(first, q, v), ends.motion(second, q, v)
        angle = np.unwrap(np.concatenate([[start], b.direction - a.direction]))[1:]
        return angle - rest, b.rate - a.rate

    return exchange_of(law, measure)


def add_rail(
    ends: SystemAttachments, first: Attachment, second: Attachment, direction: float, law: ForceLaw
) -> Exchange:
    """Enter a law over the way along a line of the first body; direction: its angle [rad] in that body."""
    ends.system.add(
        "ObjectConnectorLinearSpringDamper",
        markerNumbers=[ends.turn(first), ends.turn(second)],
        axisMarker0=[np.cos(direction), np.sin(direction), 0.0],
        **law.options(ends.system, "springForceUserFunction"),
    )

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        a, b = ends.motion(first, q, v), ends.motion(second, q, v)
        line = np.stack([np.cos(a.direction + direction), np.sin(a.direction + direction)], axis=1)
        apart = b.position - a.position
        speed = np.sum(line * (b.velocity - a.velocity), axis=1) + a.rate * cross(line, apart)
        return np.sum(line * apart, axis=1), speed

    return exchange_of(law, measure)


def exchange_of(law: ForceLaw, measure: Callable[[Array, Array], tuple[Array, Array]]) -> Exchange:
    """Return the energy balance of a law; measure: its argument [m or rad] and the rate of that, from q and v."""

    def lost(t: Array, q: Array, v: Array) -> Array:
        x, rate = measure(q, v)
        return law.resisting(x, rate) * rate

    places = np.zeros(0) if law.elastic is None else fit_law(law.elastic).kinks
    crossed = (lambda q, v: _crossed(places, measure(q, v)[0])) if places.size > 1 else None
    return Exchange(lost, lambda t, q, v: law.stored(measure(q, v)[0]), crossed)


def _crossed(places: Array, x: Array) -> Array:
    """Lengths of the steps of x, each as a fraction of the narrowest interval between places that it touches."""
    low, high = np.minimum(x[1:], x[:-1]), np.maximum(x[1:], x[:-1])
    first, last = (np.searchsorted(places, edge, side="right") for edge in (low, high))
    widths = np.concatenate([[np.inf], np.diff(places), [np.inf]])
    narrowest = np.array([widths[a : b + 1].min() for a, b in zip(first, last, strict=True)])
    return np.asarray((high - low) / narrowest)
