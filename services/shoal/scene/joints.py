"""Joints."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BeforeValidator, Field, model_validator

from shoal.errors import InputError
from shoal.scene.attachments import GROUND as GROUND
from shoal.scene.attachments import Attachment as Attachment
from shoal.scene.attachments import Direction as Direction
from shoal.scene.attachments import DirectionTie as DirectionTie
from shoal.scene.attachments import MovingPoint as MovingPoint
from shoal.scene.attachments import Tie as Tie
from shoal.scene.attachments import Z as Z
from shoal.scene.contact_law import ContactLaw
from shoal.scene.formula import Measure, tree
from shoal.scene.function import Function
from shoal.scene.record import Angle, Axis, NonNegative, Positive, Record, Vector3, kinds
from shoal.scene.ropes import Rope as Rope

Array = npt.NDArray[np.float64]


class Stops(Record):
    """Limits of the free motion of a joint, which it strikes and rests against."""

    min: float | None = None
    """Smallest angle of the second body against the first [rad; of a slider place on its line, m]."""
    max: float | None = None
    """Largest angle [rad; of a slider place, m]."""
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Rate after an impact over that before [1]: 0 of a stop that takes all, 1 of one that loses nothing."""

    @model_validator(mode="after")
    def _apart(self) -> Stops:
        if self.min is None and self.max is None:
            raise ValueError("min or max is missing")
        if self.min is not None and self.max is not None and np.any(self.min >= self.max):
            raise ValueError(f"min: must be below max, found {self.min:.6g} and {self.max:.6g}")
        return self


class Clearance(Tie):
    """A joint that may have play: its surfaces strike, slide, stick and separate as those of a contact do."""

    play: Positive | None = None
    """Clearance to each side where the joint is centred [m]; by default it has none."""
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Of a joint with play: normal rate after an impact over that before [1]."""
    tangential_restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Of a joint with play: slip rate after an impact that lets the surfaces stick over that before, reversed [1]."""
    mu_static: NonNegative | None = None
    """Of a joint with play: coefficient of the limit of stick [1]; by default `mu`."""
    law: ContactLaw | None = None
    """Of a joint with play: force of surfaces that give way, in place of rigid ones with a restitution."""

    @model_validator(mode="after")
    def _of_play(self) -> Clearance:
        stated = {name: getattr(self, name) for name in Clearance.model_fields if name not in Tie.model_fields}
        if stated.pop("play") is None:
            for name, value in stated.items():
                if value is not None and np.any(value):
                    raise ValueError(f"{name}: is of a joint with play; state `play` as well, or leave it out")
        elif self.law is not None and (np.any(self.restitution) or np.any(self.tangential_restitution)):
            raise ValueError("restitution: is of rigid surfaces; state that of the law")
        return self


