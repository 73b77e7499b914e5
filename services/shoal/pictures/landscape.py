"""The fitness over two parameters: valleys, other minima, and how long the valley of the answer is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from shoal.pictures import units
from shoal.pictures.answer import Answer
from shoal.pictures.numbers import rounded
from shoal.pictures.style import SKY, VERMILION, canvas, headline, styled
from shoal.trajectory import Array

_CHI_95 = 5.991
"""95 % point of chi squared with two degrees of freedom."""
_SIGMAS = 5.0
_CHUNK = 500


@dataclass(frozen=True)
class Landscape:
    """Fitness on a grid of two parameters, (first, second), inf where a simulation failed; the others stay put.

    pair: their places in the vector; first, second: grid values as the vector has them
    """

    pair: tuple[int, int]
    first: Array
    second: Array
    fitness: Array
    zoomed: bool


def survey(answer: Answer, pair: tuple[int, int], *, zoom: bool = False, size: int = 31) -> Landscape:
    """The fitness around an answer: over the whole box, or (zoom) five standard deviations to each side."""
    axes = [_span(answer, k, zoom, size) for k in pair]
    first, second = np.meshgrid(*axes, indexing="ij")
    points = np.repeat(answer.point[None], first.size, axis=0)
    points[:, pair[0]], points[:, pair[1]] = first.ravel(), second.ravel()
    parts = np.array_split(points, -(-len(points) // _CHUNK))
    fitness = np.concatenate([answer.model.cost(answer.model.uncounted(part)) for part in parts])
    return Landscape(pair, axes[0], axes[1], fitness.reshape(first.shape), zoom)


def _span(answer: Answer, k: int, zoom: bool, size: int) -> Array:
    lower, upper = answer.model.lower[k], answer.model.upper[k]
    if zoom:
        half = _SIGMAS * float(np.sqrt(answer.linearised.covariance[k, k])) or 1e-3 * (upper - lower)
        lower, upper = max(lower, answer.point[k] - half), min(upper, answer.point[k] + half)
    return np.linspace(lower, upper, size)


@styled
def landscape(answer: Answer, found: Landscape) -> Figure:
    """Contours of the fitness with the answer, other ends of searches, and the 95 % ellipse of the noise alone."""
    figure, axes = canvas(5.2)
    to_values = answer.model.parameters.to_values
    grid = [np.repeat(answer.point[None], len(x), axis=0) for x in (found.first, found.second)]
    for place, k, x in zip(grid, found.pair, (found.first, found.second), strict=True):
        place[:, k] = x
    first, second = (to_values(place)[:, k] for place, k in zip(grid, found.pair, strict=True))
    with np.errstate(divide="ignore"):
        level = np.log10(np.where(np.isfinite(found.fitness), np.maximum(found.fitness, 1e-300), np.nan))
    image = axes.contourf(first, second, level.T, levels=24, cmap="cividis")
    axes.grid(False)
    label = f"log10 of the fitness [{units.fitness_unit(answer.estimate)}]"
    figure.colorbar(image, ax=axes, label=label, ticks=MaxNLocator(7))
    _mark(axes, answer, found)
    for k, setter in zip(found.pair, (axes.set_xlabel, axes.set_ylabel), strict=True):
        setter(units.parameter(answer.problem, answer.names[k]))
    for k, name in zip(found.pair, ("x", "y"), strict=True):
        if answer.model.parameters.logarithmic[k] and not found.zoomed:
            getattr(axes, f"set_{name}scale")("log")
        else:
            axes.locator_params(axis=name, nbins=5)
    axes.set_xlim(first[0], first[-1])
    axes.set_ylim(second[0], second[-1])
    headline(figure, _says(answer, found))
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2)
    return figure


def _mark(axes: Axes, answer: Answer, found: Landscape) -> None:
    one, other = found.pair
    names = answer.names
    inside: dict[str, Any] = {"linestyle": "none", "markeredgecolor": "black"}
    minima = answer.estimate.minima
    if minima and len(names) == 2:
        places = [(m[names[one]], m[names[other]]) for m in minima]
        axes.plot(
            *zip(*places, strict=True),
            marker="o",
            color=SKY,
            markersize=8,
            label="where other searches ended",
            **inside,
        )
    if found.zoomed and has_ellipse(answer):
        values = answer.model.parameters.to_values(_ellipse(answer, found.pair))
        # The white rim shows the line on any colour.
        axes.plot(values[:, one], values[:, other], color="white", linewidth=3.5)
        axes.plot(values[:, one], values[:, other], color=VERMILION, label="95 %, noise alone, others fixed")
    answer_values = answer.model.parameters.to_values(answer.point)
    place = ([answer_values[one]], [answer_values[other]])
    axes.plot(*place, marker="*", color=VERMILION, markersize=13, label="the answer", **inside)


def has_ellipse(answer: Answer) -> bool:
    """Return whether the covariance is regular; it is not where a direction is open."""
    return not answer.linearised.unknown.size


def _ellipse(answer: Answer, pair: tuple[int, int]) -> Array:
    """Points of the 95 % ellipse with all other parameters fixed, (points, parameters)."""
    information = np.linalg.inv(answer.linearised.covariance)[np.ix_(pair, pair)]
    values, vectors = np.linalg.eigh(information)
    turn = np.linspace(0, 2 * np.pi, 200)
    with np.errstate(divide="ignore"):
        radii = np.sqrt(_CHI_95 / np.maximum(values, 1e-300))
    points = np.repeat(answer.point[None], len(turn), axis=0)
    points[:, pair] += (vectors @ (radii[:, None] * np.array([np.cos(turn), np.sin(turn)]))).T
    return points


def _says(answer: Answer, found: Landscape) -> str:
    others = len(answer.names) - 2
    fixed = f", the other {f'{others} parameters' if others > 1 else 'parameter'} fixed" if others else ""
    if found.zoomed:
        return f"{answer.problem.name}: {' and '.join(_known(answer, k) for k in found.pair)}{fixed}"
    count = _local_minima(found.fitness)
    return f"{answer.problem.name}: the whole box has {count} hollow{'' if count == 1 else 's'} on this grid{fixed}"


def _known(answer: Answer, k: int) -> str:
    """A parameter with half of its interval."""
    name = answer.names[k]
    value = answer.estimate.parameters[name]
    if not value.identifiable:
        return f"{name} is not known"
    half = (value.upper - value.lower) / 2
    verb = "is" if answer.estimate.verdict.trusted else "fits at"
    return f"{name} {verb} {rounded(value.value, half)} ± {rounded(half, half)} {value.unit}".strip()


def _local_minima(fitness: Array) -> int:
    """Grid points below all eight neighbours, the rim included."""
    padded = np.pad(fitness, 1, constant_values=np.inf)
    rows, columns = fitness.shape
    shifts = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    below = [fitness < padded[i : i + rows, j : j + columns] for i, j in shifts]
    return int(np.all(below, axis=0).sum())
