"""Pictures of error against time; lower left is better."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal_validation.work_precision.contract import MANY, OURS, Point
from shoal_validation.work_precision.converged import converged
from shoal_validation.work_precision.front import front
from shoal_validation.work_precision.gauss import SCENE_MESH
from shoal_validation.work_precision.measure import Study
from shoal_validation.work_precision.table import costs

# Colours of Okabe and Ito, told apart with every kind of colour vision; markers and lines differ as well.
LOOKS: dict[str, dict[str, Any]] = {
    OURS: {"color": "#0072B2", "marker": "o", "linestyle": "-"},
    MANY: {"color": "#56B4E9", "marker": "v", "linestyle": "--"},
    "Exudyn": {"color": "#D55E00", "marker": "s", "linestyle": "-"},
    "CasADi": {"color": "#009E73", "marker": "^", "linestyle": "-."},
    "scipy": {"color": "#CC79A7", "marker": "D", "linestyle": ":"},
    "MuJoCo": {"color": "#4D4D4D", "marker": "P", "linestyle": "--"},
}
PAPER = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8}
MARKERS = "os^Dv*Ph"
LINES = ("-", "--", "-.", ":")
MESSAGE = 1e-3
"""Error [m] whose cost a title tells."""
ON_MESH = 1e-4
"""The same for the error on one mesh."""
NAMED = 11
"""Names of the front that the height of a picture has room for."""
WIDE = 8.6
"""Width of a picture [in]: its letters are then as large as those of the page that shows it."""


def flexible(study: Study) -> Figure:
    """Continuum error above; below error in time on the mesh on which integrators are compared, where it is known."""
    meshed = any(point.mesh_error for point in study.points)
    count = 2 if meshed else 1
    figure, axes = plt.subplots(count, 1, figsize=(WIDE, 6.75 * count), layout="constrained", squeeze=False)
    above = axes[0, 0]
    _families(above, study, NAMED)
    above.set_ylabel(f"largest error of {study.problem.marker} against the converged beam [m]")
    above.set_title(_message(study), loc="left")
    above.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=5, frameon=False)
    if meshed:
        _integrators(axes[1, 0], study)
    return figure


def rigid(studies: Sequence[Study]) -> Figure:
    """One panel per problem."""
    columns = min(2, len(studies))
    rows = -(-len(studies) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(WIDE, 4.9 * rows), layout="constrained", squeeze=False)
    for axis, study in zip(axes.flat, studies, strict=False):
        _families(axis, study, NAMED - 4)
        axis.set_ylabel(f"largest error of {study.problem.marker} [m]")
        axis.set_title(_message(study), loc="left", fontsize=10.5)
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, frameon=False)
    for axis in list(axes.flat)[len(studies) :]:
        axis.set_axis_off()
    return figure


def _families(axis: Axes, study: Study, most: int) -> None:
    """Every believed point, faint; the front of each family as a staircase; up to `most` names on the front of all."""
    floor = study.problem.reference.error
    for family, look in LOOKS.items():
        points = [p for p in study.points if p.family == family and p.ok]
        if not points:
            continue
        faint = {**look, "linestyle": "none"}
        axis.plot(*_places(points, floor), **faint, markersize=3.5, alpha=0.3)
        best = front(points, floor)
        axis.plot(*_places(best, floor), **look, markersize=6, drawstyle="steps-post", label=family, linewidth=1.8)
    singles = front([p for p in study.points if p.family != MANY], floor)
    for point in _spread(singles, floor, most):
        name = point.label.removeprefix(f"{OURS}, ").replace(", step", " at").replace(", tolerance", "")
        place = (point.seconds * 1e3, max(point.error, floor))
        axis.annotate(name, place, (-5, -10), textcoords="offset points", fontsize=9, ha="right", bbox=PAPER)
    _finish(axis, floor, "reference's own error")
    # Room for the names, which stand to the left of the front.
    axis.set_xlim(left=axis.get_xlim()[0] / 15)


def _spread(points: list[Point], floor: float, most: int) -> list[Point]:
    """Those of a front whose errors are far enough apart for their names not to cover each other."""
    if not points:
        return []
    heights = [np.log10(max(p.error, floor)) for p in points]
    gap = (heights[0] - min(heights[-1], np.log10(floor))) / most
    found, last = [], np.inf
    for point, height in zip(points, heights, strict=True):
        # At the floor stands its own name.
        if last - height >= gap and point.error > floor:
            found.append(point)
            last = height
    return found


def _integrators(axis: Axes, study: Study) -> None:
    """Every method on the scene's own mesh against the time-converged motion of that mesh."""
    reference = converged(study.problem, SCENE_MESH)
    assert reference is not None
    on_mesh = [p for p in study.points if p.mesh in (SCENE_MESH, SCENE_MESH.replace("C", "G")) and p.mesh_error]
    curves = list(dict.fromkeys((p.family, p.method, p.mesh) for p in on_mesh if p.family != MANY))
    seen = dict.fromkeys(LOOKS, 0)
    for family, method, mesh in curves:
        points = [p for p in on_mesh if (p.family, p.method, p.mesh) == (family, method, mesh)]
        k = seen[family]
        seen[family] += 1
        label = f"{family}: {method}" + (" (geometrically exact)" if mesh != SCENE_MESH else "")
        places = [p.seconds * 1e3 for p in points], [max(p.mesh_error or 0.0, reference.error) for p in points]
        look = {"color": LOOKS[family]["color"], "marker": MARKERS[k % 8], "linestyle": LINES[k % 4]}
        axis.plot(*places, **look, markersize=5, linewidth=1.4, label=label)
    axis.set_ylabel(f"largest error of {study.problem.marker} against the same mesh, converged in time [m]")
    there = [p for p in on_mesh if p.mesh_error is not None and p.mesh_error <= ON_MESH]
    best = {p.family: p for p in sorted(there, key=lambda point: -point.seconds)}
    took = ", ".join(f"{family} {best[family].seconds * 1e3:.3g} ms" for family in (OURS, "Exudyn") if family in best)
    axis.set_title(f"The integrator alone, on the mesh {SCENE_MESH}\n{ON_MESH * 1e3:g} mm: {took}", loc="left")
    _finish(axis, reference.error, "own error of the time-converged motion")
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize=9.5, frameon=False)


def _finish(axis: Axes, floor: float, floor_name: str) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.axhline(floor, color="#888888", linewidth=1, linestyle=(0, (1, 3)))
    below = axis.get_yaxis_transform()
    axis.text(0.99, floor * 0.85, floor_name, transform=below, ha="right", va="top", fontsize=9)
    axis.set_ylim(bottom=floor / 5)
    axis.set_xlabel("time of one simulation [ms]")
    axis.grid(visible=True, which="major", alpha=0.3)


def _places(points: list[Point], floor: float) -> tuple[list[float], list[float]]:
    return [p.seconds * 1e3 for p in points], [max(p.error, floor) for p in points]


def _message(study: Study) -> str:
    """The picture in one line, from its own numbers: what 1 mm costs, and the smallest error that both reach."""
    lines = costs(study)
    both = [line for line in lines if line.ours and line.exudyn]
    shown = [line for line in lines if line.reach == MESSAGE or line in both[-1:]]
    return "\n".join(
        [study.problem.name]
        + [f"{line.reach * 1e3:g} mm: ours {_took(line.ours)}, Exudyn {_took(line.exudyn)}" for line in shown]
    )


def _took(point: Point | None) -> str:
    if point is None:
        return "not in the time given"
    return f"{point.seconds * 1e3:.3g} ms" if point.seconds < 1 else f"{point.seconds:.3g} s"
