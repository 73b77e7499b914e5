"""Markers that a tracker has confused in a whole recording: found by the poses that the model can take."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from shoal.findings import Finding
from shoal.identification.findings import EXCHANGED
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.starts import damped_steps, poses_and_slopes
from shoal.identification.recording.source import Channel
from shoal.mechanics.numerics.levenberg_marquardt import levenberg_marquardt
from shoal.mechanics.numerics.tile import Index
from shoal.trajectory import Array

_SAMPLES = 10
_BETTER = 10.0
_LIBRARY = 2048
_NEAREST = 4
_ITERATIONS = 12
_GAIN = 1e-3
"""A pose is found where a step promises to lower its squared error by less than this part."""


def exchanged(model: ForwardModel) -> Finding | None:
    """Return what was found where markers seem exchanged in a whole recording, which no continuity shows; else None.

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
            text = f"markers {one} and {other} seem exchanged{where}: the poses are off by {misfits[0]:.2g}, "
            text += f"with both exchanged by {misfits[best]:.2g}"
            return EXCHANGED.found(text, before=float(misfits[0]), after=float(misfits[best]))
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

    From the nearest of many poses by the Levenberg-Marquardt method, all samples at once.
    """
    from scipy.stats import qmc  # slow to import

    kinds = tuple(c.quantity if c.is_pose else "" for c in model.measurement.recordings[name].channels)
    library = np.repeat(model.parameters.start[None], _LIBRARY, axis=0)
    library[:, angles] = np.pi * (2 * qmc.Sobol(len(angles), seed=0).random(_LIBRARY) - 1)
    targets = wanted.reshape(-1, len(kinds))
    seen = model.poses(library, name)
    far = np.stack([np.sum(_difference(seen, target, kinds) ** 2, axis=1) for target in targets])
    points = library[np.argsort(far, axis=1)[:, :_NEAREST].ravel()]
    targets = np.repeat(targets, _NEAREST, axis=0)

    def evaluate(at: Array, numbers: Index) -> tuple[Array, Array]:
        placed = points[numbers]
        placed[:, angles] = at
        seen, jacobian = poses_and_slopes(model, name, placed, angles)
        jacobian[:, [not kind for kind in kinds]] = 0.0
        return _difference(seen, targets[numbers], kinds), jacobian

    found = levenberg_marquardt(
        evaluate, damped_steps, points[:, angles], gain=_GAIN, most=_ITERATIONS,
        move=lambda at, step: (at + step + np.pi) % (2 * np.pi) - np.pi,
    )  # fmt: skip
    nearest = found.norms.reshape(*wanted.shape[:2], _NEAREST).min(axis=2)
    return np.asarray(np.sqrt(np.mean(nearest**2, axis=1)))


def _difference(seen: Array, targets: Array, kinds: tuple[str, ...]) -> Array:
    """Channels minus what they should be, angles without whole turns, (points, channels); zero for no pose."""
    error = seen - targets
    error = np.where([kind == "angle" for kind in kinds], (error + np.pi) % (2 * np.pi) - np.pi, error)
    return np.where([not kind for kind in kinds], 0.0, error)
