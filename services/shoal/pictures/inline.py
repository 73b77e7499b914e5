"""Display in notebooks of scenes, motions and answers: one sentence, one table, one picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from shoal.engines import get_engine
from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.errors import InputError
from shoal.identification import Estimate
from shoal.mechanics.analysis.campbell import Campbell
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.linear_model import LinearModel
from shoal.pictures.bode import bode
from shoal.pictures.campbell import campbell
from shoal.pictures.drawn import Drawn
from shoal.pictures.engines import engines
from shoal.pictures.motion import DrawnMotion, scene_motion
from shoal.pictures.overlay import overlay
from shoal.pictures.pages import render
from shoal.pictures.paths import paths
from shoal.pictures.poses import poses
from shoal.pictures.report import shown, verdict
from shoal.pictures.rest import rest
from shoal.pictures.style import png
from shoal.pictures.sweep import sweep
from shoal.pictures.titles import agrees, ends, reaches, rejected
from shoal.scene import Rod, Scene
from shoal.trajectory import Trajectory


@dataclass(frozen=True)
class Picture:
    """A figure that a notebook shows by itself; `figure` is matplotlib's, to change it."""

    figure: Figure

    def _repr_png_(self) -> bytes:
        return png(self.figure)

    def save(self, path: Path | str) -> None:
        """Write it in the format that the ending names: png, svg, pdf."""
        self.figure.savefig(path)


@singledispatch
def plot(result: Any) -> Picture:
    """Draw a scene (its motion), trajectory, equilibrium, estimate, sweep or comparison. Raises InputError."""
    raise InputError(f"plot: there is no picture of a {type(result).__name__}")


@plot.register
def _(scene: Scene) -> Picture:
    until = scene.solver.duration
    moving = scene_motion(scene, get_engine("gauss"), until)
    return Picture(poses(moving, ends(scene.name, moving)))


@plot.register
def _(trajectory: Trajectory) -> Picture:
    return Picture(_paths(trajectory))


@plot.register
def _(equilibrium: Equilibrium) -> Picture:
    return Picture(rest(equilibrium))


@plot.register
def _(diagram: Campbell) -> Picture:
    return Picture(campbell(diagram))


@plot.register
def _(model: LinearModel) -> Picture:
    return Picture(bode(model))


@plot.register
def _(estimate: Estimate) -> Picture:
    return Picture(overlay(estimate))


@plot.register
def _(result: Sweep) -> Picture:
    return Picture(sweep(result, list(result.positions)[-1]))


@plot.register
def _(comparison: Comparison) -> Picture:
    last = list(comparison.scene.markers)[-1]
    return Picture(engines(comparison, last, agrees(comparison, last)))


@singledispatch
def html(result: Any) -> str:
    """A scene, a trajectory or an estimate as a piece of HTML."""
    raise InputError(f"there is no page of a {type(result).__name__}")


@html.register
def _(scene: Scene) -> str:
    """The bodies, each with its start and the joints that hold it."""
    rows = []
    for name, body in scene.bodies.items():
        kind = f"{body.elements} {body.element}" if isinstance(body, Rod) and body.element != "rigid" else body.kind
        start = scene.start(name)
        both = [[start.angle], [start.rate]]
        if scene.dimensions == 3:
            both = [list(start.rotation or (0, 0, start.angle)), list(start.spin or (0, 0, start.rate))]
        rows.append([name, kind, *(", ".join(f"{x:.6g}" for x in one) for one in both)])
    lead = f"{scene.description} Simulated for {scene.solver.duration:g} s unless told otherwise."
    said = ("angle [rad]", "rate [rad/s]") if scene.dimensions == 2 else ("rotation [rad]", "spin [rad/s]")
    return _html(scene.name, lead, "Bodies at the start", ["body", "kind", *said], rows)


@html.register
def _(trajectory: Trajectory) -> str:
    """Summarise the end of a motion, and whether it is accepted; of several lanes the first."""
    end, trust = float(trajectory.times[-1]), f"status {trajectory.status[0]}, {trajectory.errors.brief}"
    several = f"the first of {trajectory.lanes} lanes, " if trajectory.lanes > 1 else ""
    message = f" ({trajectory.message})" if trajectory.message else ""
    ends = [[name, *(f"{x:.6f}" for x in trajectory.marker(name)[-1])] for name in trajectory.markers]
    caption, rows = (f"At {end:g} s", ends) if trajectory.ok else ("No places are shown, as the run is rejected", [])
    reach = ", ".join(trajectory.markers)
    alt = f"{' and '.join(trajectory.axes)} of {reach} against time."
    picture = Drawn("paths", _paths(trajectory), alt, "The coordinates of each marker.")
    headings = ["marker", *(f"{axis} [m]" for axis in trajectory.axes)]
    return _html(f"Motion by {trajectory.engine}", f"{several}{trust}{message}.", caption, headings, rows, picture)


@html.register
def _(estimate: Estimate) -> str:
    """The verdict, the values with their intervals, and the model over the data."""
    values = {**estimate.parameters, **estimate.quantities}
    headings = ["parameter", "value", "standard deviation (noise)", "95 % interval", "known"]
    rows = [[name, *shown(estimate, value)] for name, value in values.items()]
    picture = Drawn("overlay", overlay(estimate), "Measured values with the fitted model.", "The model over the data.")
    return _html(estimate.problem, verdict(estimate), estimate.method, headings, rows, picture)


def _html(
    title: str, lead: str, caption: str, headings: list[str], rows: list[list[str]], picture: Drawn | None = None
) -> str:
    drawn = None if picture is None else picture.embedded()
    return render(
        "inline.html.j2", title=title, lead=lead, caption=caption, headings=headings, rows=rows, picture=drawn
    )


def _paths(trajectory: Trajectory) -> Figure:
    markers = {name: trajectory.marker(name) for name in trajectory.markers}
    events = trajectory.model.get("events", ())
    moving = DrawnMotion("", trajectory.times, np.empty((0, len(trajectory.axes))), {}, markers, events=events)
    name = trajectory.engine
    return paths(moving, reaches(name, moving, trajectory.errors) if trajectory.ok else rejected(name, trajectory))
