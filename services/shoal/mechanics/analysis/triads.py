"""The axes of a body at a place in space, and how they turn, along a motion.

The sections of a director rod are carried along as its element carries them (see `elements.director`). Rates are
derivatives along the motion by a complex step, which are exact.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shoal.mechanics.affine import Affine, points
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.numerics.tile import Array

_STEP = 1e-30

Vectors = Callable[[list[Affine]], Any]
"""The values of vectors, (vectors, samples, 3)."""


def along(frame: RigidFrame | BeamFrame, place: tuple[Any, ...], q: Array, v: Array, lane: int) -> tuple[Array, Array]:
    """Unit vectors along the axes, as rows, and their rates, (samples, 3, 3) each.

    q, v: coordinates and rates, (samples, unknowns), of a lane of the frame's model
    """

    def values(vectors: list[Affine]) -> Any:
        found = points(vectors, q.shape[1], lane)
        return np.einsum("kdu,nu->knd", found.matrix, q + 1j * _STEP * v) + found.constant[:, None]

    if isinstance(frame, BeamFrame):
        axes = _section(frame, place, lane, values)
    else:
        axes = [_unit(director) for director in values(list(frame.directors))]
    rows = np.stack(axes, axis=1)
    return np.asarray(rows.real), np.asarray(rows.imag / _STEP)


def _section(frame: BeamFrame, place: tuple[Any, ...], lane: int, values: Vectors) -> list[Any]:
    """The axes of a section of a director rod: along it, y and z."""
    elements = len(frame.nodes) - 1
    length = np.ravel(frame.element_length)
    where = float(np.ravel(place[0])[0] / length[lane % length.size])
    number = min(int(where + 1e-9), elements - 1)
    x = where - number
    middle = ((number + 0.5) * frame.element_length, 0.0, 0.0)
    begin, end = frame.nodes[number], frame.nodes[number + 1]
    lines = [begin[1], end[1], frame.direction(middle), frame.direction(place)]
    t1, t2, tm, t = (_unit(line) for line in values(lines))
    d1, d2 = values([begin[2], end[2]])
    m1, m2 = _carried(d1, t1, tm), _carried(d2, t2, tm)
    phi = np.arctan2(_dot(tm, np.cross(m1, m2)).real, _dot(m1, m2).real)
    phi = phi + 1j * _rate(phi, _dot(tm, np.cross(m1, m2)), _dot(m1, m2))
    halfway = _unit(m1 + m2)
    turn = phi * (x - 0.5)
    e = np.cos(turn)[:, None] * halfway + np.sin(turn)[:, None] * np.cross(tm, halfway)
    d = _unit(_carried(e, tm, t))
    other = np.cross(t, d)
    return [t, d, other] if frame.element.director == 1 else [t, -other, d]


def _rate(phi: Any, sine: Any, cosine: Any) -> Any:
    """The imaginary part of the angle whose sine and cosine are complex, to first order."""
    return (sine.imag * np.cos(phi) - cosine.imag * np.sin(phi)) / np.hypot(sine.real, cosine.real)


def _carried(d: Any, t: Any, tm: Any) -> Any:
    """A direction carried from t to tm by the smallest rotation."""
    return d - (_dot(d, tm) / (1.0 + _dot(t, tm)))[:, None] * (t + tm)


def _unit(u: Any) -> Any:
    return u / np.sqrt(_dot(u, u))[:, None]


def _dot(u: Any, w: Any) -> Any:
    return np.sum(u * w, axis=-1)