class Resisted(Tie):
    """A joint with one free motion that resists its rate: a rotation [rad/s] or a displacement [m/s]."""

    friction: NonNegative = 0.0
    """Viscous friction [N m s/rad; of a slider N s/m]."""
    drag: NonNegative = 0.0
    """Quadratic drag, as of air [N m s^2/rad^2; of a slider N s^2/m^2]."""
    coulomb: NonNegative = 0.0
    """Dry friction [N m; of a slider N], smoothed as tanh(rate / coulomb_speed)."""
    coulomb_speed: Positive = 1e-2
    """Rate that smooths dry friction [rad/s; of a slider m/s]."""
    stick: Literal["smooth", "exact"] = "smooth"
    """Whether dry friction is smoothed, so that what should stick creeps, or sticks and slips by Coulomb's law."""
    mu: NonNegative = 0.0
    """Coefficient of dry friction by the joint's force [1], smoothed or exact as `stick` says."""
    stops: Stops | None = None
    """Limits of its free motion."""
    armature: NonNegative = 0.0
    """Inertia of a rotor that the free motion turns, N^2 J behind a gear of the ratio N [kg m^2; of a slider kg]."""

    @model_validator(mode="after")
    def _of_one_law(self) -> Resisted:
        if self.stick == "exact":
            # A default that is stated as well is no contradiction: scenes are written with all of their fields.
            if np.any(self.coulomb_speed != type(self).model_fields["coulomb_speed"].default):
                raise ValueError("coulomb_speed: smooths friction, and stick: exact does not; leave one of them out")
            if not {"coulomb", "mu"} & self.model_fields_set:
                raise ValueError("stick: exact is of dry friction; state `coulomb` or `mu`")
        return self

    @property
    def share(self) -> float:
        """Dry friction by mu per force of the joint [m or 1]."""
        return self.mu

    @property
    def dry(self) -> bool:
        """Return whether it has dry friction of either kind."""
        return bool(self.coulomb or self.share)

    @property
    def resists(self) -> bool:
        """Return whether it does, in any way."""
        return any(np.any(size) for size in (self.friction, self.drag, self.coulomb, self.share))

    def resistance(self, rate: Array, force: Array | float = 0.0) -> Array:
        """Torque [N m] or force [N] against a rate, where the force of the joint [N] is so large.

        Without dry friction that sticks exactly, which is a contact's.
        """
        dry = 0.0 if self.stick == "exact" else self.coulomb + self.share * force
        smoothed = dry * np.tanh(rate / self.coulomb_speed)
        return np.asarray((self.friction + self.drag * np.abs(rate)) * rate + smoothed)


class Revolute(Resisted, Clearance):
    """Two places stay together; the bodies turn freely but for friction.

    With play the first body has a pin, the second a hole that is wider by it; friction by mu is not smoothed.
    """

    kind: Literal["revolute"] = "revolute"
    turned: ClassVar[tuple[str, ...]] = ()
    radius: Positive | None = None
    """Radius of the pin at which friction by `mu` acts [m]: its torque is mu * radius times the force of the joint."""
    axis: Axis = Z
    """Axis of rotation in space, as it points at the start [1]."""

    @model_validator(mode="after")
    def _pin_is_defined(self) -> Revolute:
        if np.any(self.mu) and self.radius is None:
            raise ValueError("radius is missing; friction by mu acts at the radius of the pin (m)")
        return self

    @property
    def share(self) -> float:
        """Torque of the smoothed friction by mu per force of the joint [m]."""
        return self.mu * self.radius if self.radius is not None and self.play is None else 0.0


class Spherical(Clearance):
    """Two places stay together; the bodies turn freely about any axis. In space only.

    With play the first body has a ball, the second a socket that is wider by it.
    """

    kind: Literal["spherical"] = "spherical"
    turned: ClassVar[tuple[str, ...]] = ()
    radius: Positive | None = None
    """Radius of the ball of a joint with play, at which friction acts [m]."""
    mu: NonNegative = 0.0
    """Of a joint with play: coefficient of friction by Coulomb's law [1]."""

    @model_validator(mode="after")
    def _ball_is_defined(self) -> Spherical:
        if np.any(self.mu) and (self.radius is None or self.play is None):
            raise ValueError("mu: is of a ball with play; state `radius` and `play` as well, or leave it out")
        return self


class Universal(Tie):
    """Two places stay together, and an axis of the first body stays at a right angle to one of the second.

    In space only.
    """

    kind: Literal["universal"] = "universal"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")
    axis: Axis
    """Axis of the first body, as it points at the start [1]."""
    second_axis: Axis
    """Axis of the second body, as it points at the start [1]."""

    @property
    def oblique(self) -> bool:
        """Return whether the axes are at no right angle, in any lane."""
        first, second = np.stack(np.broadcast_arrays(*self.axis, *self.second_axis)).reshape(2, 3, -1)
        lengths = np.linalg.norm(first, axis=0) * np.linalg.norm(second, axis=0)
        return bool(np.any(np.abs(np.sum(first * second, axis=0)) > 1e-6 * lengths))

    @model_validator(mode="after")
    def _square(self) -> Universal:
        if self.oblique:
            raise ValueError("second_axis: must be at a right angle to axis")
        return self


