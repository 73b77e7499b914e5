"""Lanes and tiles: how one compiled kernel serves one scene or many side by side.

A quantity with one number per lane is stored flat, row by row, with the lanes of a tile last:
entry `row * width + lane`. The tile is passed as a tuple whose length is the width, which makes
the width a constant at compile time, so that loops over the lanes become vector instructions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
"""Yes or no, by lane or by lane and pose."""
Tile = tuple[int, ...]
Number = Any
"""A real scalar, or an array of one number per lane."""

SINGLE: Tile = (0,)
WIDE: Tile = (0,) * 16


def tiles(lanes: int) -> tuple[Tile, list[slice]]:
    """Return the tile for a number of lanes, and the lanes of each tile."""
    tile = SINGLE if lanes == 1 else WIDE
    return tile, [slice(begin, min(begin + len(tile), lanes)) for begin in range(0, lanes, len(tile))]


def pack(values: Array, lanes: slice, tile: Tile) -> Array:
    """The flat storage of one tile. values: (rows, lanes) or (rows, 1); a short tile repeats its last lane."""
    rows = values.shape[0]
    if values.shape[1] == 1:
        return np.repeat(values, len(tile), axis=1).ravel()
    part = values[:, lanes]
    flat = np.empty((rows, len(tile)))
    flat[:, : part.shape[1]] = part
    flat[:, part.shape[1] :] = part[:, -1:]
    return flat.ravel()


def unpack(flat: Array, lanes: slice, tile: Tile) -> Array:
    """Back from flat storage to (rows, lanes of the tile)."""
    return flat.reshape(-1, len(tile))[:, : lanes.stop - lanes.start]


def stacked(values: Sequence[Any]) -> Array:
    """One row per value, a number or one per lane: (rows, lanes), or (rows, 1) if none depends on the lane."""
    lanes = max((np.size(value) for value in values), default=1)
    out = np.empty((len(values), lanes))
    for row, value in enumerate(values):
        out[row] = value
    return out


def index(values: Sequence[Any]) -> Index:
    """Whole numbers as kernels take them."""
    return np.array(values, dtype=np.int64)


def packed(structure: Any, lanes: slice, tile: Tile) -> Any:
    """A structure for one tile: of it and of its parts every array (rows, lanes) is packed, the rest as it is."""
    if isinstance(structure, np.ndarray):
        return pack(structure, lanes, tile) if structure.ndim == 2 else structure
    if isinstance(structure, tuple):
        parts = [packed(part, lanes, tile) for part in structure]
        return structure._make(parts) if hasattr(structure, "_make") else tuple(parts)
    return structure


def varies(structure: Any) -> bool:
    """Return whether any number of a structure depends on the lane."""
    if isinstance(structure, np.ndarray):
        return structure.ndim == 2 and structure.shape[1] > 1
    return isinstance(structure, tuple) and any(varies(part) for part in structure)
