"""Markers that a tracker has confused: found by the continuity of their paths, or by the poses of the model."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from shoal.trajectory import Array

if TYPE_CHECKING:
    from shoal.identification.forward import ForwardModel
    from shoal.identification.recording import Channel

_PENALTY = 4.0
"""What an exchange costs, over the 99th percentile of the error with which a straight line predicts a sample."""
_MOST = 0.6
"""Where more than this share of the samples contradicts the first, the first is the one that was exchanged."""
_LISTED = 3
_SAMPLES = 10
_BETTER = 10.0
_LIBRARY = 2048
_NEAREST = 4
_ITERATIONS = 12


def mend(times: Array, tracks: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Paths (samples, 2) with exchanged samples put right, and a line for each pair that was exchanged.

    times: (samples,), increasing; nan in a path: not seen. Of each pair the sequence of assignments is sought whose
    samples lie nearest to straight lines through the two before them. Exchanged in all samples looks like none.
    """
    mended, notes = dict(tracks), list[str]()
    for one, other in combinations(mended, 2):
        wrong = _exchanged_samples(times, mended[one], mended[other])
        if np.any(wrong):
            first, second = mended[one], mended[other]
            mended[one] = np.where(wrong[:, None], second, first)
            mended[other] = np.where(wrong[:, None], first, second)
            notes.append(f"markers {one} and {other} exchanged in {_spans(wrong)}: mended")
    return mended, notes


def _exchanged_samples(times: Array, one: Array, other: Array) -> Array:
    """Which samples are exchanged between two paths, (samples,), bool; those that show one of them go with both sides.

    What is unknown is whether sample k is exchanged against the one before it. Distances, not their squares, are
    added: by the triangle inequality no outlier of a single marker is then explained by an exchange.
    """
    known = np.flatnonzero(np.all(np.isfinite(np.hstack([one, other])), axis=1))
    wrong = np.zeros(len(times), dtype=bool)
    if len(known) < 4:
        return wrong
    costs = _prediction_errors(times[known], one[known], other[known])
    penalty = max(_PENALTY * float(np.quantile(costs.min(axis=(0, 1)), 0.99)), 1e-12 * float(np.ptp(one[known])))
    if costs[0, 0].max() <= penalty:
        return wrong
    state = np.cumsum(_cheapest(costs, penalty)) % 2 == 1
    if np.mean(state) > _MOST:
        state = ~state
    wrong[known] = state
    before = np.clip(np.searchsorted(known, np.arange(len(times)), side="right") - 1, 0, len(known) - 1)
    after = np.clip(np.searchsorted(known, np.arange(len(times))), 0, len(known) - 1)
    return np.asarray(state[before] & state[after])


def _prediction_errors(times: Array, one: Array, other: Array) -> Array:
    """Distance of samples 2, 3, ... from where the two before them lead, summed over both markers.

    (2, 2, samples - 2): without and with an exchange after the first of the three, and after the second. Divided by
    how much more uncertain the prediction is than that of the usual interval.
    """
    steps = np.diff(times)
    ratio = steps[1:] / steps[:-1]
    usual = float(np.median(steps))
    doubt = np.maximum.reduce([np.ones_like(ratio), ratio, steps[1:] * (steps[1:] + steps[:-1]) / (2 * usual**2)])
    pair = np.stack([one, other])
    costs = np.empty((2, 2, len(ratio)))
    for before in (0, 1):
        velocity = pair[:, 1:-1] - (pair[::-1] if before else pair)[:, :-2]
        predicted = pair[:, 1:-1] + ratio[:, None] * velocity
        for after in (0, 1):
            error = (pair[::-1] if after else pair)[:, 2:] - predicted
            costs[before, after] = np.linalg.norm(error, axis=2).sum(axis=0) / doubt
    return costs


def _cheapest(costs: Array, penalty: float) -> list[int]:
    """Whether each sample is exchanged against the one before it, for the least sum of costs (Viterbi 1967)."""
    total = (0.0, penalty)
    came_from: list[tuple[int, int]] = []
    for straight, fresh, back, twice in costs.reshape(4, -1).T.tolist():
        came = (int(total[1] + back < total[0] + straight), int(total[1] + twice < total[0] + fresh))
        total = (
            min(total[0] + straight, total[1] + back),
            min(total[0] + fresh, total[1] + twice) + penalty,
        )
        came_from.append(came)
    path = [int(total[1] < total[0])]
    for came in reversed(came_from):
        path.append(came[path[-1]])
    return [0, *reversed(path)]


