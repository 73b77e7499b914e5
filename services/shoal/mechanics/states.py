"""Coordinates and rates along a motion: sampled as if they were markers, a few at a time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.mechanics.gaps import KEPT
from shoal.mechanics.marched import Marched, sampled
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, Index


class States(NamedTuple):
    """States of the lanes of a model at sampled times: coordinates and rates, (samples, unknowns, lanes) each.

    contacts: what they do from that time on, see `gaps.keep`, (samples, contacts, KEPT, lanes); signals: those that the
    model records, (samples, signals, lanes)
    """

    model: Model
    q: Array
    v: Array
    contacts: Array
    signals: Array

    @classmethod
    def room(cls, model: Model, samples: int) -> States:
        """Not filled yet."""
        shapes = (model.unknowns,), (model.unknowns,), (model.gaps.size, KEPT), (len(model.recorded),)
        return cls(model, *(np.full((samples, *shape, model.lanes), np.nan) for shape in shapes))


def rows(model: Model) -> Index:
    """Return rows of points, and of unused directions, that hold all coordinates: flat, as in the time loop."""
    d = model.dimensions
    own = np.minimum(np.arange(_count(model) * d), model.unknowns - 1).reshape(-1, d)
    return np.concatenate([own, own], axis=1).ravel().astype(model.marker_rows.dtype)


def split(record: Marched, states: States, width: int, part: slice) -> Marched:
    """The record of a tile of some width without the coordinates, which go to the lanes of `states` in `part`."""
    model, d, lanes = states.model, states.model.dimensions, part.stop - part.start
    size = sampled(d)
    samples = record.samples.reshape(len(states.q), -1, size, width)
    markers = samples.shape[1] - _count(model)
    for found, first in ((states.q, 0), (states.v, 2 * d + 1)):
        numbers = samples[:, markers:, first : first + d, :lanes]
        found[..., part] = numbers.reshape(len(found), -1, lanes)[:, : model.unknowns]
    states.contacts[..., part] = record.contacts.reshape(*states.contacts.shape[:3], width)[..., :lanes]
    if record.signals.size:
        states.signals[..., part] = record.signals.reshape(*states.signals.shape[:2], width)[..., :lanes]
    return record._replace(samples=samples[:, :markers].ravel())


def _count(model: Model) -> int:
    """Return the number of points that hold all coordinates."""
    return -(-model.unknowns // model.dimensions)
