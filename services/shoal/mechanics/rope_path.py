"""The path of a rope in the plane: directions of its spans, angles of contact, and the path as a polyline."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shoal.mechanics.numerics.tile import Array

TURN = 2.0 * np.pi
ARC = 0.1
"""Angle of a piece of an arc that is drawn [rad], which is off it by a thousandth of the radius."""
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


def rope_path(centres: Array, radii: Sequence[float], turns: Sequence[int] | None = None) -> list[Array]:
    """Return the path of a rope at each of some frames as a polyline, (points, 2) [m].

    centres: of its places in their order, (frames, places, 2) [m]; radii: signed, positive where the rope turns
    counter-clockwise around the place, 0 of fixed ends and eyes [m]; turns: whole turns around the places between
    """
    along, length = tangents(centres, radii)
    signed = np.asarray(radii, dtype=float)
    count = len(signed) - 2
    wrapped = wraps(along, radii, [0] * count if turns is None else turns)
    found = []
    for frame, places in enumerate(centres):
        t = along[frame]
        normal = np.stack([-t[:, 1], t[:, 0]], axis=1)
        start = places[:-1] - signed[:-1, None] * normal
        end = start + length[frame, :, None] * t
        pieces = [start[:1]]
        for k in range(count):
            pieces.append(end[k : k + 1])
            if signed[k + 1]:
                sweep = np.sign(signed[k + 1]) * max(float(wrapped[frame, k]), 0.0)
                turned = np.linspace(0.0, sweep, max(int(abs(sweep) / ARC), 1) + 1)
                arm = end[k] - places[k + 1]
                cosine, sine = np.cos(turned), np.sin(turned)
                arc = np.stack([arm[0] * cosine - arm[1] * sine, arm[0] * sine + arm[1] * cosine], axis=1)
                pieces.append(places[k + 1] + arc[1:])
        pieces.append(end[-1:])
        found.append(np.concatenate(pieces))
    return found