class Cylindrical(Tie):
    """The second place moves on a line through the first, about which the bodies turn. In space only."""

    kind: Literal["cylindrical"] = "cylindrical"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")
    axis: Axis
    """Direction of the line, as it points at the start [1]."""


class Planar(Tie):
    """The second place moves in a plane through the first, fixed to the first body. In space only."""

    kind: Literal["planar"] = "planar"
    turned: ClassVar[tuple[str, ...]] = ("first",)
    axis: Axis
    """Normal of the plane, as it points at the start [1]."""
    rotation: Literal["axis", "free", "locked"] = "axis"
    """Rotation of the second body: about the normal (`axis`), free (a point in a plane) or locked."""


class Weld(Tie):
    """Two places stay together and the bodies keep their relative angle."""

    kind: Literal["weld"] = "weld"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")
    angle: Angle | None = None
    """Relative angle [rad]; by default that of the start."""


class Slider(Resisted, Clearance):
    """The second place moves on a line through the first one, fixed to the first body.

    Friction by mu is in proportion to the force across the line. With play a box about the second place, its length
    along the x axis of the second body, is between two lines of the first body; friction by mu is not smoothed.
    """

    kind: Literal["slider"] = "slider"
    turned: ClassVar[tuple[str, ...]] = ("first",)
    direction: Angle = 0.0
    """Angle of the line in the first body's frame [rad]."""
    axis: Axis | None = None
    """Direction of the line in space, as it points at the start, in place of `direction` [1]."""
    rotation: Literal["free", "locked"] = "free"
    """Whether the second body may turn against the first."""
    size: tuple[Positive, Positive] | None = None
    """Of a slider with play: length and height of its box [m]."""

    @property
    def share(self) -> float:
        """Smoothed friction by mu per force of the joint [1]."""
        return self.mu if self.play is None else 0.0

    @model_validator(mode="after")
    def _has_a_box(self) -> Slider:
        if (self.play is None) != (self.size is None):
            raise ValueError(f"{'play' if self.play is None else 'size'} is missing; a guide with play needs both")
        if self.play is not None and self.rotation == "locked":
            raise ValueError("rotation: locked leaves no turn, which play does; leave one of them out")
        return self


class Distance(Tie):
    """Two places keep a distance, or stay within it as with a rope, or beyond it as with a strut that pushes only."""

    kind: Literal["distance"] = "distance"
    turned: ClassVar[tuple[str, ...]] = ()
    length: Function | None = None
    """Distance [m] as a function of time; by default that of the start."""
    keeps: Literal["exactly", "at-most", "at-least"] = "exactly"
    """Whether the length is that of a bar, the largest (a rope), or the smallest (a strut)."""
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Rate after a rope is taut, or a strut touches, over that before [1]."""

    @model_validator(mode="after")
    def _one_sided(self) -> Distance:
        if self.keeps == "exactly" and np.any(self.restitution):
            raise ValueError("restitution: a bar has none; only what keeps at-most or at-least")
        if self.keeps != "exactly" and self.length is not None and self.length.number is None:
            raise ValueError(f"length: of what keeps {self.keeps} it is a number, not a function of time")
        return self


class Parallel(DirectionTie):
    """The directions of two bodies stay parallel."""

    kind: Literal["parallel"] = "parallel"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")


class Perpendicular(DirectionTie):
    """The directions of two bodies stay perpendicular."""

    kind: Literal["perpendicular"] = "perpendicular"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")


class DrivenAngle(DirectionTie):
    """The angle from the first body's direction to the second's is a function of time."""

    kind: Literal["driven-angle"] = "driven-angle"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")
    angle: Function
    """Angle [rad] as a function of time."""
    axis: Axis = Z
    """Axis of the angle in space, as it points at the start, common to both bodies [1]."""


MOST_TEETH = 1000


def _same_direction(one: Vector3, other: Vector3) -> bool:
    sizes = math.hypot(*one) * math.hypot(*other)
    return sum(a * b for a, b in zip(one, other, strict=True)) >= (1.0 - 1e-12) * sizes


def _fraction(value: Any) -> Any:
    """A ratio as a user may write it: a number, or two whole ones with a slash."""
    if isinstance(value, str):
        try:
            return float(Fraction(value.replace(" ", "")))
        except (ValueError, ZeroDivisionError):
            raise ValueError(f"a ratio is a number, or two whole ones as '-20/31', found {value[:40]!r}") from None
    return value


class Slack(Record):
    """A sum that a joint keeps, or that may vary by its backlash and strikes both ends of that."""

    backlash: Positive | None = None
    """Range in which the sum is free about its value at the start [rad; of a coupling m]; by default it has none."""
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Of a joint with backlash: rate of the sum after an impact over that before [1]."""

    @model_validator(mode="after")
    def _of_backlash(self) -> Slack:
        if self.backlash is None and np.any(self.restitution):
            raise ValueError("restitution: is of a joint with backlash; state `backlash` as well, or leave it out")
        return self


