"""One simulated motion as one page that moves: where the markers go, how far to trust it, why this model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from shoal.engines import get_engine
from shoal.findings import sentence
from shoal.pictures.choice import rows, tells_places, why
from shoal.pictures.drawn import Drawn
from shoal.pictures.emphasis import TRUE, Emphasis
from shoal.pictures.estimates import budget, estimates, grade
from shoal.pictures.ladder import ladder
from shoal.pictures.motion import DrawnMotion, scene_motion
from shoal.pictures.numbers import length
from shoal.pictures.pages import animation, render, settings, software
from shoal.pictures.paths import paths
from shoal.pictures.poses import poses
from shoal.pictures.start import remarks
from shoal.pictures.titles import ends, reaches, rejected
from shoal.scene import Scene
from shoal.trajectory import Trajectory

if TYPE_CHECKING:
    from shoal.selection import Selection


def simulation(
    trajectory: Trajectory, scene: Scene, selection: Selection | None = None, emphasis: Emphasis = TRUE
) -> str:
    """The page as HTML without a reference to anything outside. Raises InputError, ComputationError."""
    moving = moved(trajectory, scene, emphasis)
    return page(trajectory, scene, moving, drawn(trajectory, scene, moving, selection), selection)


def drawn(trajectory: Trajectory, scene: Scene, moving: DrawnMotion, selection: Selection | None = None) -> list[Drawn]:
    """Draw the pictures of the page: poses, paths and, of a chosen model, the candidates."""
    pictures = [_poses(trajectory, scene, moving), _paths(trajectory, scene, moving)]
    if selection is not None:
        tried, name = len(selection.candidates), selection.chosen.name
        alt = f"Estimated error over the cost of a run for {tried} models; {name} is taken."
        pictures.append(
            Drawn("ladder", ladder(selection), alt, "Left is cheaper, below the dashed line is good enough.")
        )
    return pictures


def page(
    trajectory: Trajectory, scene: Scene, moving: DrawnMotion, pictures: list[Drawn], selection: Selection | None = None
) -> str:
    """The page of a run whose motion and pictures are at hand."""
    return render(
        "simulation.html.j2",
        title=scene.name,
        grade=grade(trajectory, selection),
        lead=_lead(trajectory, selection),
        motion=animation(moving, "The machine"),
        headings=[
            "marker",
            *(f"{axis} [m]" for axis in trajectory.axes),
            *(["angle [rad]"] if _is_flat(trajectory) else []),
        ],
        rows=[[name, *_end(trajectory, name)] for name in trajectory.markers if tells_places(trajectory, selection)],
        remarks=remarks(trajectory.model, trajectory.ok) + _remarks(trajectory, selection),
        pictures=[one.embedded() for one in pictures],
        models=[] if selection is None else rows(selection),
        provenance=_provenance(trajectory, scene),
    )


def _remarks(trajectory: Trajectory, selection: Selection | None) -> list[str]:
    if selection is not None:
        return why(selection)
    found = trajectory.findings if trajectory.ok else ()
    return [sentence(one.text) for one in found] + [f"{one[0].upper()}{one[1:]}." for one in estimates(trajectory)]


def moved(trajectory: Trajectory, scene: Scene, emphasis: Emphasis = TRUE) -> DrawnMotion:
    """The same run with the outlines of its bodies. Raises InputError, ComputationError."""
    return scene_motion(scene, get_engine(trajectory.engine), float(trajectory.times[-1]), emphasis=emphasis)


def _lead(trajectory: Trajectory, selection: Selection | None) -> str:
    if not trajectory.ok:
        return f"Not to be trusted: {trajectory.explanation or trajectory.status[0]}."
    asked = "" if selection is None else f", for a tolerance of {length(selection.tolerance)}"
    name = trajectory.markers[-1]
    place = ", ".join(f"{x:.4g}" for x in trajectory.marker(name)[-1])
    trust = f" Estimated error at the markers: {budget(trajectory.errors)}{asked}."
    return f"After {trajectory.times[-1]:g} s, {name} is at ({place}) m.{trust}"


def _is_flat(trajectory: Trajectory) -> bool:
    """Return whether one angle defines the rotation of a body."""
    return trajectory.axes == "xy"


def _end(trajectory: Trajectory, name: str) -> list[str]:
    numbers = [*trajectory.marker(name)[-1], *([trajectory.angle(name)[-1]] if _is_flat(trajectory) else [])]
    return [f"{x:.6f}" for x in numbers]


def _poses(trajectory: Trajectory, scene: Scene, moving: DrawnMotion) -> Drawn:
    until = f"until {moving.times[-1]:.3g} s"
    alt = f"The bodies {', '.join(moving.outlines)} at several instants {until}, later ones darker."
    colour = "red-orange " if moving.up is not None else ""
    return Drawn(
        "poses",
        poses(
            moving, ends(scene.name, moving, trajectory.errors) if trajectory.ok else rejected(scene.name, trajectory)
        ),
        alt if moving.up is None else f"From the front, above, right and a corner: {alt}",
        f"The later, the darker; the thin {colour}lines are the paths of the markers.",
    )


def _paths(trajectory: Trajectory, scene: Scene, moving: DrawnMotion) -> Drawn:
    reach = {name: float(np.max(np.ptp(path, axis=0))) for name, path in moving.markers.items()}
    moves = ", ".join(f"{name} moves within {length(size)}" for name, size in reach.items())
    words = moves if trajectory.ok else "not to be trusted"
    title = reaches(scene.name, moving, trajectory.errors) if trajectory.ok else rejected(scene.name, trajectory)
    return Drawn(
        "paths",
        paths(moving, title),
        f"{'x, y and z' if moving.up is not None else 'x and y'} of every marker against time: {words}.",
        f"{'All' if moving.up is not None else 'Both'} coordinates of each marker.",
    )


def _provenance(trajectory: Trajectory, scene: Scene) -> list[tuple[str, str]]:
    model = {
        name: value
        for name, value in trajectory.model.items()
        if not isinstance(value, dict | list) or name == "bodies"
    }
    return [
        ("engine", trajectory.engine),
        ("model", settings(model)),
        ("steps", str(trajectory.steps)),
        ("energy", f"off by {trajectory.energy_drift[0]:.1e} of the largest kinetic and elastic energy"),
        ("constraints", f"off by {trajectory.constraint_drift[0]:.1e}"),
        ("time", f"{trajectory.wall_s:.3g} s"),
        ("scene", scene.fingerprint),
        ("versions", software()),
    ]
