"""Results as files: what `--out FILE` of the command line writes. Imports wait: each command needs few of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from shoal.pictures import style

if TYPE_CHECKING:
    from shoal.engines.compare import Comparison
    from shoal.engines.sweep import Sweep
    from shoal.identification import Estimate, Problem
    from shoal.identification.design import Design
    from shoal.pictures.answer import Answer
    from shoal.scene import Scene
    from shoal.selection import Selection
    from shoal.trajectory import Trajectory


def trajectory(motion: Trajectory, scene: Scene, path: Path, selection: Selection | None = None) -> None:
    """`.html`: a page that moves; `.gif`: a moving picture; else the machine at a few instants.

    selection: how the model was chosen, for the page. Raises InputError, ComputationError.
    """
    from shoal.pictures.gif import gif
    from shoal.pictures.poses import poses
    from shoal.pictures.simulation import moved, simulation
    from shoal.pictures.titles import ends

    if path.suffix == ".html":
        path.write_text(simulation(motion, scene, selection), encoding="utf-8")
        return
    moving, trust = moved(motion, scene), "" if motion.ok else f" ({motion.status[0]}: not to be trusted)"
    title = f"{ends(scene.name, moving)}{trust}"
    if path.suffix == ".gif":
        path.write_bytes(gif(moving, title))
    else:
        _write(poses(moving, title), path)


def estimate(found: Estimate, problem: Problem, path: Path) -> None:
    """`.html`: a page with everything; `.gif`: the motion of the first recording; else the model over the data."""
    from shoal.pictures.answer import Answer
    from shoal.pictures.overlay import overlay
    from shoal.pictures.report import report

    answer = Answer(problem, found)
    if path.suffix == ".html":
        path.write_text(report(answer), encoding="utf-8")
    elif path.suffix == ".gif":
        path.write_bytes(moving_picture(answer))
    else:
        _write(overlay(found), path)


def moving_picture(answer: Answer) -> bytes:
    """The identified motion of the first recording as GIF."""
    from shoal.pictures.gif import gif
    from shoal.pictures.motion import motion
    from shoal.pictures.overlay import follows

    found = answer.estimate
    title = f"{found.problem}, {found.verdict}: {follows(found)}"
    return gif(motion(answer, next(iter(found.measurement.recordings))), title)


def design(found: Design, path: Path) -> None:
    """The candidates, and what duration does."""
    from shoal.pictures.design import design

    _write(design(found), path)


def sweep(result: Sweep, path: Path) -> None:
    """The displacement of the last marker."""
    from shoal.pictures.sweep import sweep

    _write(sweep(result, list(result.positions)[-1]), path)


def comparison(result: Comparison, path: Path) -> None:
    """The engines over each other at the last marker."""
    from shoal.pictures.engines import engines
    from shoal.pictures.titles import agrees

    last = list(result.scene.markers)[-1]
    _write(engines(result, last, agrees(result, last)), path)


def _write(figure: Figure, path: Path) -> None:
    path.write_bytes(style.png(figure))