class Gear(DirectionTie, Slack):
    """Gears, a belt or a chain: the second body turns `ratio` times as fast as the first, as seen from a carrier.

    Both axes keep their direction; where they differ, as those of bevel and worm gears, the ground carries them. Its
    backlash [rad] is the angle by which the second body can turn while the others rest.
    """

    kind: Literal["gear"] = "gear"
    turned: ClassVar[tuple[str, ...]] = ("first", "second", "carrier")
    ratio: Annotated[float, BeforeValidator(_fraction)]
    """Speed of the second body over that of the first [1]: negative for gears that mesh outside, positive for belts,
    chains and ring gears; a fraction of whole numbers up to 1000, which may be text such as '-20/31'.
    """
    carrier: Direction = Attachment(body=GROUND, point=(0.0, 0.0))
    """The body that carries both bearings."""
    axis: Axis = Z
    """Axis of the first body in space, as it points at the start [1]."""
    second_axis: Axis | None = None
    """Axis of the second body in space [1]; by default that of the first."""

    @property
    def axes(self) -> tuple[Vector3, Vector3]:
        """Return the axis on the first body, and on the second."""
        return self.axis, self.second_axis or self.axis

    @model_validator(mode="after")
    def _one_axis_or_the_ground(self) -> Gear:
        if self.carrier.body != GROUND and not _same_direction(*self.axes):
            raise ValueError("carrier: gears whose axes differ are carried by the ground")
        return self

    @model_validator(mode="after")
    def _of_whole_numbers(self) -> Gear:
        if not isinstance(self.ratio, float):
            return self
        near = self.fraction
        if not self.ratio or abs(near.numerator) > MOST_TEETH or abs(near - self.ratio) > 1e-9 * abs(self.ratio):
            raise ValueError(
                f"ratio: must be a fraction of whole numbers up to {MOST_TEETH}, found {self.ratio:.12g}; write it as "
                "'-20/31'"
            )
        return self

    @property
    def fraction(self) -> Fraction:
        """The ratio as teeth of the first over those of the second."""
        return Fraction(self.ratio).limit_denominator(MOST_TEETH)


COUPLED = ("angle", "slide", "distance", "position")
"""Measures that a coupling may count."""


class CoupledMeasure(Record):
    """A measure of the machine, or a coordinate of a place, with its factor in a coupling."""

    of: str | None = None
    """The measure: `angle(JOINT)` or `angle(BODY)` [rad], `slide(JOINT)`, `distance(P, Q)` or `position(P, x)` [m]."""
    at: Attachment | None = None
    """In place of a measure, a place whose coordinate counts."""
    axis: Literal["x", "y", "z"] | None = None
    """The coordinate."""
    factor: float = 1.0
    """Its factor [1; of an angle beside lengths m/rad]."""

    @property
    def measure(self) -> Measure | None:
        """Return the measure; None of a coordinate of a place."""
        return None if self.of is None else measure_of(self.of)

    @model_validator(mode="after")
    def _one_measure(self) -> CoupledMeasure:
        if (self.of is None) == (self.at is None) or (self.at is None) != (self.axis is None):
            raise ValueError("a term is `of` a measure, or `at` a place along an `axis`")
        if self.of is not None:
            measure_of(self.of)
        return self


