"""The path of a rope in the plane: directions and ends of its spans, and angles of contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shoal.mechanics.numerics.tile import Array

TURN = 2.0 * np.pi
ROUND = 1e-9
"""A rope that goes past a pulley in a straight line touches it, but for this angle [rad]."""


def tangents(centres: Array, radii: Sequence[float]) -> tuple[Array, Array]:
    """Return the directions t and the lengths s of the spans, (..., spans, 2) and (..., spans); nan where none is.

    centres: of the places, (..., places, 2) [m]; radii: signed, positive where it turns counter-clockwise [m]
    """
    way, signed = np.diff(centres, axis=-2), np.asarray(radii, dtype=float)
    c = signed[:-1] - signed[1:]
    square = np.sum(way**2, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        length = np.sqrt(square - c**2)
        x, y = way[..., 0], way[..., 1]
        along = np.stack([x * length - y * c, y * length + x * c], axis=-1) / square[..., None]
    return along, length


def wraps(along: Array, radii: Sequence[float], turns: Sequence[int]) -> Array:
    """Return the angles of contact with the places between spans at successive samples [rad], (samples, guides, ...).

    along: directions of the spans, (samples, spans, 2, ...); turns: whole turns at the first sample
    """
    angle = np.unwrap(np.arctan2(along[:, :, 1], along[:, :, 0]), axis=0)
    sense = np.sign(np.asarray(radii, dtype=float))[1:-1].reshape(-1, *(1,) * (angle.ndim - 2))
    bend = sense * np.diff(angle, axis=1)
    begin = np.mod(bend[:1] + ROUND, TURN) - ROUND
    return np.asarray(bend - bend[:1] + begin + TURN * np.reshape(turns, sense.shape))


def spans(centres: Array, radii: Sequence[float]) -> tuple[Array, Array]:
    """Return where each span leaves one circle and meets the next [m], (..., spans, 2) each; see `tangents`.

    A span that is none, as circles lie in each other, goes from centre to centre.
    """
    along, _ = tangents(centres, radii)
    signed = np.asarray(radii, dtype=float)[:, None]
    normal = np.nan_to_num(np.stack([-along[..., 1], along[..., 0]], axis=-1))
    return centres[..., :-1, :] - signed[:-1] * normal, centres[..., 1:, :] - signed[1:] * normal
