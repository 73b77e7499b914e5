"""A sweep in pieces that are simulated side by side, and their union."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shoal.engines.sweep import Sweep
from shoal.trajectory import Array

_EACH = 4
"""Pieces for each worker."""
_SMALLEST = 64
"""Points below which a piece is not worth its message."""


def pieces(vary: Mapping[str, Array], workers: int) -> list[dict[str, Array]]:
    """A grid (path -> values) cut along its first axis so that no worker waits long for another."""
    first, *others = vary
    points = int(np.prod([values.size for values in vary.values()]))
    count = min(vary[first].size, _EACH * workers, -(-points // _SMALLEST))
    return [{first: part, **{path: vary[path] for path in others}} for part in np.array_split(vary[first], count)]


def joined(parts: Sequence[Sweep]) -> Sweep:
    """The pieces of a grid, in their order, as the whole; the time is the sum."""
    return replace(
        parts[0],
        grid=_stacked([part.grid for part in parts]),
        positions=_stacked([part.positions for part in parts]),
        displacements=_stacked([part.displacements for part in parts]),
        status=tuple(status for part in parts for status in part.status),
        wall_s=sum(part.wall_s for part in parts),
    )


def _stacked(columns: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([column[name] for column in columns]) for name in columns[0]}
