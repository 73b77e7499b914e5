"""Pictures as files: what `--out FILE.png` of the command line writes."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.identification import Estimate, Problem
from shoal.identification.design import Design
from shoal.pictures import design as designing
from shoal.pictures import engines as comparing
from shoal.pictures import style
from shoal.pictures import sweep as sweeping
from shoal.pictures.answer import Answer
from shoal.pictures.gif import gif
from shoal.pictures.motion import motion
from shoal.pictures.overlay import overlay
from shoal.pictures.report import report
from shoal.scene import Scene
from shoal.trajectory import Trajectory


def trajectory(motion: Trajectory, scene: Scene, path: Path) -> None:
    """The paths of all markers in the plane, to equal scale."""
    colours = (style.BLUE, style.ORANGE, style.GREEN, style.VERMILION, style.PURPLE, style.SKY)
    figure, axes = style.canvas(5.6)
    for k, name in enumerate(motion.markers):
        x, y = motion.marker(name).T
        colour = colours[k % len(colours)]
        axes.plot(x, y, color=colour, label=name)
        axes.plot(x[-1], y[-1], "o", color=colour)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(f"{scene.name}: where the markers go until {motion.times[-1]:g} s")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend()
    _write(figure, path)


def estimate(found: Estimate, problem: Problem, path: Path) -> None:
    """`.html`: a page with everything; `.gif`: the motion of the first recording; else the model over the data."""
    answer = Answer(problem, found)
    if path.suffix == ".html":
        path.write_text(report(answer), encoding="utf-8")
    elif path.suffix == ".gif":
        first = next(iter(found.measurement.recordings))
        path.write_bytes(gif(motion(answer, first, frames=60), f"{found.problem}: {found.verdict}"))
    else:
        _write(overlay(found), path)


def design(found: Design, path: Path) -> None:
    """The candidates, and what duration does."""
    _write(designing.design(found), path)


def sweep(result: Sweep, path: Path) -> None:
    """The displacement of the last marker."""
    _write(sweeping.sweep(result, list(result.positions)[-1]), path)


def comparison(result: Comparison, path: Path) -> None:
    """The engines over each other at the last marker."""
    last = list(result.scene.markers)[-1]
    _write(comparing.engines(result, last, f"{result.scene.name}: {last} by each engine"), path)


def _write(figure: Figure, path: Path) -> None:
    path.write_bytes(style.png(figure))
