"""Contacts in pictures: stops at their joints, slack ropes, and events on the axis of time and on trajectories."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from shoal.mechanics.event_record import place_of
from shoal.pictures.style import BLACK, GREEN, ORANGE, PURPLE, VERMILION
from shoal.scene import GROUND, Scene
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
