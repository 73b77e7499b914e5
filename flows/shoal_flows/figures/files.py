"""Pictures as files: what `--out FILE.png` of the command line writes."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure
from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.identification import Estimate
from shoal.scene import Scene
from shoal.trajectory import Trajectory

from shoal_flows.figures import engines as comparing
from shoal_flows.figures import style
from shoal_flows.figures import sweep as sweeping
from shoal_flows.figures import trajectory as fitting
from shoal_flows.jobs import Cell, with_motion


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


def estimate(found: Estimate, path: Path) -> None:
    """The identified motion over the measured one."""
    fit = with_motion(Cell(found.problem, found.method, found.seed, found.engine), found)
    _write(fitting.trajectory(fit, f"{found.problem}: {found.verdict}, {found.evaluations} simulations"), path)


def sweep(result: Sweep, path: Path) -> None:
    """The displacement of the last marker."""
    _write(sweeping.sweep(result, list(result.positions)[-1]), path)


def comparison(result: Comparison, path: Path) -> None:
    """The engines over each other at the last marker."""
    last = list(result.scene.markers)[-1]
    _write(comparing.engines(result, last, f"{result.scene.name}: {last} by each engine"), path)


def _write(figure: Figure, path: Path) -> None:
    path.write_bytes(style.png(figure))
