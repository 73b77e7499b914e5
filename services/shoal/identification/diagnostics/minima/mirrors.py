"""Mirror images of an answer: other starts of the machine that the measured channels may not distinguish.

A height alone is the same for the machine reflected about the axis of gravity, a tip is the same for both elbows. From
the answer such starts follow by reflections and half turns of its angles, in space of the machine, and by other poses
that show what its own shows; and others by a turn more from each sample to the next. Those whose channels begin alike
are simulated, and those that fit are followed to their minimum. An image that a descent from the answer itself reaches
is none.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import combinations, product

import numpy as np

from shoal.identification.conventions import GROSS, HARDLY
from shoal.identification.diagnostics.minima.other_starts import mirrored, turned, within_bounds
from shoal.identification.diagnostics.minima.rivals import apart
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import DESCENTS, FEW, Descent, descend_many, kept_apart
from shoal.identification.methods.outcome import Outcome
from shoal.identification.methods.starts import poses_at
from shoal.trajectory import Array

_MOST = 256
"""Images by each combination of reflections; of machines with more only those of all angles, and of single ones."""


def mirror_images(model: ForwardModel, outcome: Outcome) -> list[Descent]:
    """Return the ends of descents from images that fit about as well as the answer. Raises TimeIsUp."""
    # Where a body turns more often it begins where it does in the answer.
    more = kept_apart([outcome.point, *turned(model, outcome.point)], partial(apart, model))[1 : 1 + 2 * DESCENTS]
    points = np.array([*_alike(model, outcome.point, images(model, outcome.point)), *more])
    if not len(points):
        return []
    values = model.cost(model.uncounted(points))
    left = np.sqrt(np.maximum(values - outcome.fitness, 0.0) * model.rows.samples / len(model.rows.time))
    good = [k for k in np.argsort(values, kind="stable") if left[k] < HARDLY * model.rows.signal][:FEW]
    if not good:
        return []
    *descents, own = descend_many(model, np.vstack([points[good], outcome.point]))
    # What a descent from the answer itself reaches is no image of it: there the method has not ended.
    return [descent for descent in descents if apart(model, descent.point, own.point)]


def images(model: ForwardModel, point: Array) -> Array:
    """Starts that might show the same, within the bounds, (images, parameters)."""
    inside = (within_bounds(model, candidate) for candidate in _candidates(model, point))
    found = kept_apart([point, *(one for one in inside if one is not None)], partial(apart, model))
    return np.array(found[1:]).reshape(-1, len(point))


def _candidates(model: ForwardModel, point: Array) -> Iterator[Array]:
    """Images by reflections of the start, by poses that show the same, by changed signs and exchanged values."""
    recordings = tuple(model.measurement.recordings)
    for name in recordings:
        yield from mirrored(model, point, name)
    groups = [recordings, *((name,) for name in recordings)] if len(recordings) > 1 else [recordings]
    for group in groups:
        yield from _reflected(model, point, group)
    for name in recordings:
        yield from poses_at(model, point, name)
    values = model.parameters.to_values(point)
    fields = [path.rpartition(".")[2] for path in model.parameters.paths]
    states = model.parameters.initial
    for k in range(len(point)):
        if not states[k] and model.lower[k] < 0.0 < model.upper[k] and not model.parameters.logarithmic[k]:
            changed = point.copy()
            changed[k] = -point[k]
            yield changed
    for one, other in combinations(range(len(point)), 2):
        if fields[one] and fields[one] == fields[other] and not states[one] and not states[other]:
            exchanged = values.copy()
            exchanged[[one, other]] = values[[other, one]]
            yield model.parameters.to_vector(exchanged)


def _reflected(model: ForwardModel, point: Array, recordings: tuple[str, ...]) -> Iterator[Array]:
    """Each angle kept, reflected about the axis of gravity or across it, or turned by half a turn, with its rate."""
    gravity = model.scene.gravity
    axis = float(np.arctan2(gravity[1], gravity[0])) if any(gravity) else -np.pi / 2
    bodies: dict[tuple[str | None, str], dict[str, int]] = {}
    others: list[int] = []
    for k, (path, entry) in enumerate(zip(model.parameters.paths, model.parameters.entries.values(), strict=True)):
        if entry.recording is not None and entry.recording not in recordings:
            continue
        if path.startswith("initial.") and path.endswith((".angle", ".rate")):
            _, body, quantity = path.split(".")
            bodies.setdefault((entry.recording, body), {})[quantity] = k
        elif path.startswith("initial.") or not path:
            others.append(k)
    kinds, flips = range(4), (1.0, -1.0)
    count = 4 ** len(bodies) * 2 ** len(others)
    choices = list(product(*[kinds] * len(bodies))) if count <= _MOST else _few(len(bodies))
    signs = list(product(*[flips] * len(others))) if count <= _MOST else [(s,) * len(others) for s in flips]
    for choice, sign in product(choices, signs):
        image = point.copy()
        image[others] *= sign
        for kind, parts in zip(choice, bodies.values(), strict=True):
            if "angle" in parts:
                angle = image[parts["angle"]]
                image[parts["angle"]] = (angle, 2 * axis - angle, 2 * axis + np.pi - angle, angle + np.pi)[kind]
            if "rate" in parts and kind in (1, 2):
                image[parts["rate"]] *= -1.0
        yield image


def _few(count: int) -> list[tuple[int, ...]]:
    """Kinds for a number of angles: the same for all, and one that differs."""
    alike = [(kind,) * count for kind in range(4)]
    return alike + [tuple(kind if i == k else 0 for i in range(count)) for k in range(count) for kind in range(1, 4)]


def _alike(model: ForwardModel, point: Array, candidates: Array) -> Array:
    """Those of the images whose channels begin about as the answer's, the most similar first, (images, parameters).

    Angles count without whole turns; rates and what sensors feel do not count: a pose has none.
    """
    if not len(candidates):
        return candidates
    off = np.zeros(len(candidates))
    for name, recording in model.measurement.recordings.items():
        seen = model.poses(np.concatenate([point[None], candidates]), name)
        for k, channel in enumerate(recording.channels):
            difference = seen[1:, k] - seen[0, k]
            if channel.quantity == "angle":
                difference = (difference + np.pi) % (2 * np.pi) - np.pi
            if channel.is_pose:
                size = float(np.nanstd(recording.values[:, k]))
                off = np.maximum(off, np.abs(difference) / max(size, 1e-300))
    order = np.argsort(np.where(np.isfinite(off), off, np.inf), kind="stable")[: 2 * DESCENTS]
    return np.asarray(candidates[[k for k in order if off[k] <= GROSS]])
