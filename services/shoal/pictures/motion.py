"""A machine in motion, for pictures that move: outlines of its bodies by frame, with what was measured, if anything."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.engines.contract import Engine
from shoal.errors import ComputationError, InputError
from shoal.pictures.outline import ground, outlined
from shoal.scene import Scene
from shoal.scene.dimensions import require_plane
from shoal.trajectory import Array, plain

if TYPE_CHECKING:
    from shoal.pictures.answer import Answer

_FRAMES = 150


@dataclass(frozen=True)
class Motion:
    """One run as the machine's frame sees it; times by the recording's clock [s], (frames,).

    name: of the recording or scene; ground: fixed places [m], (places, 2)
    outlines: points of each body [m], (frames, points, 2); markers: of the model [m], (frames, 2)
    measured: places [m], (frames, 2), nan where none was measured near that time; directions: measured angles [rad]
    behind: outlines of another machine that is drawn below [m], (frames, points, 2)
    """

    name: str
    times: Array
    ground: Array
    outlines: dict[str, Array]
    markers: dict[str, Array]
    measured: dict[str, Array] = field(default_factory=dict)
    directions: dict[str, Array] = field(default_factory=dict)
    behind: dict[str, Array] = field(default_factory=dict)

    @property
    def span(self) -> float:
        """Length in time [s]."""
        return float(self.times[-1] - self.times[0])

    @property
    def box(self) -> tuple[Array, Array]:
        """Lower left and upper right corner [m] of all that is shown, (2,) each."""
        moving = (*self.outlines.values(), *self.behind.values(), *self.measured.values())
        every = np.concatenate([np.reshape(x, (-1, 2)) for x in (*moving, self.ground)])
        return np.nanmin(every, axis=0), np.nanmax(every, axis=0)

    @property
    def aspect(self) -> float:
        """Height over width of a picture that suits the box."""
        low, high = self.box
        width, height = high - low
        return float(np.clip((height + 0.1 * width) / max(width, 1e-9), 0.3, 0.8))


def scene_motion(scene: Scene, engine: Engine, until: float, frames: int = _FRAMES) -> Motion:
    """The motion of a scene until a time [s], as far as it can be computed. Raises InputError, ComputationError."""
    require_plane(scene, "moving pictures are")
    if until <= 0:
        raise InputError("out: a motion that is shown lasts longer than 0 s; choose later times with --at")
    traced, points = outlined(scene)
    seen = engine.simulate(traced, np.linspace(0.0, until, frames))
    known = np.all(np.isfinite(seen.points[..., 0]), axis=(1, 2))
    count = frames if np.all(known) else int(np.argmin(known))
    if count < 2:
        raise ComputationError(f"{scene.name}: there is no motion to show: {seen.message or seen.status[0]}")
    outlines = {body: np.stack([seen.marker(n)[:count] for n in names], axis=1) for body, names in points.items()}
    markers = {name: seen.marker(name)[:count] for name in scene.markers}
    return Motion(scene.name, seen.times[:count], ground(scene), outlines, markers)


def motion(answer: Answer, recording: str, frames: int = _FRAMES) -> Motion:
    """The motion that was identified, over what a recording shows. Raises InputError."""
    view = answer.view(recording)
    samples = answer.estimate.measurement.recordings[recording]
    earliest = max(0.0, -view["delay"] * view["clock"])
    times = np.linspace(earliest, float(samples.times[-1]), frames)
    traced, points = outlined(answer.estimate.scenes[recording])
    seen = answer.model.engine.simulate(traced, np.maximum(0.0, times / view["clock"] + view["delay"]))
    outlines = {body: np.stack([seen.marker(name) for name in names], axis=1) for body, names in points.items()}
    markers = {channel.marker: seen.marker(channel.marker) for channel in samples.channels}
    nearest = np.abs(samples.times[None] - times[:, None]).argmin(axis=1)
    close = np.abs(samples.times[nearest] - times) <= 1.01 * max(times[1] - times[0], _step(samples.times))
    places: dict[str, dict[str, Array]] = {}
    for k, channel in enumerate(samples.channels):
        values = np.where(close, samples.values[nearest, k], np.nan)
        places.setdefault(channel.marker, {})[channel.quantity] = values
    measured = {m: _place(found, view) for m, found in places.items() if {"x", "y"} <= found.keys()}
    directions = {m: found["angle"] + view["tilt"] for m, found in places.items() if "angle" in found}
    fixed = ground(answer.estimate.scenes[recording])
    return Motion(recording, times, fixed, outlines, markers, measured, directions)


def _step(times: Array) -> float:
    return float(np.median(np.diff(times))) if len(times) > 1 else np.inf


def _place(found: dict[str, Array], view: dict[str, float]) -> Array:
    """From what the camera sees to the machine's frame [m], (frames, 2)."""
    x, y = (view["scale"] * found[key] for key in ("x", "y"))
    c, s = np.cos(view["tilt"]), np.sin(view["tilt"])
    return np.stack([view["x"] + c * x - s * y, view["y"] + s * x + c * y], axis=1)


def plain_motion(found: Motion) -> dict[str, Any]:
    """As plain numbers for a script in a page, rounded to a ten-thousandth of the machine's size."""
    low, high = found.box
    size = float(np.max(high - low))
    digits = max(0, 4 - int(np.floor(np.log10(size)))) if size > 0 else 6
    return {
        "name": found.name,
        "times": np.round(found.times, 6).tolist(),
        "box": [*low.tolist(), *high.tolist()],
        "ground": plain(found.ground),
        "behind": {name: plain(np.round(x, digits)) for name, x in found.behind.items()},
        "outlines": {name: plain(np.round(x, digits)) for name, x in found.outlines.items()},
        "markers": {name: plain(np.round(x, digits)) for name, x in found.markers.items()},
        "measured": {name: plain(np.round(x, digits)) for name, x in found.measured.items()},
        "directions": {name: plain(np.round(x, 4)) for name, x in found.directions.items()},
    }