def measure_of(text: str) -> Measure:
    """Return the measure that a text names. Raises ValueError."""
    try:
        found = tree(text)
    except InputError as error:
        raise ValueError(f"of: {error}") from None
    if not isinstance(found, Measure) or found.kind not in COUPLED:
        raise ValueError(f"of: one of angle, slide, distance and position of a machine, found {text[:60]!r}")
    return found


class Coupling(Slack):
    """The sum of factor * measure is a function of time, or what it is at the start: racks, screws, differentials.

    Angles count all turns. With backlash it is free about its value at the start.
    """

    kind: Literal["coupling"] = "coupling"
    turned: ClassVar[tuple[str, ...]] = ()
    terms: Annotated[tuple[CoupledMeasure, ...], Field(min_length=1)]
    """Measures with their factors."""
    value: Function | None = None
    """The sum [m or rad] as a function of time; by default 0 of coordinates of places, else that of the start."""

    @property
    def sum(self) -> Function | None:
        """Return the sum as a function of time; None where it is that of the start."""
        if self.value is None and all(term.of is None for term in self.terms):
            return Function(number=0.0)
        return self.value

    @model_validator(mode="after")
    def _slack_about_start(self) -> Coupling:
        if self.backlash is not None and self.value is not None and self.value.number != 0.0:
            raise ValueError("value: with backlash the sum is free about its value at the start; leave one of them out")
        return self


def _revolute_if_unsaid(data: Any) -> Any:
    return {"kind": "revolute", **data} if isinstance(data, dict) else data


Joint = Annotated[
    Annotated[
        Revolute
        | Spherical
        | Universal
        | Cylindrical
        | Planar
        | Weld
        | Slider
        | Distance
        | Parallel
        | Perpendicular
        | Rope
        | DrivenAngle
        | Gear
        | Coupling,
        Field(discriminator="kind"),
    ],
    BeforeValidator(_revolute_if_unsaid),
]
"""A joint without a kind is a revolute one."""
JOINT_KINDS = kinds(Joint)


def is_loose(joint: Any) -> bool:
    """Return whether a joint has play or backlash, so that contacts hold it in place of equations."""
    return getattr(joint, "play", None) is not None or getattr(joint, "backlash", None) is not None


def tightened(joint: Any) -> Any:
    """Return a joint without its play or backlash."""
    without = {"play": None, "size": None, "backlash": None}
    return joint.model_copy(update={name: value for name, value in without.items() if name in type(joint).model_fields})


def sides(record: Record) -> dict[str, Attachment]:
    """The attachments of a joint or a load, by the path of their field."""
    found = {}
    for field, value in record:
        if isinstance(value, Attachment):
            found[field] = value
        for number, part in enumerate(value if isinstance(value, tuple) else ()):
            if isinstance(part, Attachment):
                found[f"{field}.{number}"] = part
            elif isinstance(part, Record):
                found |= {f"{field}.{number}.{inner}": at for inner, at in sides(part).items()}
    return found


def places(joint: Joint) -> tuple[Attachment, ...]:
    """The attachments of a joint."""
    return tuple(sides(joint).values())


def turned(joint: Joint) -> dict[str, Attachment]:
    """The attachments of whose bodies' directions a joint speaks, by the path of their field."""
    if isinstance(joint, Weld) and joint.angle is None:
        return {}
    if isinstance(joint, Rope):
        return dict(joint.drums())
    return {side: getattr(joint, side) for side in joint.turned}


def is_one_sided(joint: Any) -> bool:
    """Return whether a joint has stops, play or backlash, is a rope or a strut, or has dry friction that sticks."""
    if isinstance(joint, Distance | Rope):
        return joint.keeps != "exactly"
    limits = any(getattr(joint, field, None) is not None for field in ("stops", "play", "backlash"))
    return limits or getattr(joint, "stick", "smooth") == "exact"
