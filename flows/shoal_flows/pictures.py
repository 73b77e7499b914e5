"""Pictures as bytes, drawn in the worker processes: each function is called there by its name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure
from shoal.engines.compare import Comparison
from shoal.errors import ComputationError, InputError
from shoal.identification import Estimate, Measurement, load_problem
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.pictures import simulation, titles
from shoal.pictures.answer import Answer
from shoal.pictures.archive import archived
from shoal.pictures.convergence import convergence
from shoal.pictures.engines import engines
from shoal.pictures.files import draws, moving_picture
from shoal.pictures.gallery import gallery, motions
from shoal.pictures.ladder import ladder
from shoal.pictures.mesh_error import mesh_error
from shoal.pictures.motion import motion
from shoal.pictures.overlay import follows, overlay
from shoal.pictures.pages import animation
from shoal.pictures.remainders import remainders
from shoal.pictures.report import report
from shoal.pictures.response import response
from shoal.pictures.rest import rest
from shoal.pictures.study import study
from shoal.pictures.style import png, svg
from shoal.pictures.uncertainty import uncertainty
from shoal.response import Response
from shoal.scene import Scene
from shoal.scene.edited import as_yaml
from shoal.selection import Selection
from shoal.trajectory import Trajectory

from shoal_flows.jobs import Cell, Fit, fit
from shoal_flows.jobs import responded as respond

Picture = tuple[bytes, bytes]
"""The same picture as PNG and as SVG."""


@dataclass(frozen=True)
class Album:
    """Pictures of one optimisation: pictures and draws by the name of their file, the page, and its record."""

    pictures: dict[str, bytes]
    page: str
    archive: dict[str, Any]


def fitted(cell: Cell, measurement: Measurement) -> tuple[Fit, Album]:
    """One optimisation and what is shown of it."""
    found = fit(cell, measurement)
    return found, album(found)


def album(found: Fit) -> Album:
    """Every picture of a fit, and its page."""
    answer = Answer(load_problem(found.cell.problem), found.estimate)
    moving = motions(answer)
    drawn = gallery(answer, moving)
    pictures = {f"{one.name}.png": png(one.figure) for one in drawn}
    if found.estimate.posterior is not None:
        pictures["draws.nc"] = draws(found.estimate)
    return Album({**pictures, "motion.gif": moving_picture(answer)}, report(answer, moving, drawn), archived(answer))


def page(fits: Sequence[Fit]) -> str:
    """The page of a study, as `shoal report` makes it."""
    return study({found.cell.name: Answer(load_problem(found.cell.problem), found.estimate) for found in fits})


def responded(study: str, values: Mapping[str, Any]) -> tuple[Response, dict[str, bytes]]:
    """A study of uncertain parameters, and what is shown of it by the name of its file."""
    found, cases = respond(study, values)
    album = {"response.html": uncertainty(found).encode()}
    album |= {f"{marker}.png": png(response(found, marker)) for marker in found.markers}
    for k, case in enumerate(cases):
        album[f"worst-{k + 1}.yaml"] = as_yaml(case.scene.model_dump(mode="json", exclude_unset=True)).encode()
    return found, album


def moved(trajectory: Trajectory, scene: Scene, selection: Selection | None = None) -> dict[str, bytes]:
    """The page of a run, which moves, and its pictures, by the name of their file; of what cannot move the ladder."""
    try:
        moving = simulation.moved(trajectory, scene)
    except (InputError, ComputationError):
        return {} if selection is None else {"ladder.png": png(ladder(selection))}
    drawn = simulation.drawn(trajectory, scene, moving, selection)
    page = simulation.page(trajectory, scene, moving, drawn, selection)
    return {"motion.html": page.encode(), **{f"{one.name}.png": png(one.figure) for one in drawn}}


def rested(found: Equilibrium) -> bytes:
    """The machine at rest, and where it was placed."""
    return png(rest(found))


def draw_trajectory(fits: Sequence[Fit], name: str) -> Picture:
    """The model of the best fit over the data."""
    best = titles.best(_labelled(fits))
    return _both(overlay(best, f"{name}: {follows(best)}"))


def show_motion(fits: Sequence[Fit]) -> dict[str, Any]:
    """The motion of the best fit, as the macro `animation` of a page takes it."""
    best = titles.best(_labelled(fits))
    answer = Answer(load_problem(best.problem), best)
    return animation(motion(answer, next(iter(best.measurement.recordings))), "The identified machine")


def draw_convergence(fits: Sequence[Fit], name: str) -> Picture:
    """Fitness against evaluations."""
    return _both(convergence(_labelled(fits), titles.pays(name, _labelled(fits))))


def draw_residuals(fits: Sequence[Fit], name: str) -> Picture:
    """Draw the residuals of each method."""
    return _both(remainders(_labelled(fits), titles.leaves(name, _labelled(fits))))


def draw_mesh_error(fits: Sequence[Fit], name: str) -> Picture:
    """Error against mesh."""
    return _both(mesh_error(_labelled(fits), titles.refines(name, _labelled(fits))))


def draw_engines(comparison: Comparison, marker: str) -> Picture:
    """The engines over each other."""
    return _both(engines(comparison, marker, titles.agrees(comparison, marker)))


def _labelled(fits: Sequence[Fit]) -> dict[str, Estimate]:
    return {found.cell.name: found.estimate for found in fits}


def _both(figure: Figure) -> Picture:
    return png(figure), svg(figure)
