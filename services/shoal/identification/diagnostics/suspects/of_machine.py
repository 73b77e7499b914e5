"""Fault hypotheses about a machine: friction, springs, masses, lengths, pivots, rates, stated or left out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Literal

import numpy as np

from shoal.errors import InputError
from shoal.identification.conventions import DIFFERENCE
from shoal.identification.diagnostics.suspects.candidate import FACTOR, PROBE, FaultHypothesis, Size, size_of
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import Parameter
from shoal.mechanics.start.start import is_direct
from shoal.scene import PointMass, RigidBody, Rod, Scene
from shoal.scene.dimensions import padded
from shoal.scene.joints import GROUND, Attachment, Resisted, Revolute, Slider, places
from shoal.trajectory import Array

RESISTING = {"friction": "friction", "drag": "quadratic drag", "coulomb": "dry friction"}
"""Fields of joints that resist a motion by laws of their own, and what suspects call them."""
_SHIFT = 0.2
"""Of the size of the machine, how far off a pivot is looked for."""
_ABOUT = 0.03
"""Of how far a marker is off: nearer to another named point of its body it is taken to be there."""


def of_machine(model: ForwardModel) -> Iterator[FaultHypothesis]:
    """The candidates of a model's scene."""
    scene = model.scene
    size = size_of(scene)
    yield from _friction(scene, size)
    yield from springs(scene, size)
    yield from _masses(scene, size)
    yield from _lengths(scene)
    yield from _pivots(scene, size)
    yield from _rates(scene, size)
    yield from _markers(model, size)


def _friction(scene: Scene, size: Size) -> Iterator[FaultHypothesis]:
    """By every law, of each joint that has a place for it."""
    for name, joint in scene.joints.items():
        if isinstance(joint, Resisted):
            for field in RESISTING:
                yield resisting(name, joint, field, size)


def resisting(name: str, joint: Resisted, field: str, size: Size) -> FaultHypothesis:
    """Candidate of a joint's resistance by one of RESISTING."""
    turning = isinstance(joint, Revolute)
    force = size.mass * size.gravity * (size.length if turning else 1.0)
    rate = size.rate * (1.0 if turning else size.length)
    upper = {"friction": force / rate, "drag": force / rate**2, "coulomb": 0.5 * force}[field]
    stated, path = float(getattr(joint, field)), f"joints.{name}.{field}"
    bounds = (0.0, max(upper, 4 * stated))
    return FaultHypothesis.single(f"{RESISTING[field]} of {name}", path, stated, bounds, stated + PROBE * upper)


def _masses(scene: Scene, size: Size) -> Iterator[FaultHypothesis]:
    """A further mass at each marker, and the mass of each body."""
    loaded, seen = scene.model_dump(mode="json"), dict[str, str]()
    kind = "spherical" if scene.dimensions == 3 else "revolute"
    for name, marker in scene.markers.items():
        place = str((marker.body, scene.location(marker)))
        if place in seen.values():
            continue
        further, seen[name] = f"further-{name}", place
        loaded["bodies"][further] = {"kind": "point-mass", "mass": DIFFERENCE * size.mass}
        loaded["joints"][further] = {"kind": kind, "first": loaded["markers"][name], "second": {"body": further}}
    with suppress(InputError):
        with_masses = Scene.parse(loaded)
        for name in seen:
            path, bounds = f"bodies.further-{name}.mass", (DIFFERENCE * size.mass, size.mass)
            yield FaultHypothesis.single(f"mass at {name}", path, 0.0, bounds, PROBE * size.mass, scene=with_masses)
    for name, body in scene.bodies.items():
        if len(scene.bodies) == 1 and not (isinstance(body, RigidBody) and np.any(body.inertia)):
            continue  # all forces go with its mass, but for friction, which is a candidate itself
        field = body.mass_field if isinstance(body, Rod) else "mass"
        yield _ratio(f"mass of {name}", f"bodies.{name}.{field}", float(getattr(body, field)))
    for name, body in scene.bodies.items():
        if isinstance(body, RigidBody) and (isinstance(body.inertia, tuple) or body.inertia > 0):
            if not isinstance(body.inertia, tuple):
                yield _ratio(f"inertia of {name}", f"bodies.{name}.inertia", body.inertia)
            for axis, where in enumerate(body.centre_of_mass):
                if where:
                    path = f"bodies.{name}.centre_of_mass.{axis}"
                    yield _ratio(f"{'xyz'[axis]} of the centre of mass of {name}", path, where)


