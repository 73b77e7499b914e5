"""The identified machine in motion: outlines of its bodies over the measured places, by frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.answer import Answer
from shoal.pictures.style import BLACK, BLUE, ORANGE, VERMILION, canvas, headline, styled
from shoal.scene import Rod, Scene
from shoal.trajectory import Array, plain

_ALONG = 13
"""Points along a rod, so that its bending shows."""
_FRAMES = 150
_POSES = 7
_INSIDE = "outline"


@dataclass(frozen=True)
class Motion:
    """One recording as the machine's frame sees it; times by the recording's clock [s], (frames,).

    outlines: points of each body [m], (frames, points, 2); markers: of the fitted model [m], (frames, 2)
    measured: places [m], (frames, 2), nan where none was measured near that time; directions: measured angles [rad]
    """

    recording: str
    times: Array
    outlines: dict[str, Array]
    markers: dict[str, Array]
    measured: dict[str, Array]
    directions: dict[str, Array]


def motion(answer: Answer, recording: str, frames: int = _FRAMES) -> Motion:
    """The motion that was identified, over what a recording shows. Raises InputError."""
    view = answer.view(recording)
    samples = answer.estimate.measurement.recordings[recording]
    earliest = max(0.0, -view["delay"] / view["clock"])
    times = np.linspace(earliest, float(samples.times[-1]), frames)
    scene, points = _outlined(answer.estimate.scenes[recording])
    seen = answer.model.engine.simulate(scene, np.maximum(0.0, view["clock"] * times + view["delay"]))
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
    return Motion(recording, times, outlines, markers, measured, directions)


def _step(times: Array) -> float:
    return float(np.median(np.diff(times))) if len(times) > 1 else np.inf


def _place(found: dict[str, Array], view: dict[str, float]) -> Array:
    """From what the camera sees to the machine's frame [m], (frames, 2)."""
    x, y = (view["scale"] * found[key] for key in ("x", "y"))
    c, s = np.cos(view["tilt"]), np.sin(view["tilt"])
    return np.stack([view["x"] + c * x - s * y, view["y"] + s * x + c * y], axis=1)


def _outlined(scene: Scene) -> tuple[Scene, dict[str, list[str]]]:
    """The scene with markers along its bodies, and their names by body."""
    data = scene.model_dump(mode="json")
    names: dict[str, list[str]] = {}
    for body_name, body in scene.bodies.items():
        if isinstance(body, Rod):
            places: list[Any] = _along(body)
        else:
            # A body of any shape is drawn as the line through the places that it is joined and observed at.
            sides = [getattr(joint, side, None) for joint in scene.joints.values() for side in ("first", "second")]
            used = [*(side for side in sides if side is not None), *scene.markers.values()]
            places = [list(x) for x in dict.fromkeys(scene.location(a) for a in used if a.body == body_name)]
        names[body_name] = [f"{_INSIDE}-{body_name}-{k}" for k in range(len(places))]
        data["markers"] |= {n: {"body": body_name, "point": p} for n, p in zip(names[body_name], places, strict=True)}
    return Scene.parse(data, scene.name), {body: found for body, found in names.items() if found}


def _along(rod: Rod) -> list[Any]:
    """Places along a rod, as a marker names them."""
    if rod.element != "rigid":
        return [[float(s), 0.0] for s in np.linspace(0.0, rod.length, _ALONG)]
    if not rod.curvature:
        return ["start", "end"]
    axis = [rod.axis(s) for s in np.linspace(0.0, rod.length, _ALONG)]
    return [[float(place.real), float(place.imag)] for place in axis]


@styled
def poses(found: Motion, title: str) -> Figure:
    """The machine at a few instants, the later the darker, the paths of its markers, and the measured places."""
    figure, axes = canvas(5.6)
    chosen = np.linspace(0, len(found.times) - 1, _POSES).round().astype(int)
    for number, k in enumerate(chosen):
        strength = min(1.0, 0.2 + 0.8 * number / (_POSES - 1))
        for outline in found.outlines.values():
            axes.plot(*outline[k].T, color=BLUE, alpha=strength, linewidth=2.2)
    for number, (marker, place) in enumerate(found.measured.items()):
        axes.plot(*place.T, "o", color=BLACK, markersize=4, fillstyle="none", label="" if number else "measured")
        axes.annotate(marker, found.markers[marker][-1], (6, 4), textcoords="offset points", fontweight="bold")
    for number, path in enumerate(found.markers.values()):
        axes.plot(*path.T, color=VERMILION, linewidth=1.2, label="" if number else "path of the fitted model")
    length = 0.08 * max(np.ptp(np.concatenate([o.reshape(-1, 2) for o in found.outlines.values()]), axis=0))
    for number, (marker, angle) in enumerate(found.directions.items()):
        for k in chosen:
            tip = found.markers[marker][k] + length * np.array([np.cos(angle[k]), np.sin(angle[k])])
            label = "measured direction" if number == 0 and k == chosen[0] else ""
            axes.plot(*np.stack([found.markers[marker][k], tip]).T, color=ORANGE, linewidth=2, label=label)
    axes.set_aspect("equal", adjustable="datalim")
    headline(figure, title)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=3)
    return figure


def plain_motion(found: Motion) -> dict[str, Any]:
    """As plain numbers for a script in a page, rounded to a ten-thousandth of the machine's size."""
    every = np.concatenate([outline.reshape(-1, 2) for outline in (*found.outlines.values(), *found.measured.values())])
    every = every[np.all(np.isfinite(every), axis=1)]
    digits = max(0, 4 - int(np.floor(np.log10(max(np.ptp(every, axis=0))))))

    return {
        "name": found.recording,
        "times": np.round(found.times, 6).tolist(),
        "box": [*every.min(axis=0).tolist(), *every.max(axis=0).tolist()],
        "outlines": {name: plain(np.round(x, digits)) for name, x in found.outlines.items()},
        "markers": {name: plain(np.round(x, digits)) for name, x in found.markers.items()},
        "measured": {name: plain(np.round(x, digits)) for name, x in found.measured.items()},
        "directions": {name: plain(np.round(x, 4)) for name, x in found.directions.items()},
    }
