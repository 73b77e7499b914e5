"""A machine in motion, for pictures that move: outlines of its bodies by frame, with what was measured, if anything."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.engines.contract import Engine
from shoal.errors import ComputationError, InputError
from shoal.json_values import plain
from shoal.pictures.contacts import slack, struck
from shoal.pictures.emphasis import TRUE, Emphasis
from shoal.pictures.links import At, Links
from shoal.pictures.machine.drawing import Drawing
from shoal.pictures.machine.magnified import Magnified
from shoal.pictures.machine.sketch import Sketch
from shoal.pictures.machine.stress import LEVELS, Stress, stress_along
from shoal.pictures.outline import ground, outlined
from shoal.pictures.solids import Bar, MarkedScene
from shoal.pictures.style import STRESS, palette
from shoal.pictures.views import ViewDirection, views
from shoal.scene import Rod, Scene
from shoal.trajectory import Array, Trajectory

if TYPE_CHECKING:
    from shoal.pictures.answer import Answer

_FRAMES = 150
_LETTERS = "0123456789abcdefghijklmnopqrstuvwxyz"


@dataclass(frozen=True)
class DrawnMotion:
    """One run as the machine's frame sees it; times by the recording's clock [s], (frames,).

    name: of the recording or scene; ground: fixed places [m], (places, d)
    outlines: points of each body [m], (frames, points, d); markers: of the model [m], (frames, d)
    measured: places [m], (frames, d), nan where none was measured near that time; directions: measured angles [rad]
    behind: outlines of another machine that is drawn below [m], (frames, points, d)
    links: places that a spring or a distance joins [m], (frames, 2, d); slack: when ropes and struts hold nothing,
    (frames,); drawing: symbols of bodies, joints and loads; half: of the thickness of rods that bend in the plane, at
    the points of their outlines [m], (points,); stress: of rods, at the same points; note: what a picture has to state;
    drawn_markers: where markers are drawn, if deflections are magnified [m], (frames, d)
    events: of contacts, as `model["events"]` has them; struck: times of impacts, by marker [s]
    In space: bars of bodies; axes of joints: a point [m] and a direction, (frames, 2, 3); up: the direction against
    gravity, along an axis, (3,).
    Of a view on paper: thin lines [m], (frames, points, 2), nan between them; labels of the coordinates.
    """

    name: str
    times: Array
    ground: Array
    outlines: dict[str, Array]
    markers: dict[str, Array]
    measured: dict[str, Array] = field(default_factory=dict)
    directions: dict[str, Array] = field(default_factory=dict)
    behind: dict[str, Array] = field(default_factory=dict)
    links: dict[str, Array] = field(default_factory=dict)
    slack: dict[str, Array] = field(default_factory=dict)
    drawing: Drawing = field(default_factory=Drawing)
    half: dict[str, Array] = field(default_factory=dict)
    stress: Stress | None = None
    note: str = ""
    drawn_markers: dict[str, Array] = field(default_factory=dict)
    events: Sequence[Mapping[str, Any]] = ()
    struck: dict[str, Array] = field(default_factory=dict)
    bars: dict[str, Bar] = field(default_factory=dict)
    axes: dict[str, Array] = field(default_factory=dict)
    up: Array | None = None
    thin: dict[str, Array] = field(default_factory=dict)
    labels: tuple[str, str] = ("x [m]", "y [m]")

    @property
    def span(self) -> float:
        """Length in time [s]."""
        return float(self.times[-1] - self.times[0])

    @property
    def stops(self) -> dict[str, Array]:
        """Lines of limits and surfaces in the plane [m], (frames, points, 2), nan between them."""
        shown = [symbol for symbol in self.drawing.symbols if symbol.look in ("stop", "surface")]
        frames = len(self.times)
        return {one.part: np.broadcast_to(path := self.drawing.path(one), (frames, *path.shape[1:])) for one in shown}

    @property
    def seats(self) -> dict[str, Array]:
        """Places at which markers are drawn [m], (frames, d)."""
        return self.drawn_markers or self.markers

    @property
    def shaped(self) -> set[str]:
        """The bodies that are drawn by their shape, and not by the line of their outline."""
        points = {name for name, outline in self.outlines.items() if outline.shape[1] == 1 and self.drawing.symbols}
        return self.drawing.parts("body", "plate") | self.half.keys() | points

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Lower left and upper right corner [m] of all that is shown, (2,) each."""
        parts = (self.outlines, self.behind, self.measured, self.links, self.thin, self.seats)
        moving = (path for part in parts for path in part.values())
        solid = (bar.edges for bar in self.bars.values())
        shown = (*moving, *solid, *self.drawing.places, self.ground)
        every = np.concatenate([np.reshape(x, (-1, self.ground.shape[1])) for x in shown])
        return np.nanmin(every, axis=0), np.nanmax(every, axis=0)

    @property
    def size(self) -> float:
        """The longest side of the box [m]."""
        low, high = self.box
        return float(np.max(high - low))

    @property
    def aspect(self) -> float:
        """Height over width of a picture that suits the box."""
        if self.up is not None:
            return 0.75
        low, high = self.box
        width, height = high - low
        return float(np.clip((height + 0.1 * width) / max(width, 1e-9), 0.3, 0.8))

    def seen(self, view: ViewDirection) -> DrawnMotion:
        """A motion in space as it is on paper."""

        def flat(paths: dict[str, Array]) -> dict[str, Array]:
            return {name: path @ view.plane for name, path in paths.items()}

        arm = 0.06 * self.size * np.array([[-1.0], [1.0]])
        thin = {f"axis of {name}": line[:, :1] + arm * line[:, 1:] for name, line in self.axes.items()}
        thin |= {f"edges of {name}": bar.edges for name, bar in self.bars.items() if bar.side is not None}
        return replace(
            self,
            ground=self.ground @ view.plane,
            outlines=flat(self.outlines),
            markers=flat(self.markers),
            drawn_markers=flat(self.drawn_markers),
            measured=flat(self.measured),
            behind=flat(self.behind),
            links=flat(self.links),
            thin=flat(thin),
            drawing=self.drawing.projected(view.plane),
            labels=view.labels,
            bars={},
            axes={},
            up=None,
        )