def _spans(wrong: Array) -> str:
    """Where samples are exchanged, in words."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wrong, [False]]).astype(int)))
    spans = [f"{a}" if b - a == 1 else f"{a} to {b - 1}" for a, b in edges.reshape(-1, 2).tolist()]
    more = f" and {len(spans) - _LISTED} more places" if len(spans) > _LISTED else ""
    single = len(spans) == 1 and " " not in spans[0]
    return f"sample{'' if single else 's'} {', '.join(spans[:_LISTED])}{more}"


def exchanged(model: ForwardModel) -> str | None:
    """What to say where markers seem exchanged in a whole recording, which no continuity shows; else None.

    Ten samples of each recording are compared with the poses that the model can take by its sought initial angles,
    the other parameters at their starts. Another assignment is named where it leaves a tenth of the deviation.
    """
    for name, recording in model.measurement.recordings.items():
        pairs = list(combinations(_positions(recording.channels), 2))
        angles = list(model.parameters.indices(name, ".angle").values())
        complete = np.flatnonzero(np.all(np.isfinite(recording.values), axis=1))
        if not pairs or not angles or len(complete) == 0:
            continue
        samples = recording.values[np.unique(complete[np.linspace(0, len(complete) - 1, _SAMPLES).astype(int)])]
        orders = [np.arange(len(recording.channels)), *(_order(recording.channels, *pair) for pair in pairs)]
        misfits = _pose_misfit(model, name, angles, np.stack([samples[:, order] for order in orders]))
        best = int(np.argmin(misfits))
        if _BETTER * misfits[best] < misfits[0]:
            one, other = pairs[best - 1]
            where = f" in recording {name}" if len(model.measurement.recordings) > 1 else ""
            return (
                f"markers {one} and {other} seem exchanged{where}: the poses are off by {misfits[0]:.2g}, "
                f"with both exchanged by {misfits[best]:.2g}"
            )
    return None


def _positions(channels: tuple[Channel, ...]) -> list[str]:
    """Markers of which x and y are measured."""
    seen = {(channel.marker, channel.quantity) for channel in channels}
    return [marker for marker, quantity in sorted(seen) if quantity == "x" and (marker, "y") in seen]


def _order(channels: tuple[Channel, ...], one: str, other: str) -> Array:
    """Where to find each channel if two markers are exchanged, (channels,)."""
    names = {one: other, other: one}
    keys = [(channel.marker, channel.quantity) for channel in channels]
    return np.array(
        [
            keys.index((names.get(channel.marker, channel.marker), channel.quantity)) if channel.is_position else k
            for k, channel in enumerate(channels)
        ]
    )


def _pose_misfit(model: ForwardModel, name: str, angles: list[int], wanted: Array) -> Array:
    """Root mean square distance from the nearest pose, (assignments,), of wanted channels (assignments, samples, n).

    From the nearest of many poses by Gauss-Newton steps, all samples at once.
    """
    from scipy.stats import qmc  # slow to import

    kinds = tuple(channel.quantity for channel in model.measurement.recordings[name].channels)
    library = np.repeat(model.parameters.start[None], _LIBRARY, axis=0)
    library[:, angles] = np.pi * (2 * qmc.Sobol(len(angles), seed=0).random(_LIBRARY) - 1)
    targets = wanted.reshape(-1, len(kinds))
    seen = model.poses(library, name)
    far = np.stack([np.sum(_difference(seen, target, kinds) ** 2, axis=1) for target in targets])
    points = library[np.argsort(far, axis=1)[:, :_NEAREST].ravel()]
    targets = np.repeat(targets, _NEAREST, axis=0)
    misfit = np.sum(_difference(model.poses(points, name), targets, kinds) ** 2, axis=1)
    for _ in range(_ITERATIONS):
        trial = _gauss_newton(model, name, points, targets, angles, kinds)
        found = np.sum(_difference(model.poses(trial, name), targets, kinds) ** 2, axis=1)
        points = np.where((found < misfit)[:, None], trial, points)
        misfit = np.minimum(misfit, found)
    nearest = misfit.reshape(*wanted.shape[:2], _NEAREST).min(axis=2)
    return np.asarray(np.sqrt(np.mean(nearest, axis=1)))


def _difference(seen: Array, targets: Array, kinds: tuple[str, ...]) -> Array:
    """Channels minus what they should be, angles without whole turns, (points, channels); zero for rates."""
    error = seen - targets
    error = np.where([kind == "angle" for kind in kinds], (error + np.pi) % (2 * np.pi) - np.pi, error)
    return np.where([kind == "rate" for kind in kinds], 0.0, error)


def _gauss_newton(
    model: ForwardModel, name: str, points: Array, targets: Array, angles: list[int], kinds: tuple[str, ...]
) -> Array:
    """The points with their angles moved towards the targets, (points, parameters)."""
    h = 1e-6
    shifted = np.concatenate([points, *(points + h * np.eye(points.shape[1])[k] for k in angles)])
    seen = model.poses(shifted, name).reshape(1 + len(angles), len(points), -1)
    error = _difference(seen[0], targets, kinds)
    jacobian = np.moveaxis(_difference(seen[1:], seen[0], kinds) / h, 0, -1)
    normal = np.einsum("nck,ncl->nkl", jacobian, jacobian)
    # A little damping, so that a stretched pose (singular) does not send the angles far away.
    normal += 1e-6 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(len(angles)) + 1e-14 * np.eye(
        len(angles)
    )
    step = np.linalg.solve(normal, np.einsum("nck,nc->nk", jacobian, error)[..., None])[..., 0]
    moved = points.copy()
    moved[:, angles] = (points[:, angles] - step + np.pi) % (2 * np.pi) - np.pi
    return moved
