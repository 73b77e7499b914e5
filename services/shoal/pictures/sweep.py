"""Displacement of a marker over a grid of values: the paper's Figure 4."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.engines.sweep import Sweep
from shoal.errors import InputError
from shoal.pictures.numbers import length
from shoal.pictures.style import BLACK, BLUE, ORANGE, canvas, headline, styled
from shoal.pictures.units import labelled
from shoal.trajectory import Array, Status


def _directions(moved: Array) -> tuple[str, ...]:
    return ("horizontal", "vertical") if moved.shape[1] == 2 else ("along x", "along y", "along z")


@styled
def sweep(result: Sweep, marker: str) -> Figure:
    """One value: displacement along every axis as lines. Two values: as maps. Raises InputError for more."""
    if len(result.grid) == 1:
        return _lines(result, marker)
    if len(result.grid) == 2:
        return _maps(result, marker)
    raise InputError(f"vary: a sweep over {len(result.grid)} values has no picture; draw one over one or two")


def _moved(result: Sweep, marker: str) -> Array:
    good = np.array([status is Status.OK for status in result.status])
    return np.where(good[:, None], result.displacements[marker], np.nan)


def _says(result: Sweep, marker: str, moved: Array) -> str:
    """From where a marker has moved farthest."""
    size, after = np.linalg.norm(moved, axis=1), f"after {result.time:g} s"
    if not np.any(np.isfinite(size)):
        return f"{result.scene.name}: no point of the sweep can be trusted {after}"
    most = int(np.nanargmax(size))
    place = ", ".join(f"{path} = {values[most]:.3g}" for path, values in result.grid.items())
    far = f"{result.scene.name}: {after} {marker} has moved farthest, {length(float(size[most]))}, from {place}"
    left = sum(status is not Status.OK for status in result.status)
    far += f"; {left} of {len(result.status)} points failed" if left else ""
    return f"{far}; known error {length(result.errors.total)}" if result.errors.estimates else far


def _lines(result: Sweep, marker: str) -> Figure:
    (path, values), moved = next(iter(result.grid.items())), _moved(result, marker)
    figure, axes = canvas()
    styles = ((BLUE, "-"), (ORANGE, "--"), (BLACK, ":"))
    for part, direction, (color, line) in zip(moved.T, _directions(moved), styles, strict=False):
        axes.plot(values, part, color=color, linestyle=line, label=direction)
        if result.errors.total is not None:
            axes.fill_between(values, part - result.errors.total, part + result.errors.total, color=color, alpha=0.15)
    headline(figure, _says(result, marker, moved))
    axes.set_xlabel(labelled(path))
    axes.set_ylabel(f"displacement of {marker} [m]")
    axes.legend()
    return figure


def _maps(result: Sweep, marker: str) -> Figure:
    (one, first), (other, second) = result.grid.items()
    moved = _moved(result, marker)
    x, y = np.unique(first), np.unique(second)
    directions = _directions(moved)
    figure, axes = canvas(3.3 * len(directions), nrows=len(directions), sharex=True)
    for k, (panel, direction) in enumerate(zip(axes, directions, strict=True)):
        image = panel.pcolormesh(x, y, moved[:, k].reshape(len(x), len(y)).T, cmap="viridis", shading="nearest")
        figure.colorbar(image, ax=panel, label=f"{direction} [m]")
        panel.set_ylabel(labelled(other))
        panel.grid(False)
    headline(figure, _says(result, marker, moved))
    axes[-1].set_xlabel(labelled(one))
    return figure
