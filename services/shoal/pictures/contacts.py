"""Contacts in pictures: stops at their joints, slack ropes, and events on the axis of time and on trajectories."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from shoal.mechanics.cams import points, segments
from shoal.mechanics.event_record import place_of
from shoal.mechanics.profiles import SIZE
from shoal.mechanics.reach import span
from shoal.pictures.links import At
from shoal.pictures.outline import INSIDE
from shoal.pictures.style import BLACK, GREEN, ORANGE, PURPLE, VERMILION
from shoal.scene import GROUND, Attachment, PointMass, Revolute, Rod, Scene, Slider
from shoal.scene.clearances import contacts_of, with_play
from shoal.scene.contacts import ContactSurface
from shoal.scene.joints import Distance, is_loose, places
from shoal.trajectory import Array

KINDS: dict[str, dict[str, Any]] = {
    "impact": {"marker": "^", "color": VERMILION},
    "opens": {"marker": "o", "color": BLACK, "fillstyle": "none"},
    "rests": {"marker": "s", "color": BLACK},
    "sticks": {"marker": "D", "color": GREEN},
    "slips": {"marker": "d", "color": ORANGE},
}
"""Marks of kinds of events."""
OTHERS: dict[str, Any] = {"marker": "x", "color": PURPLE}
RADIUS, TICK = 0.08, 0.02
"""Of the arc of a stop, and half the length of a tick, over the size of the machine."""
OPEN = 0.6
"""Arc that is drawn of a range with one end [rad]."""
ARC = 24
SLACK = 1e-4
"""Share of its length by which a rope is shorter than that, and drawn as slack: no picture shows less."""

Event = Mapping[str, Any]


def mark_times(panel: Axes, events: Sequence[Event]) -> None:
    """Mark events on the axis of time, with a legend entry for each kind and how often it is there."""
    shown = [event for event in events if event.get("impulse", 1.0) > 0.0]
    for kind, count in Counter(event["kind"] for event in shown).items():
        times = [event["time"] for event in shown if event["kind"] == kind]
        look = {"markersize": 6, "linestyle": "none", "clip_on": False, "zorder": 5, **KINDS.get(kind, OTHERS)}
        panel.plot(times, np.zeros(count), transform=panel.get_xaxis_transform(), label=f"{kind} ({count})", **look)


def mark_impacts(panel: Axes, times: Array, path: Array, hits: Array, label: str = "") -> None:
    """Mark impacts on a plane curve, (samples, 2), that is sampled at times [s]. hits: times of impacts [s]."""
    hits = hits[(hits >= times[0]) & (hits <= times[-1])]
    along = (np.interp(hits, times, path[:, k]) for k in range(2))
    if len(hits):
        panel.plot(*along, markersize=4, linestyle="none", zorder=4, label=label, **KINDS["impact"])


def struck(scene: Scene, events: Sequence[Event]) -> dict[str, Array]:
    """Return the times [s] at which impacts may change the rates of markers, by name.

    They are impacts of bodies that joints connect with that of the marker. Ropes, struts, contacts and joints with play
    or backlash connect none.
    """
    sides = {name: [side.body for side in places(joint)] for name, joint in scene.joints.items()}
    touching = {name: [contact.first.body, contact.second.body] for name, contact in scene.contacts.items()}
    group = {name: name for name in scene.bodies}
    for name, bodies in sides.items():
        if getattr(scene.joints[name], "keeps", "exactly") == "exactly" and not is_loose(scene.joints[name]):
            roots = {group[body] for body in bodies if body != GROUND}
            group = {key: min(roots) if root in roots else root for key, root in group.items()}
    groups = {name: {group.get(body) for body in bodies} for name, bodies in (sides | touching).items()}
    hits = [event for event in events if event["kind"] == "impact" and event["impulse"] > 0.0]
    return {
        name: np.array([event["time"] for event in hits if group.get(at.body, "") in groups[place_of(event)]])
        for name, at in scene.markers.items()
    }


class Limits:
    """The stops and the surfaces of contacts of a scene in the plane, with the markers that they are drawn by.

    A stop of a hinge is the arc of its range about the joint, beside the first body; one of a slider a tick across it.
    Bodies that bend show none, as they have no axes of their own at a joint. Surfaces are circles, lines, polygons and
    cams.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.markers: dict[str, dict[str, Any]] = {}
        self._drawn: dict[str, Callable[[At, int], Array]] = {}
        self._size = span(scene)
        for name, joint in scene.joints.items() if scene.dimensions == 2 else ():
            if isinstance(joint, Revolute | Slider) and joint.stops is not None and self._has_axes(joint.first):
                ends = [joint.stops.min, joint.stops.max]
                lines = self._arc(ends) if isinstance(joint, Revolute) else self._ticks(ends, joint)
                self._drawn[name] = self._carried(joint.first, lines)
        stated = {f"contacts.{name}": contact for name, contact in scene.contacts.items()}
        for path, contact in (contacts_of(scene) | stated).items() if scene.dimensions == 2 else ():
            for field, side in (("first", contact.first), ("second", contact.second)):
                if (outline := self._surface(side)) is not None and self._has_axes(side):
                    self._drawn[f"{path.removeprefix('contacts.')} {field}"] = self._carried(side, outline)
        for name, guide in with_play(scene).items():
            if isinstance(guide, Slider):
                self._drawn[f"{name} box"] = self._carried(guide.second, self._box(guide))

    def shown(self, at: At, frames: int) -> dict[str, Array]:
        """Return lines by joint [m], nan between them, (frames, points, 2)."""
        return {name: lines(at, frames) for name, lines in self._drawn.items()}

    def _has_axes(self, side: Attachment) -> bool:
        if side.body == GROUND:
            return not isinstance(side.point, str)
        body = self._scene.bodies[side.body]
        return not isinstance(body, Rod) or body.element == "rigid"

    def _arc(self, ends: list[float | None]) -> Array:
        """Return the range of a hinge about its place, in the axes of the first body [m], (points, 2)."""
        limits = [end for end in ends if end is not None]
        low = limits[0] if ends[0] is not None else limits[0] - OPEN
        high = limits[-1] if ends[1] is not None else limits[0] + OPEN
        angle = np.linspace(low, high, ARC)
        arc = RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        gap = np.full((1, 2), np.nan)
        ways = [np.array([[np.cos(end), np.sin(end)]]) for end in limits]
        ticks = [part for way in ways for part in (gap, (RADIUS - TICK) * way, (RADIUS + 2 * TICK) * way)]
        return self._size * np.concatenate([arc, *ticks])

    def _surface(self, side: ContactSurface) -> Array | None:
        """Return a circle, a polygon or a cam about the place of a surface, or a line through it [m], (points, 2).

        None of a point.
        """
        if side.line is not None:
            return self._size * np.array([[-1.0], [1.0]]) * [np.cos(side.line), np.sin(side.line)]
        if side.polygon is not None:
            return np.array([*side.polygon, side.polygon[0]])
        if side.cam is not None:
            outline = points(segments(side.cam, SIZE))
            return np.concatenate([outline, outline[:1]])
        angle = np.linspace(0.0, 2.0 * np.pi, 2 * ARC)
        radius = side.radius if side.hole is None else side.hole
        return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1) if radius else None

    def _box(self, joint: Slider) -> Array:
        """Return the box of a slider with play about its place [m], (points, 2)."""
        assert joint.size is not None
        corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]])
        return np.asarray(0.5 * corners * np.array(joint.size))

    def _ticks(self, ends: list[float | None], joint: Slider) -> Array:
        """Return ticks across the line of a slider, from its place [m], (points, 2)."""
        way = np.array([np.cos(joint.direction), np.sin(joint.direction)])
        across = 2 * TICK * self._size * np.array([-way[1], way[0]])
        gap = np.full(2, np.nan)
        places = [end * way for end in ends if end is not None]
        return np.stack([point for place in places for point in (place - across, place + across, gap)])

    def _carried(self, side: Attachment, lines: Array) -> Callable[[At, int], Array]:
        """Return the lines with a body, by two markers on it; a point mass does not turn."""
        place = np.array(self._scene.location(side), dtype=float)
        if side.body == GROUND:
            return lambda _, frames: np.broadcast_to(place + lines, (frames, *lines.shape))
        names = [f"{INSIDE}-stop-{len(self.markers) + k}" for k in range(2)]
        if isinstance(self._scene.bodies[side.body], PointMass):
            self.markers[names[0]] = {"body": side.body, "point": place.tolist()}
            return lambda at, _: at(names[0])[:, None] + lines
        ends = place, place + np.array([self._size, 0.0])
        self.markers |= {
            name: {"body": side.body, "point": point.tolist()} for name, point in zip(names, ends, strict=True)
        }

        def drawn(at: At, frames: int) -> Array:
            base, tip = (at(name) for name in names)
            x = (tip - base) / np.linalg.norm(tip - base, axis=1, keepdims=True)
            y = np.stack([-x[:, 1], x[:, 0]], axis=1)
            return np.asarray(base[:, None] + lines[None, :, :1] * x[:, None] + lines[None, :, 1:] * y[:, None])

        return drawn


def slack(scene: Scene, links: Mapping[str, Array]) -> dict[str, Array]:
    """Return when ropes and struts hold nothing, by name, (frames,). links: their ends [m], (frames, 2, d)."""
    found = {}
    for name, joint in scene.joints.items():
        if isinstance(joint, Distance) and joint.keeps != "exactly":
            length = np.linalg.norm(links[name][:, 1] - links[name][:, 0], axis=1)
            limit = length[0] if joint.length is None or joint.length.number is None else joint.length.number
            away = (limit - length) * (1.0 if joint.keeps == "at-most" else -1.0)
            found[name] = away > SLACK * limit
    return found
