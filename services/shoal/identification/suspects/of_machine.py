"""What a scene states or leaves out of a machine: friction, masses, lengths, pivots, rates at the start, bending."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.errors import InputError
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import Parameter
from shoal.identification.suspects.candidate import Candidate
from shoal.identification.suspects.size import Size, size_of
from shoal.scene import PointMass, RigidBody, Rod, Scene
from shoal.scene.joints import GROUND, Revolute, Slider

_FACTORS = 2.0
_STEP = 1e-3
"""Of the largest value that is looked for: the change by which an effect is measured."""
_SHIFT = 0.2
"""Of the size of the machine, how far off a pivot is looked for."""
_SAG = 1e-2
"""Deflection over length of the rod whose bending is the probe."""
_ELEMENTS = 2


def of_machine(model: ForwardModel) -> Iterator[Candidate]:
    """The candidates of a model's scene."""
    scene = model.scene
    size = size_of(scene)
    yield from _friction(scene, size)
    yield from _masses(scene, size)
    yield from _lengths(scene)
    yield from _pivots(scene, size)
    for name, body in scene.bodies.items():
        if not isinstance(body, PointMass):
            rate, most = scene.start(name).rate, 10.0 * size.rate
            free = Parameter(path=f"initial.{name}.rate", lower=rate - most, upper=rate + most, scale="linear")
            yield Candidate(f"rate of {name} at the start", rate, free, rate + _STEP * size.rate, "machine")
    yield from _bending(scene, size)


def _friction(scene: Scene, size: Size) -> Iterator[Candidate]:
    """Viscous and dry, of each joint that has a place for them."""
    force = size.mass * size.gravity
    for name, joint in scene.joints.items():
        if not isinstance(joint, Revolute | Slider):
            continue
        turning = isinstance(joint, Revolute)
        most = {
            "friction": force * size.length / size.rate if turning else force / (size.rate * size.length),
            "coulomb": 0.5 * force * (size.length if turning else 1.0),
        }
        for field, upper in most.items():
            stated = float(getattr(joint, field))
            free = Parameter(path=f"joints.{name}.{field}", lower=0.0, upper=max(upper, 4 * stated), scale="linear")
            words = "friction" if field == "friction" else "dry friction"
            yield Candidate(f"{words} of {name}", stated, free, stated + _STEP * upper, "machine")


def _masses(scene: Scene, size: Size) -> Iterator[Candidate]:
    """A further mass at each marker, and the mass of each body."""
    seen = set()
    for name, marker in scene.markers.items():
        place = (marker.body, scene.location(marker))
        if place in seen:
            continue
        seen.add(place)
        data = scene.model_dump(mode="json")
        data["bodies"]["further"] = {"kind": "point-mass", "mass": 1e-6 * size.mass}
        data["joints"]["further"] = {"first": data["markers"][name], "second": {"body": "further"}}
        try:
            with_mass = Scene.parse(data)
        except InputError:
            continue
        free = Parameter(path="bodies.further.mass", lower=1e-6 * size.mass, upper=size.mass, scale="linear")
        yield Candidate(f"mass at {name}", 0.0, free, _STEP * size.mass, "machine", with_mass)
    for name, body in scene.bodies.items() if len(scene.bodies) > 1 else ():
        field = "density" if isinstance(body, Rod) else "mass"
        yield _ratio(f"mass of {name}", f"bodies.{name}.{field}", float(getattr(body, field)))
    for name, body in scene.bodies.items():
        if isinstance(body, RigidBody) and body.inertia > 0:
            yield _ratio(f"inertia of {name}", f"bodies.{name}.inertia", body.inertia)
            for axis, where in enumerate(body.centre_of_mass):
                if where:
                    path = f"bodies.{name}.centre_of_mass.{axis}"
                    yield _ratio(f"centre of mass of {name}", path, where)


def _lengths(scene: Scene) -> Iterator[Candidate]:
    for name, body in scene.bodies.items():
        if isinstance(body, Rod):
            yield _ratio(f"length of {name}", f"bodies.{name}.length", body.length)
        elif isinstance(body, RigidBody):
            for point, place in body.named_points.items():
                axis = int(np.argmax(np.abs(place)))
                if place[axis]:
                    words = f"place of {point} on {name}"
                    yield _ratio(words, f"bodies.{name}.named_points.{point}.{axis}", place[axis])


def _ratio(name: str, path: str, stated: float) -> Candidate:
    """A number known to within a factor."""
    lower, upper = sorted((stated / _FACTORS, stated * _FACTORS))
    free = Parameter(path=path, lower=lower, upper=upper, scale="log" if stated > 0 else "linear")
    return Candidate(name, stated, free, stated * (1 + _STEP), "machine", factor=True)


def _pivots(scene: Scene, size: Size) -> Iterator[Candidate]:
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
            path, width = f"joints.{name}.{field}.point.{axis}", _SHIFT * size.length
            free = Parameter(path=path, lower=stated - width, upper=stated + width, scale="linear")
            yield Candidate(f"{'xy'[axis]} of the pivot {name}", stated, free, stated + _STEP * width, "machine")


def _bending(scene: Scene, size: Size) -> Iterator[Candidate]:
    """Rigid rods that bend: Young's modulus, by what it is at a sag of a hundredth of the length."""
    for name, body in scene.bodies.items():
        if not isinstance(body, Rod) or body.element != "rigid":
            continue
        probe = body.mass * size.gravity * body.length**2 / (8 * body.width * body.height**3 / 12 * _SAG)
        free = Parameter(path=f"bodies.{name}.youngs_modulus", lower=probe / 30, upper=probe * 30, scale="log")
        fields = {"youngs_modulus": probe, "element": "ancf-cable", "elements": _ELEMENTS}
        bent = scene.with_values({f"bodies.{name}.{field}": value for field, value in fields.items()})
        yield Candidate(f"bending of {name}", np.inf, free, probe, "machine", bent, inverse=True)