def scene_motion(
    scene: Scene, engine: Engine, until: float, frames: int = _FRAMES, emphasis: Emphasis = TRUE
) -> DrawnMotion:
    """The motion of a scene until a time [s], as far as it can be computed. Raises InputError, ComputationError."""
    emphasis.check(scene)
    if until <= 0:
        raise InputError("out: a motion that is shown lasts longer than 0 s; choose later times with --at")
    traced, read = traced_out(scene, emphasis)
    whole = {"whole": True} if emphasis.stress else {}
    seen = engine.simulate(traced, np.linspace(0.0, until, frames), **whole)
    known = np.all(np.isfinite(seen.points[..., 0]), axis=(1, 2))
    count = frames if np.all(known) else int(np.argmin(known))
    if count < 2:
        raise ComputationError(f"{scene.name}: there is no motion to show: {seen.explanation or seen.status[0]}")
    markers = {name: seen.marker(name)[:count] for name in scene.markers}
    shown = read(lambda name: seen.marker(name)[:count], seen.times[:count])
    events = seen.model.get("events", ())
    happened: dict[str, Any] = {"events": events, "struck": struck(scene, events)}
    if emphasis.stress:
        along = {name: shown["outlines"][name].shape[1] for name in scene.flexible_rods}
        happened["stress"] = stress_along(_until(seen, count), scene, along)
    return DrawnMotion(scene.name, seen.times[:count], ground(scene), markers=markers, **happened, **shown)


def _until(run: Trajectory, count: int) -> Trajectory:
    """Return the first instants of a run, as far as it is known."""
    if run.states is None or count == len(run.times):
        return run
    states = replace(run.states, **{name: getattr(run.states, name)[:count] for name in ("q", "v", "contacts")})
    return replace(run, times=run.times[:count], states=states)


def traced_out(scene: Scene, emphasis: Emphasis = TRUE) -> tuple[Scene, Callable[[At, Array], dict[str, Any]]]:
    """Return the scene with markers that show its bodies, and what makes fields of a DrawnMotion of their paths.

    These are the paths of a marker by its name [m], (frames, d), and the times of the motion [s], (frames,).
    """
    traced, points = outlined(scene)
    links, sketch = Links(scene), Sketch(scene)
    magnified = None if emphasis.magnify == 1.0 else Magnified(scene, emphasis.magnify)
    solids = MarkedScene(traced, points, scene) if scene.dimensions == 3 else None
    data = (traced if solids is None else solids.scene).model_dump(mode="json")
    data["markers"] |= links.markers | sketch.markers | (magnified.markers if magnified else {})
    rods = scene.flexible_rods if scene.dimensions == 2 else {}
    half = {name: _half(rod, len(points[name])) for name, rod in rods.items()}

    def read(at: At, times: Array) -> dict[str, Any]:
        larger = {}
        if magnified is not None:
            at = magnified.of(at, data["markers"])
            larger = {"drawn_markers": {name: at(name) for name in scene.markers}, "note": emphasis.note}
        outlines = {body: np.stack([at(name) for name in names], axis=1) for body, names in points.items()}
        joined = links.shown(at, times)
        drawing = sketch.drawing(at, times, outlines.values(), joined.values())
        shown = {"outlines": outlines, "links": joined, "slack": slack(scene, joined), "drawing": drawing, "half": half}
        shown |= larger
        return shown if solids is None else {**shown, "up": upwards(scene), **solids.shown(at, len(times))}

    return Scene.parse(data, scene.name), read


def _half(rod: Rod, count: int) -> Array:
    """Return half the thickness of a rod at points along it [m], (points,)."""
    return np.asarray(rod.section_at(np.linspace(0.0, 1.0, count)).height / 2 * np.ones(count))


def upwards(scene: Scene) -> Array:
    """The axis of space that points most nearly against gravity, or z, (3,)."""
    against = -np.array([*scene.gravity, 0.0][:3])
    k = int(np.argmax(np.abs(against))) if np.any(against) else 2
    way: Array = np.zeros(3)
    way[k] = -1.0 if against[k] < 0 else 1.0
    return way


