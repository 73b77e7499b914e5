"""Points of a scene that make its bodies visible: points along rods, the joints of other bodies, fixed ground."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.scene import GROUND, Attachment, RigidBody, Rod, Scene
from shoal.scene.loads import Spring
from shoal.trajectory import Array

_ALONG = 33
"""Points along a rod, so that its bending shows."""
INSIDE = "outline"
"""How the names of added markers begin."""


def outlined(scene: Scene) -> tuple[Scene, dict[str, list[str]]]:
    """The scene with markers along its bodies, and their names by body."""
    data = scene.model_dump(mode="json")
    names: dict[str, list[str]] = {}
    for name, body in scene.bodies.items():
        # A body that is no rod is drawn as the line through the places that it is joined and observed at.
        places = _along(body) if isinstance(body, Rod) else joined_places(scene, name)
        if scene.dimensions == 3 and isinstance(body, RigidBody):
            # Of the lines in space each goes through the centre of mass, where its cuboid is.
            places = [place for joined in places for place in (list(body.centre_of_mass), joined)]
        names[name] = [f"{INSIDE}-{name}-{k}" for k in range(len(places))]
        data["markers"] |= {n: {"body": name, "point": p} for n, p in zip(names[name], places, strict=True)}
    return Scene.parse(data, scene.name), {body: found for body, found in names.items() if found}


def ground(scene: Scene) -> Array:
    """The places [m] where the machine is joined to what stands still, (places, d)."""
    still = (at for at in _sides(scene) if at.body == GROUND and not isinstance(at.point, str))
    return np.array(list(dict.fromkeys(scene.location(at) for at in still))).reshape(-1, scene.dimensions)


def _sides(scene: Scene) -> list[Attachment]:
    sides = (getattr(joint, side, None) for joint in scene.joints.values() for side in ("first", "second"))
    return [side for side in sides if isinstance(side, Attachment)]


def joined_places(scene: Scene, body: str) -> list[Any]:
    """Return the places in its frame that a body is joined, sprung and observed at [m], else its origin."""
    springs = (load for load in scene.loads.values() if isinstance(load, Spring))
    used = [*_sides(scene), *scene.markers.values(), *(side for load in springs for side in (load.first, load.second))]
    places = [scene.location(at) for at in used if at.body == body]
    return [list(place) for place in dict.fromkeys(places or [(0.0, 0.0)])]


def _along(rod: Rod) -> list[Any]:
    """Places along a rod, as a marker names them."""
    if rod.element != "rigid":
        return [[float(s), 0.0] for s in np.linspace(0.0, rod.length, _ALONG)]
    if not rod.curvature:
        return ["start", "end"]
    axis = [rod.axis(s) for s in np.linspace(0.0, rod.length, _ALONG)]
    return [[float(place.real), float(place.imag)] for place in axis]
