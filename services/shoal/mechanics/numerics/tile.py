"""Lanes and tiles: how one compiled kernel serves one scene or many side by side.

A quantity with one number per lane is stored flat, row by row, with the lanes of a tile last:
entry `row * width + lane`. The tile is passed as a tuple whose length is the width, which makes
the width a constant at compile time, so that loops over the lanes become vector instructions.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Tile = tuple[int, ...]

SINGLE: Tile = (0,)
WIDE: Tile = (0,) * 16


def tiles(lanes: int) -> tuple[Tile, list[slice]]:
    """The tile to use for so many lanes, and the lanes that each tile holds."""
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