def _lengths(scene: Scene) -> Iterator[FaultHypothesis]:
    for name, body in scene.bodies.items():
        if isinstance(body, Rod):
            yield _ratio(f"length of {name}", f"bodies.{name}.length", body.length)
        elif isinstance(body, RigidBody):
            for point, place in body.named_points.items():
                axis = int(np.argmax(np.abs(place)))
                if place[axis]:
                    words = f"place of {point} on {name}"
                    yield _ratio(words, f"bodies.{name}.named_points.{point}.{axis}", place[axis])


def _ratio(name: str, path: str, stated: float) -> FaultHypothesis:
    """A number known to within a factor."""
    lower, upper = sorted((stated / FACTOR, stated * FACTOR))
    law: Literal["log", "linear"] = "log" if stated > 0 else "linear"
    return FaultHypothesis.single(name, path, stated, (lower, upper), stated * (1 + PROBE), law=law, factor=True)


def _pivots(scene: Scene, size: Size) -> Iterator[FaultHypothesis]:
    """Places on the ground; where there is only one, a shift of it is one of the camera."""
    places = {
        (name, field): side.point
        for name, joint in scene.joints.items()
        if isinstance(joint, Revolute | Slider)
        for field, side in (("first", joint.first), ("second", joint.second))
        if side.body == GROUND and not isinstance(side.point, str)
    }
    for (name, field), place in places.items() if len(places) > 1 else ():
        for axis, stated in enumerate(place):
            words, path = f"{'xyz'[axis]} of the pivot {name}", f"joints.{name}.{field}.point.{axis}"
            yield _near(words, path, stated, _SHIFT * size.length)
    yield from _joints_on_bodies(scene)


def _joints_on_bodies(scene: Scene) -> Iterator[FaultHypothesis]:
    """Places of joints on rigid rods, along the rod."""
    explicit, found = scene.model_dump(mode="json"), list[tuple[str, str, float, float]]()
    for name, joint in scene.joints.items():
        for field in ("first", "second") if isinstance(joint, Revolute) else ():
            side: Attachment = getattr(joint, field)
            body = scene.bodies.get(side.body)
            if not isinstance(body, Rod) or body.element != "rigid":
                continue
            along, *across = scene.location(side)
            explicit["joints"][name][field]["point"] = [along, *across]
            found.append((name, field, along, body.length))
    with suppress(InputError):
        stated = Scene.parse(explicit)
        for name, field, along, length in found:
            words = f"place of {name} on {getattr(scene.joints[name], field).body}"
            yield _near(words, f"joints.{name}.{field}.point.0", along, _SHIFT * length, stated)


def _near(name: str, path: str, stated: float, width: float, scene: Scene | None = None) -> FaultHypothesis:
    """A number known to within a width."""
    bounds = (stated - width, stated + width)
    return FaultHypothesis.single(name, path, stated, bounds, stated + PROBE * width, scene=scene)


def _positions(model: ForwardModel) -> list[str]:
    """Markers of which positions are measured, in the order of the scene."""
    runs = model.measurement.recordings.values()
    seen = {channel.marker for run in runs for channel in run.channels if channel.is_position}
    return [name for name in model.scene.markers if name in seen]


def _markers(model: ForwardModel, size: Size) -> Iterator[FaultHypothesis]:
    """Places on their rigid bodies of markers whose positions are measured."""
    explicit, found = model.scene.model_dump(mode="json"), dict[str, tuple[float, ...]]()
    for name in _positions(model):
        marker = model.scene.markers[name]
        body = model.scene.bodies[marker.body]
        if isinstance(body, RigidBody) or (isinstance(body, Rod) and body.element == "rigid"):
            found[name] = tuple(float(x) for x in model.scene.location(marker))
            explicit["markers"][name]["point"] = list(found[name])
    with suppress(InputError):
        scene = Scene.parse(explicit)
        for name, place in found.items():
            yield _marker(name, place, size.length, scene)


def _marker(name: str, place: tuple[float, ...], width: float, scene: Scene) -> FaultHypothesis:
    """The place of one marker, all of its coordinates."""
    paths = [f"markers.{name}.point.{axis}" for axis in range(len(place))]
    both = zip(paths, place, strict=True)
    numbers = tuple(Parameter(path=path, lower=x - width, upper=x + width, scale="linear") for path, x in both)
    body = scene.markers[name].body
    base, words = np.array([place]), f"place of the marker {name} on {body}"
    points = {point: np.array(padded(at, len(place))) for point, at in scene.bodies[body].points.items()}
    probes = (base + PROBE * width * np.eye(len(place)))[None]

    def describe(values: Array) -> tuple[float, str]:
        there, stated = (", ".join(f"{x:.4g}" for x in one) for one in (values, place))
        off = {point: float(np.linalg.norm(values - at)) for point, at in points.items()}
        nearest = min(off, key=lambda point: off[point])
        known = f", about that of {nearest}," if off[nearest] < _ABOUT * np.linalg.norm(values - place) else ""
        return float(np.linalg.norm(values - place)), f"a value of ({there}) m{known} instead of ({stated}) m"

    return FaultHypothesis(words, "machine", numbers, place, probes, base, scene=scene, describe=describe)


