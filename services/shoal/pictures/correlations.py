"""Correlation matrix of the parameters."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.answer import Answer
from shoal.pictures.style import canvas, headline, styled

_FEW = 6
"""So many parameters leave room for large numbers."""


@styled
def correlations(answer: Answer) -> Figure:
    """Correlations of the estimated parameters: blue vary together, red against each other."""
    found, names = answer.correlation, answer.names
    size = min(7.0, 3.0 + 0.25 * len(names))
    figure, axes = canvas(size)
    # What a parameter has with itself says nothing.
    image = axes.imshow(np.where(np.eye(len(names)) > 0, np.nan, found), cmap="RdBu", vmin=-1, vmax=1)
    axes.grid(False)
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(names)), names)
    for row, column in np.ndindex(found.shape):
        value = found[row, column]
        text = _signed(float(value), 2) if np.isfinite(value) and row != column else ""
        colour = "white" if abs(value) > 0.6 else "black"
        axes.text(column, row, text, ha="center", va="center", fontsize=12 if len(names) <= _FEW else 8, color=colour)
    figure.colorbar(image, ax=axes, label="correlation", shrink=0.6)
    headline(figure, _says(answer))
    return figure


def strongest(answer: Answer) -> tuple[int, int]:
    """The two parameters with the largest correlation."""
    size = np.abs(np.triu(np.nan_to_num(answer.correlation), 1))
    row, column = np.unravel_index(int(np.argmax(size)), size.shape)
    return (int(row), int(column)) if row != column else (0, 1)


def _says(answer: Answer) -> str:
    one, other = strongest(answer)
    value = answer.correlation[one, other]
    if not np.isfinite(value):
        return f"{answer.problem.name}: correlations unknown"
    names = answer.names
    if abs(value) < 0.5:
        return f"{answer.problem.name}: each parameter shows by itself (|r| < 0.5)"
    return f"{answer.problem.name}: {names[one]}, {names[other]} are tied (r = {_signed(float(value), 3)})"


def _signed(value: float, digits: int) -> str:
    """With its sign, a minus and not a hyphen."""
    return f"{value:+.{digits}f}".replace("-", "−")
