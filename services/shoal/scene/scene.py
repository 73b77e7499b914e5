"""The scene: everything a user states about a machine, checked as a whole."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Annotated, Any, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, ValidationError, model_validator

from shoal.errors import InputError
from shoal.scene import joints as joint_types
from shoal.scene.actuators import AnyActuator
from shoal.scene.amplitudes import check_amplitudes, check_place
from shoal.scene.bodies import FRAMED, Body, Rod
from shoal.scene.clearances import check_clearances, contacts_of
from shoal.scene.contacts import Contact, check_contacts
from shoal.scene.controllers import Controller, with_controllers
from shoal.scene.dimensions import Dimensions, check_dimensions, padded
from shoal.scene.ended import End
from shoal.scene.expect import Expectation, ExpectedValue
from shoal.scene.function import Function
from shoal.scene.initial import (
    FROM,
    INITIAL,
    POSES,
    RATES,
    Begin,
    InitialState,
    Quantity,
    check_start,
    end_of,
    guessed,
)
from shoal.scene.joints import GROUND, Attachment, Joint, MovingPoint, Universal
from shoal.scene.loads import DistributedForce, Force, Load, Thrust
from shoal.scene.paths import key, parts, shared, unknown, unwrapped, with_lanes
from shoal.scene.record import Record, Vector, one_line
from shoal.scene.sampled import Signal, refuse_apart
from shoal.scene.signals import AnyState, check_coupling, check_signals
from shoal.scene.solids import ModalBody
from shoal.scene.solver import Solver

_FEW = 4
"""So many names are listed."""
_SHAPES = ("length", "curvature", "side_curvature", "twist", "named_points")
"""Fields of a body that place its joints."""
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
SignalName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
"""A name in a formula, where a hyphen is a minus."""


class Scene(Record):
    """A machine in SI units: bodies, joints, loads, markers, initial state, gravity, solver settings.

    What is written of a scene, compared by its fingerprint or made of it by `with_values` is without `expect`.
    Raises pydantic's ValidationError; `Scene.parse` and `with_values` raise `InputError` in one line.
    """

    name: str
    """Name of the scene in tables and files."""
    description: str = ""
    """One line that describes the machine."""
    dimensions: Dimensions = 2
    """2 in the plane, 3 in space."""
    gravity: Vector = (0.0, -9.81)
    """Gravitational acceleration along the axes of the ground [m/s^2]."""
    bodies: Annotated[dict[Name, Body], Field(min_length=1)]
    """Bodies by name."""
    joints: dict[Name, Joint] = {}
    """Joints by name."""
    contacts: dict[Name, Contact] = {}
    """Contacts between bodies by name."""
    loads: dict[Name, Load] = {}
    """Loads by name."""
    signals: dict[SignalName, Signal] = {}
    """Signals by name: formulas of time, measures of the machine and other signals, which loads may follow; or
    samples of these.
    """
    states: dict[SignalName, AnyState] = {}
    """States of controllers, actuators and other dynamics of first order, by name."""
    controllers: Annotated[dict[SignalName, Controller], Field(exclude=True)] = {}
    """Controllers by name; when a scene is read they become signals and states, which it is written with."""
    actuators: Annotated[dict[SignalName, AnyActuator], Field(exclude=True)] = {}
    """Actuators by name; when a scene is read they become signals, states, loads and the armature of joints."""
    ground_points: dict[Name, MovingPoint] = {}
    """Moving points of the ground by name."""
    markers: Annotated[dict[Name, Attachment], Field(min_length=1)]
    """Places whose motion is reported, by name."""
    initial: dict[str, InitialState] = {}
    """Initial state of bodies, by the name of the body. Its key `from` is `initial_from`."""
    initial_from: Literal["statics"] | End | None = None
    """`statics`: start at rest where all forces balance, near the stated angles and positions. Or the end of a run that
    is continued; what `initial` states then defines what joints without a stated length or angle keep.
    """
    solver: Solver = Solver()
    """Settings of the integrator and of the checks of a run."""
    expect: Annotated[dict[Name, Expectation], Field(exclude=True)] = {}
    """Nightly checks of a scene of the library, by name; no part of the machine."""

    @model_validator(mode="before")
    @classmethod
    def _with_controllers(cls, data: Any) -> Any:
        return with_controllers(data) if isinstance(data, dict) else data

    @model_validator(mode="before")
    @classmethod
    def _from_within(cls, data: Any) -> Any:
        if not isinstance(data, dict) or not isinstance(data.get(INITIAL, {}), dict):
            return data
        initial = dict(data.get(INITIAL, {}))
        origin = initial.pop(FROM, data.get("initial_from"))
        if origin is None:
            return {**data, INITIAL: initial}
        if isinstance(origin, End | Mapping):
            # What is stated beside fits the drives as they were then.
            beside = {name: guessed(start, (*POSES, *RATES)) for name, start in initial.items()}
            return {**data, INITIAL: beside, "initial_from": end_of(origin)}
        if origin != "statics":
            raise ValueError(f"initial.from: `statics` or the `end` of a run's JSON, found {str(origin)[:40]!r}")
        # Where the search for the place of rest begins is near it, no more.
        near = {name: guessed(start) for name, start in initial.items()}
        return {**data, INITIAL: near, "initial_from": origin}

    def __repr__(self) -> str:
        parts = [_counted("body", "bodies", self.bodies), _counted("joint", "joints", self.joints)]
        if elements := sum(body.elements for body in self.bodies.values() if body.element != "rigid"):
            parts[0] += f" of {elements} element{'s' * (elements != 1)}"
        parts += [
            _counted("contact", "contacts", self.contacts),
            _counted("load", "loads", self.loads),
            _counted("signal", "signals", self.signals),
            _counted("state", "states", self.states),
            _counted("marker", "markers", self.markers),
        ]
        return f"Scene({self.name}: {'; '.join(part for part in parts if part)})"

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.starts_at_rest:
            for name, start in self.initial.items():
                for quantity in RATES:
                    if np.any(getattr(start, quantity)):
                        raise ValueError(f"initial.{name}.{quantity}: a start from statics is at rest; leave it out")
        if isinstance(self.initial_from, End):
            self.initial_from.check(self.bodies)
        if GROUND in self.bodies:
            raise ValueError("bodies.ground: the name 'ground' is taken by the fixed frame")
        for name, joint in self.joints.items():
            for field, side in joint_types.sides(joint).items():
                self._check_attachment(f"joints.{name}.{field}", side)
            if isinstance(joint, joint_types.Coupling):
                check_coupling(self, name, joint)
            elif not isinstance(joint, joint_types.Rope) and joint.first.body == joint.second.body:
                body = self.bodies.get(joint.first.body)
                if body is None or body.element in FRAMED:
                    raise ValueError(
                        f"joints.{name}: joins {joint.first.body!r} to itself; a joint needs two bodies, or two places "
                        "of a flexible rod"
                    )
        for name, contact in self.contacts.items():
            for field, side in joint_types.sides(contact).items():
                self._check_attachment(f"contacts.{name}.{field}", side)
        for name, load in self.loads.items():
            for field, side in joint_types.sides(load).items():
                self._check_attachment(f"loads.{name}.{field}", side)
            if isinstance(load, Thrust) and getattr(self.joints.get(load.joint), "kind", "") != "slider":
                known = ", ".join(one for one, joint in self.joints.items() if joint.kind == "slider") or "none"
                raise ValueError(f"loads.{name}.joint: {load.joint!r} is not a slider of this scene; there are {known}")
            if isinstance(load, DistributedForce) and getattr(self.bodies.get(load.body), "kind", "") != "rod":
                raise ValueError(f"loads.{name}.body: {load.body!r} is not a rod of this scene")
        for name, marker in self.markers.items():
            if marker.body == GROUND:
                raise ValueError(f"markers.{name}.body: a marker sits on a body, not on the ground")
            self._check_attachment(f"markers.{name}", marker)
        for name, expected in self.expect.items():
            if isinstance(expected, ExpectedValue) and expected.marker not in self.markers:
                known = ", ".join(self.markers)
                raise ValueError(f"expect.{name}.marker: no marker {expected.marker!r}; there are {known}")
        for name in self.initial:
            if name not in self.bodies:
                raise ValueError(f"initial.{name}: no such body; the bodies are {', '.join(self.bodies)}")
            check_amplitudes(name, self.bodies[name], self.initial[name])
        self._check_directions()
        check_dimensions(self)
        check_clearances(self)
        check_contacts(self, contacts_of(self))
        check_signals(self)
        placed = self._placed()
        loose = [name for name in self.bodies if name not in placed]
        if loose:
            raise ValueError(
                f"bodies.{loose[0]}: no chain of joints connects it to the ground; a body that flies free needs "
                f"initial.{loose[0]}.position"
            )
        return self

    def _check_attachment(self, where: str, attachment: Attachment) -> None:
        if attachment.body == GROUND:
            if isinstance(attachment.point, str) and attachment.point not in self.ground_points:
                raise ValueError(
                    f"{where}.point: a place on the ground is given as [x, y] in m or as the name of one of the "
                    f"ground_points, found {attachment.point!r}"
                )
            return
        if attachment.body not in self.bodies:
            known = ", ".join([*self.bodies, GROUND])
            raise ValueError(f"{where}.body: no body {attachment.body!r}; there are {known}")
        body = self.bodies[attachment.body]
        if isinstance(body, ModalBody):
            check_place(where, attachment, body)
            return
        if isinstance(attachment.point, str) and attachment.point not in body.points:
            raise ValueError(
                f"{where}.point: {attachment.body} has no point {attachment.point!r}; "
                f"there are {', '.join(body.points)}"
            )
        if body.element != "rigid" and not isinstance(attachment.point, str):
            x, y = attachment.point[:2]
            if any(attachment.point[2:]) or (y != 0 and body.element != "ancf-full") or not 0 <= x <= body.length:
                raise ValueError(
                    f"{where}.point: [{x:g}, {y:g}] is not on the axis of {attachment.body}; "
                    f"use [s, 0] with 0 <= s <= {body.length:g}"
                )

    def _check_directions(self) -> None:
        """A point mass has no direction: nothing can hold or turn it."""
        points = {name for name, body in self.bodies.items() if body.kind == "point-mass"}
        for name, joint in self.joints.items():
            turned = joint_types.turned(joint)
            for field in (field for field, side in turned.items() if side.body in points):
                raise ValueError(
                    f"joints.{name}.{field}: {turned[field].body} is a point mass, which has no direction that a "
                    f"{joint.kind} joint could hold; use a rigid-body"
                )
        for name, load in self.loads.items():
            if isinstance(load, Force) and load.follows and load.at.body in points:
                raise ValueError(f"loads.{name}.follows: {load.at.body} is a point mass, which does not turn")
        for name in points & self.initial.keys():
            for field in ("angle", "rate"):
                if value := getattr(self.initial[name], field):
                    raise ValueError(
                        f"initial.{name}.{field}: {name} is a point mass, which does not turn; found {value:g}"
                    )

    def _placed(self) -> set[str]:
        """Return the bodies whose position follows from joints to the ground or to a body with a stated position."""
        joined: dict[str, set[str]] = {}
        for joint in self.joints.values():
            bodies = [side.body for side in joint_types.places(joint)]
            for other in bodies[1:]:
                joined.setdefault(bodies[0], set()).add(other)
                joined.setdefault(other, set()).add(bodies[0])
        reached = {GROUND, *(name for name, start in self.initial.items() if start.position is not None)}
        frontier = list(reached)
        while frontier:
            frontier += (new := joined.get(frontier.pop(), set()) - reached)
            reached |= new
        return reached

    @classmethod
    def parse(cls, data: Any, source: str = "scene") -> Scene:
        """Check `data` (as read from YAML or JSON). Raises InputError, one line that names the field."""
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise one_line(error, source, cls) from None

    @property
    def starts_at_rest(self) -> bool:
        """Return whether the start is the place of rest near the one that is stated."""
        return self.initial_from == "statics"

    @property
    def touches(self) -> bool:
        """Return whether it has contacts, stops, ropes, struts or friction that sticks."""
        return bool(self.contacts) or any(joint_types.is_one_sided(joint) for joint in self.joints.values())

    @property
    def flexible_rods(self) -> dict[str, Rod]:
        """The rods that bend, by their names."""
        return {n: body for n, body in self.bodies.items() if isinstance(body, Rod) and body.element != "rigid"}

    def location(self, attachment: Attachment) -> Any:
        """Coordinates [m] of an attachment in its body's (or the ground's) frame, (d,); on a flexible rod (s, y)."""
        if attachment.body == GROUND and isinstance(attachment.point, str):
            return padded((), self.dimensions)
        if isinstance(attachment.point, str):
            return padded(self.bodies[attachment.body].points[attachment.point], self.dimensions)
        return padded(attachment.point, self.dimensions)

    def start(self, body: str) -> Begin:
        """Initial state of `body`; at angle zero and at rest where the scene says nothing."""
        stated = self.initial.get(body, InitialState())
        return Begin(
            0.0 if stated.angle is None else stated.angle,
            0.0 if stated.rate is None else stated.rate,
            None if stated.position is None else padded(stated.position, self.dimensions),
            padded((0.0, 0.0) if stated.velocity is None else stated.velocity, self.dimensions),
            stated.rotation,
            stated.spin,
            stated.modes,
            stated.mode_rates,
        )

    def with_values(self, values: Mapping[str, Any]) -> Scene:
        """This scene with fields replaced, by dotted path (`bodies.OA.length`). Raises InputError.

        What is set last is kept: where a path moves the start or a joint, the other initial values become guesses. A
        drive that begins as the one before moves nothing.
        """
        from_ = f"{INITIAL}_{FROM}"
        values = {from_ if parts(path) == [INITIAL, FROM] else path: unwrapped(value) for path, value in values.items()}
        fresh = [path for path, value in values.items() if not self._has(path, value)]
        refuse_apart(self, fresh)
        check_start(values.get(from_, self.initial_from), fresh)
        turned = [path for path in fresh if self._begins_there(path, values[path])]
        moved = [one for path in fresh for one in _stating(path, values[path])]
        loose = self._guessing(moved, turned)
        data = loose.model_dump(mode="json")
        for path, value in values.items():
            place: Any = data
            *parents, leaf = path.split(".")
            if parents[:1] == [INITIAL] and (started := [*parents, leaf][1]) in self.bodies:
                data[INITIAL].setdefault(started, InitialState().model_dump(mode="json"))
            for depth, part in enumerate(parents):
                if parents[:1] == ["initial"] and part == "velocity" and place.get(part) is None:
                    place[part] = [0.0, 0.0]
                place = place[key(place, part, path, ".".join(parents[:depth]))]
            place[key(place, leaf, path, ".".join(parents))] = value
        for name, body in self.bodies.items():
            said = {"bodies", f"bodies.{name}", f"bodies.{name}.element"} & set(values)
            if "element" not in body.model_fields_set and not said:
                del data["bodies"][name]["element"]  # what was left unsaid stays so
        anew = {path.split(".")[1] for path in values if path.startswith(f"{INITIAL}.") and path.count(".") == 1}
        return Scene.parse(data, self.name)._with_loosened(one for one in loose._loosened if one[0] not in anew)

    def with_lanes(self, values: Mapping[str, npt.NDArray[np.float64]]) -> Scene:
        """This scene with numbers replaced by arrays, one entry per lane (population member).

        Every derived property broadcasts over the lanes. The extremes of each array are what
        `with_values` should have accepted first; `engines` does so. Raises InputError where axes of a universal joint,
        right one by one, are at no right angle together.
        """
        check_start(self.initial_from, values)
        scene = self._guessing(values)
        for path, lanes in values.items():
            scene = with_lanes(scene, path.split("."), np.asarray(lanes, dtype=float))
        for name, joint in scene.joints.items():
            if isinstance(joint, Universal) and joint.oblique:
                raise InputError(f"joints.{name}.second_axis: must be at a right angle to axis in every lane")
        return scene

    def alone(self, paths: Iterable[str]) -> str | None:
        """The first path whose number has to be the same in all lanes, as those in functions of time and matrices."""
        return next((path for path in paths if shared(self, parts(path))), None)

    def bound_together(self, paths: Iterable[str]) -> list[tuple[str, ...]]:
        """Those of some paths of numbers whose limits depend on each other, two or more by body.

        Of a rod its lengths and the places on its axis, of a rigid body its moments of inertia. Where it accepts the
        extremes of all with each other it accepts what lies between.
        """
        groups: dict[str, list[str]] = {}
        for path in paths:
            if (body := self._limiting(path.split("."))) is not None:
                groups.setdefault(body, []).append(path)
        return [tuple(group) for group in groups.values() if len(group) > 1]

    def _limiting(self, path: list[str]) -> str | None:
        """The body whose other numbers limit the one at a path, or are limited by it."""
        if path[0] == "bodies":
            body = self.bodies.get(path[1])
            return path[1] if body is not None and path[2] in getattr(body, "limiting", ()) else None
        if "point" not in path:
            return None
        on = str(self.value(".".join([*path[: path.index("point")], "body"])))
        return on if on in self.bodies and self.bodies[on].element not in FRAMED else None

    def _has(self, path: str, value: Any) -> bool:
        """Return whether the scene states this value there already, or a function that begins like this one."""
        head, *rest = path.split(".")
        if head == "initial" and len(rest) > 1 and getattr(self.initial.get(rest[0]), rest[1], None) is None:
            return False
        try:
            return bool(self.value(path) == value) or self._begins_there(path, value, slope=True)
        except InputError:
            return False

    def _begins_there(self, path: str, value: Any, *, slope: bool = False) -> bool:
        """Return whether a function of time that drives joints has this value at the start already; slope: that as
        well.
        """
        try:
            stated = self.value(path) if _places(path.split(".")) else None
        except InputError:
            return False
        return isinstance(stated, Function) and stated.begins_like(value, slope=slope)

    def _guessing(self, paths: Iterable[str], turned: Iterable[str] = ()) -> Scene:
        """This scene with the initial values that `paths` leave alone as guesses, if a path moves the start.

        turned: those of them that move its rates alone
        """
        split = [path.split(".") for path in paths]
        fresh = {(p[1], p[2]) for p in split if p[0] == "initial" and len(p) > 2}
        rates = {tuple(path.split(".")) for path in turned}
        moved = {quantity for _, quantity in fresh}
        moved |= {RATES[0] if tuple(p) in rates else POSES[0] for p in split if _places(p)}
        loose = (*POSES, *RATES) if moved & {*POSES} else RATES if moved & {*RATES} else ()
        if not loose:
            return self
        initial, loosened = {}, {*self._loosened}
        for name, start in self.initial.items():
            guess = {*start.guess, *(q for q in loose if start.stated(q))} - {q for body, q in fresh if body == name}
            initial[name] = start.model_copy(update={"guess": tuple(q for q in (*POSES, *RATES) if q in guess)})
            loosened |= {(name, q) for q in (*POSES, *RATES) if q in guess and q not in start.guess}
        return self.model_copy(update={"initial": initial})._with_loosened(loosened)

    @cached_property
    def _loosened(self) -> frozenset[tuple[str, Quantity]]:
        """Body and quantity of guesses that were statements before others were set; no field, as it moves nothing."""
        return frozenset()

    def _with_loosened(self, those: Iterable[tuple[str, Quantity]]) -> Self:
        self.__dict__["_loosened"] = frozenset(those)
        return self

    def statements(self, varied: Iterable[str] = ()) -> tuple[tuple[str, Quantity], ...]:
        """Return body and quantity of the values of the start that are stated and are no guesses.

        Values that are guesses only because others were set after them count as stated. varied: paths of values that
        lanes will state.
        """
        split = [path.split(".") for path in varied]
        fresh = [(p[1], q) for p in split if p[0] == INITIAL for q in (*POSES, *RATES) if p[2:3] == [q]]
        found = [(name, q) for name, start in self.initial.items() for q in (*POSES, *RATES) if start.stated(q)]
        guesses = {(name, q) for name, start in self.initial.items() for q in start.guess} - self._loosened
        return tuple(dict.fromkeys(one for one in (*found, *fresh) if one in fresh or one not in guesses))

    def value(self, path: str) -> Any:
        """The field at a dotted path. Raises InputError."""
        place: Any = self
        for depth, part in enumerate(names := path.split(".")):
            if part in self.bodies and place is self.initial:
                place = self.start(part)
            elif isinstance(place, Mapping) and part in place:
                place = place[part]
            elif (isinstance(place, Begin) and part in Begin._fields) or (
                isinstance(place, Record) and part in type(place).model_fields
            ):
                place = getattr(place, part)
            elif isinstance(place, tuple):
                place = place[key(place, part, path, "")]
            else:
                raise unknown(path, ".".join(names[:depth]), place)
        return place

    @property
    def fingerprint(self) -> str:
        """Twelve hexadecimal digits that change when any field does, not with the order of the fields."""
        text = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:12]


def _counted(one: str, many: str, names: Mapping[str, Any]) -> str:
    """Return the number of things, with their names if they are few; empty for none."""
    if not names:
        return ""
    listed = f" {', '.join(names)}" if len(names) <= _FEW else ""
    return f"{len(names)} {one if len(names) == 1 else many}{listed}"


def _stating(path: str, value: Any) -> list[str]:
    """The path of a value; of a body's whole start the paths of what it states and is no guess."""
    if not path.startswith(f"{INITIAL}.") or path.count(".") > 1 or not isinstance(value, Mapping):
        return [path]
    guess = value.get("guess")
    loose = guess if isinstance(guess, list | tuple) else ()
    return [f"{path}.{q}" for q in (*POSES, *RATES) if value.get(q) is not None and q not in loose]


def _places(path: list[str]) -> bool:
    """Return whether a field places joints."""
    shape = path[0] == "bodies" and len(path) > 2 and path[2] in _SHAPES
    return shape or path[0] in ("joints", "ground_points")