def _rates(scene: Scene, size: Size) -> Iterator[FaultHypothesis]:
    """Rates at the start; in a closed loop of what stands on the ground only, as those of others follow."""
    if scene.dimensions == 3:
        yield from _spins(scene, size)
        return
    direct = is_direct(scene)
    grounded = {side.body for joint in scene.joints.values() if (on := places(joint)) for side in on
                if any(other.body == GROUND for other in on)}  # fmt: skip
    for name, body in scene.bodies.items():
        if isinstance(body, PointMass) or not (direct or name in grounded):
            continue
        rate, most = scene.start(name).rate, 10.0 * size.rate
        words, path, bounds = f"rate of {name} at the start", f"initial.{name}.rate", (rate - most, rate + most)
        yield FaultHypothesis.single(words, path, rate, bounds, rate + PROBE * size.rate, alone=not direct)


def _spins(scene: Scene, size: Size) -> Iterator[FaultHypothesis]:
    """Components of the angular velocities that a scene in space states."""
    for name in scene.bodies:
        for axis, rate in enumerate(scene.start(name).spin or ()):
            words, path, most = f"spin of {name} about {'xyz'[axis]} at the start", f"initial.{name}.spin.{axis}", 10.0
            bounds = (rate - most * size.rate, rate + most * size.rate)
            yield FaultHypothesis.single(words, path, rate, bounds, rate + PROBE * size.rate)


_CONSTANT = 100.0
"""Radians: a spring at rest farther away pulls alike all along a motion."""
_LARGEST = 10.0
"""Times the torque of the machine's weight, for each radian."""


def springs(scene: Scene, size: Size) -> Iterator[FaultHypothesis]:
    """A spring in each hinge that has none: its stiffness, and its torque where both directions are the same."""
    sprung, hinges = scene.model_dump(mode="json"), list[str]()
    held = {
        frozenset({load.first.body, load.second.body}) for load in scene.loads.values() if load.kind == "torsion-spring"
    }
    for name, joint in scene.joints.items():
        bodies = {joint.first.body, joint.second.body} if isinstance(joint, Revolute) else set()
        if bodies and bodies not in held and not any(isinstance(scene.bodies.get(b), PointMass) for b in bodies):
            hinges.append(name)
            sprung["loads"] = {**sprung.get("loads", {}), **_loads(name, sprung["joints"][name])}
    with suppress(InputError):
        with_springs = Scene.parse(sprung)
        for name in hinges:
            yield _candidate(name, size, with_springs)


def _loads(name: str, joint: dict[str, Any]) -> dict[str, Any]:
    """Loads in a hinge: a spring at rest where the directions of its bodies agree, and a constant torque."""
    first, second = joint["first"], joint["second"]
    axis = {"axis": joint["axis"]} if joint.get("axis") is not None else {}
    # On the ground a direction does not depend on the place.
    taken = {} if first["body"] == GROUND else {"reaction": first}
    spring = {"kind": "torsion-spring", "first": first, "second": second, "stiffness": 0.0, "angle": 0.0, **axis}
    return {
        f"further-spring-{name}": spring,
        f"further-torque-{name}": {"kind": "torque", "at": second, "torque": 0.0, **taken, **axis},
    }


def _candidate(name: str, size: Size, scene: Scene) -> FaultHypothesis:
    most = _LARGEST * size.mass * size.gravity * size.length
    numbers = (
        Parameter(path=f"loads.further-spring-{name}.stiffness", lower=0.0, upper=most),
        Parameter(path=f"loads.further-torque-{name}.torque", lower=-np.pi * most, upper=np.pi * most),
    )
    probes = np.array([[[PROBE * most, 0.0], [0.0, PROBE * most]]])

    def describe(values: Array) -> tuple[float, str]:
        stiffness, torque = values.tolist()
        if abs(torque) >= _CONSTANT * stiffness:  # none at all is one too
            return torque, f"a constant torque of {torque:.3g} N m"
        return stiffness, f"a stiffness of {stiffness:.3g} N m/rad, at rest at {torque / stiffness:.3g} rad"

    words = f"torsion spring in {name}"
    return FaultHypothesis(
        words, "machine", numbers, (0.0, 0.0), probes, np.zeros((1, 2)), scene=scene, describe=describe
    )