def motion(answer: Answer, recording: str, frames: int = _FRAMES) -> DrawnMotion:
    """The motion that was identified, over what a recording shows. Raises InputError."""
    view = answer.view(recording)
    samples = answer.estimate.measurement.recordings[recording]
    earliest = max(0.0, -view["delay"] * view["clock"])
    times = np.linspace(earliest, float(samples.times[-1]), frames)
    scene = answer.estimate.scenes[recording]
    traced, read = traced_out(scene)
    seen = answer.model.engine.simulate(traced, np.maximum(0.0, times / view["clock"] + view["delay"]))
    # Who measured by load cells alone sees all there are.
    watched = [channel.marker for channel in samples.channels if channel.marker] or scene.markers
    markers = {name: seen.marker(name) for name in watched}
    nearest = np.abs(samples.times[None] - times[:, None]).argmin(axis=1)
    close = np.abs(samples.times[nearest] - times) <= 1.01 * max(times[1] - times[0], _step(samples.times))
    places: dict[str, dict[str, Array]] = {}
    for k, channel in enumerate(samples.channels):
        if channel.to is not None or channel.is_sensor:
            continue
        values = np.where(close, samples.values[nearest, k], np.nan)
        places.setdefault(channel.marker, {})[channel.quantity] = values
    needed = {"x", "y"} if scene.dimensions == 2 else {"x", "y", "z"}
    measured = {m: _place(found, view) for m, found in places.items() if needed <= found.keys()}
    directions = {m: found["angle"] + view["tilt"] for m, found in places.items() if "angle" in found}
    fixed = ground(scene)
    shown = read(seen.marker, seen.times)
    return DrawnMotion(recording, times, fixed, markers=markers, measured=measured, directions=directions, **shown)


def _step(times: Array) -> float:
    return float(np.median(np.diff(times))) if len(times) > 1 else np.inf


def _place(found: dict[str, Array], view: dict[str, float]) -> Array:
    """From what the camera sees to the machine's frame [m], (frames, d)."""
    x, y = (view["scale"] * found[key] for key in ("x", "y"))
    c, s = np.cos(view["tilt"]), np.sin(view["tilt"])
    depth = [view["scale"] * found["z"]] if "z" in found else []
    return np.stack([view["x"] + c * x - s * y, view["y"] + s * x + c * y, *depth], axis=1)


def plain_motion(found: DrawnMotion) -> dict[str, Any]:
    """Return plain numbers for a script in a page, rounded to a ten-thousandth of the machine's size."""
    (low, high), size = found.box, found.size
    digits = max(0, 4 - int(np.floor(np.log10(size)))) if size > 0 else 6
    space = {} if found.up is None else _plain_space(found, digits)
    drawn = found.shaped - found.half.keys() if found.up is None else ()
    return {
        "name": found.name,
        "times": np.round(found.times, 6).tolist(),
        "box": [*low.tolist(), *high.tolist()],
        "ground": plain(found.ground),
        "behind": {name: plain(np.round(x, digits)) for name, x in found.behind.items()},
        "outlines": {name: plain(np.round(x, digits)) for name, x in found.outlines.items() if name not in drawn},
        "links": {name: plain(np.round(x, digits)) for name, x in found.links.items()},
        "slack": {name: x.tolist() for name, x in found.slack.items()},
        "drawing": found.drawing.to_json(digits),
        "half": {name: plain(np.round(x, digits + 1)) for name, x in found.half.items()},
        "markers": {name: plain(np.round(x, digits)) for name, x in found.seats.items()},
        "note": found.note,
        "stress": None if found.stress is None else _plain_stress(found.stress),
        "measured": {name: plain(np.round(x, digits)) for name, x in found.measured.items()},
        "directions": {name: plain(np.round(x, 4)) for name, x in found.directions.items()},
        **space,
    }


def _plain_stress(found: Stress) -> dict[str, Any]:
    """Return the palette, the end of the scale, and a letter of base 36 for the colour of each point."""
    most, unit = found.scale
    rods = {name: ["".join(_LETTERS[k] for k in row) for row in found.levels(name).tolist()] for name in found.values}
    return {"palette": palette(LEVELS), "label": STRESS, "most": f"{most:.3g} {unit}", "rods": rods}


def _plain_space(found: DrawnMotion, digits: int) -> dict[str, Any]:
    bars = {
        name: {
            # Otherwise it is the outline.
            "axis": plain(np.round(bar.axis, digits)) if bar.stands_for else None,
            "side": None if bar.side is None else plain(np.round(bar.side, 4)),
            "size": plain(bar.size),
            "clear": bar.stands_for,
            "round": bar.round or bar.side is None,
        }
        for name, bar in found.bars.items()
    }
    assert found.up is not None
    looks = views(found.up)
    return {
        "front": [plain(looks[0].right), plain(looks[0].up)],
        "views": {view.name: [view.yaw, view.pitch] for view in looks},
        "bars": bars,
        "axes": {name: plain(np.round(x, digits + 1)) for name, x in found.axes.items()},
    }
