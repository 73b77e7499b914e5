"""Bodies in space that may spin about their own axes: a motion that changes no place, and with it no equilibrium.

A director rod on two balls, as Euler's column, has one, and so has a bar of a truss. It is no reason to say that
nothing holds the machine, so a search for an equilibrium leaves such spins out, and checks in the end that no force
would turn them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, points
from shoal.mechanics.analysis.balance import Balance
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, PointMass, Rod, Scene
from shoal.scene.record import Record

UNSEEN = 1e-6
"""A motion whose places and slopes are this part of its directors is a spin."""
ON_LINE = 1e-9
"""Places whose distance from a line is this part of the machine's size lie on it."""


def idle_spins(balance: Balance, placement: Placement, q: Array) -> tuple[Array, list[str]]:
    """Free motions at q of directors alone that the unloaded machine has no stiffness against, and what spins.

    The motions z have z' M z = 1 and are given as rows z' M, (spins, unknowns).
    """
    none = np.zeros((0, len(q)))
    scene = placement.scene
    axes = {} if balance.evaluator.follows else dict(_axes(scene, placement, balance.size))
    directors = dict(_directors(placement, axes))
    if scene.dimensions == plane.DIMENSIONS or not directors:
        return none, []
    view = balance.look(q, 0.0)
    if balance.is_firm(q, view, 0.0):
        return none, []
    found = balance.spectrum(q, view, 0.0)
    free = found.shapes[:, np.abs(found.values) <= found.levels]
    if not free.size:
        return none, []
    seen = points(list(_seen(placement, axes, balance.size)), len(q)).rows @ free
    _, sizes, ways = np.linalg.svd(seen, full_matrices=len(seen) < free.shape[1])
    spins = free @ ways[int(np.sum(sizes > UNSEEN * np.max(np.abs(free)))) :].T
    turning = {name: points(own, len(q)).rows @ spins for name, own in directors.items()}
    names = [name for name, own in turning.items() if np.max(np.abs(own), initial=0.0) > UNSEEN]
    return (balance.evaluator.mass @ spins).T, names


def _axes(scene: Scene, placement: Placement, size: float) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """Rigid bodies whose joints, loads, markers and centre lie on one line, and its ends in the body's frame [m]."""
    told = [at for part in (scene.joints, scene.loads, scene.markers) for at in _attachments(part)]
    for name, body in scene.bodies.items():
        frame = placement.frames[name]
        if not isinstance(frame, RigidFrame) or isinstance(body, PointMass):
            continue
        on = [Attachment(body=name, point=point) for point in (body.points if isinstance(body, Rod) else ())]
        on += [Attachment(body=name, point=tuple(np.ravel(body.centre_of_mass).tolist()))]
        places = np.array([scene.location(at) for at in (*on, *told) if at.body == name], dtype=float)
        _, sizes, ways = np.linalg.svd(places - places[0])
        across = float(np.max(sizes[1:], initial=0.0))
        # A marker tells the angle of its body's x axis as well.
        shown = any(at.body == name for at in scene.markers.values()) and np.linalg.norm(ways[0, 1:]) > ON_LINE
        if across <= ON_LINE * size < sizes[0] and not shown:
            along = places @ ways[0]
            yield name, (places[int(np.argmin(along))], places[int(np.argmax(along))])


def _attachments(part: Any) -> Iterator[Attachment]:
    """All in a part of a scene."""
    if isinstance(part, Attachment):
        yield part
    elif isinstance(part, Record):
        for name in type(part).model_fields:
            yield from _attachments(getattr(part, name))
    elif isinstance(part, dict | tuple):
        for one in part.values() if isinstance(part, dict) else part:
            yield from _attachments(one)


def _directors(placement: Placement, axes: dict[str, tuple[Array, Array]]) -> Iterator[tuple[str, list[Affine]]]:
    """Yield what may spin, and the directors that define its rotation."""
    for name, frame in placement.frames.items():
        if isinstance(frame, BeamFrame) and frame.element.director is not None:
            yield name, [*(node[2] for node in frame.nodes), *frame.axes.values()]
        elif isinstance(frame, RigidFrame) and name in axes:
            yield name, list(frame.directors)


def _seen(placement: Placement, axes: dict[str, tuple[Array, Array]], size: float) -> Iterator[Affine]:
    """The vectors that no spin moves, lengths by the machine's size."""
    for name, frame in placement.frames.items():
        if isinstance(frame, BeamFrame) and frame.element.director is not None:
            for node in frame.nodes:
                yield from (node[0] * (1 / size), *node[1:2])
        elif name in axes:
            begin, end = axes[name]
            here, there = (frame.point(tuple(place.tolist())) for place in (begin, end))
            yield from (here * (1 / size), (there - here) * float(1 / np.linalg.norm(end - begin)))
        else:
            yield from (frame.vectors[0] * (1 / size), *frame.vectors[1:])
