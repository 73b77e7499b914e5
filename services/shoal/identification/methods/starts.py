"""Starting points: every pose that the first samples allow (both elbow branches), rates by their slope.

The first samples fix a pose up to its mirror images. The poses are found by the Levenberg-Marquardt method on the
placement alone, from many starts at once; no motion is simulated.
"""

from __future__ import annotations

import numpy as np

from shoal.identification.conventions import ROUND_OFF
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import DESCENTS, ENDS_APART, kept_apart
from shoal.mechanics.numerics.levenberg_marquardt import levenberg_marquardt
from shoal.mechanics.numerics.tile import Index
from shoal.trajectory import Array

_CANDIDATES = 16
"""Poses that are tried for each angle."""
_ITERATIONS = 30
"""Steps of the search for poses, at most."""
GAIN = 1e-3
"""Poses are found where a step promises to lower the squared error by less than this part; an error below this [m] that
does not halve is round-off."""
_FIRST_SAMPLES = 5
"""Samples by whose slope rates start: a parabola through them leaves two for the noise."""


def starting_points(model: ForwardModel) -> Array:
    """Starting points, best first, (points, parameters): bounds' middle or `start`, initial state from the data.

    An initial state that is stated comes last, as it is.
    """
    stated = points = model.parameters.start[None]
    for name in model.measurement.recordings:
        points = np.concatenate([_of_recording(model, point, name) for point in points])[:DESCENTS]
    entries = zip(model.parameters.initial, model.parameters.entries.values(), strict=True)
    if any(initial and entry.parameter.start is not None for initial, entry in entries):
        points = np.concatenate([points, stated])
    return np.asarray(np.clip(points, model.lower, model.upper))


def poses_at(model: ForwardModel, point: Array, name: str) -> Array:
    """The point with every pose that shows in a recording what its own shows, rates unchanged, (points, parameters)."""
    angles = model.parameters.indices(name, ".angle")
    return (
        _poses(model, name, point, list(angles.values()), model.poses(point[None], name)[0]) if angles else point[None]
    )


def _of_recording(model: ForwardModel, point: Array, name: str) -> Array:
    """The point with every initial state that the first samples of a recording allow, (points, parameters)."""
    angles = model.parameters.indices(name, ".angle")
    rates = model.parameters.indices(name, ".rate")
    if not angles and not rates:
        return point[None]
    pose, slope = _first_pose(model, name)
    points = _poses(model, name, point, list(angles.values()), pose) if angles else point[None]
    partners = {path: angles.get(path.removesuffix("rate") + "angle") for path in rates}
    if rates and None not in partners.values():
        known = [k for k in partners.values() if k is not None]
        points = np.array([_with_rates(model, name, p, list(rates.values()), known, slope) for p in points])
    return points


def _first_pose(model: ForwardModel, name: str) -> tuple[Array, Array]:
    """Channels and their rates at time zero, from a polynomial through the first samples; both (channels,).

    A machine released from rest moves as a polynomial in t^2 at first, which reaches back to zero from farther away.
    Channels without a sample there are nan.
    """
    recording = model.measurement.recordings[name]
    clock = model.parameters.measurement_values(model.parameters.start[None], name, recording.stated)
    at_rest = _at_rest(model, name)
    pose, slope = np.full((2, len(recording.channels)), np.nan)
    for k, signal in enumerate(recording.values.T):
        first = np.flatnonzero(np.isfinite(signal))[:_FIRST_SAMPLES]
        times, values = recording.times[first] / clock["clock"][0] + clock["delay"][0], signal[first]
        if len(first) == 0:
            continue
        variable = times**2 if at_rest else times
        coefficients = np.polynomial.polynomial.polyfit(variable, values, deg=min(2, len(first) - 1))
        pose[k] = coefficients[0]
        slope[k] = 0.0 if at_rest or len(first) == 1 else coefficients[1]
    return pose, slope


def _at_rest(model: ForwardModel, name: str) -> bool:
    """Return whether the machine starts without any velocity for all parameters."""
    start = model.scene_at(model.parameters.start, name)
    moving = any(body.rate or any(body.velocity or ()) for body in start.initial.values())
    paths = model.parameters.scene_values(model.parameters.start[None], name)
    sought = any(path.startswith("initial.") and not path.endswith(".angle") for path in paths)
    return not (moving or sought or model.scene.ground_points)


def _poses(model: ForwardModel, name: str, middle: Array, angles: list[int], pose: Array) -> Array:
    """Distinct minimisers of the pose error over the angles, best first, (points, parameters)."""
    count = _CANDIDATES * len(angles)
    evenly = scatter(count, len(angles))
    points = np.repeat(middle[None], count, axis=0)
    points[:, angles] = model.lower[angles] + evenly * (model.upper - model.lower)[angles]

    def evaluate(at: Array, numbers: Index) -> tuple[Array, Array]:
        placed = points[numbers]
        placed[:, angles] = at
        return _pose_error(model, name, placed, angles, pose)

    found = levenberg_marquardt(
        evaluate, damped_steps, points[:, angles], gain=GAIN, round_off=ROUND_OFF, most=_ITERATIONS,
        move=lambda at, step: np.clip(at + step, model.lower[angles], model.upper[angles]),
    )  # fmt: skip
    points[:, angles] = found.points
    # Not every pose of a closed loop can be assembled.
    cost = np.where(np.isfinite(found.norms), found.norms**2, np.inf)
    return _distinct(model, points, cost, angles)


def scatter(count: int, dimensions: int) -> Array:
    """Points that fill the unit cube evenly, (count, dimensions): Kronecker's sequence of the generalised golden ratio.

    Roberts (2018). scipy's qmc has other ones, and takes a second to import.
    """
    ratio = 2.0
    for _ in range(_ITERATIONS):
        ratio = (1.0 + ratio) ** (1.0 / (dimensions + 1))
    return np.asarray((0.5 + np.outer(np.arange(1, count + 1), ratio ** -np.arange(1.0, dimensions + 1))) % 1.0)


def damped_steps(error: Array, jacobian: Array, damping: Array, _: Index) -> Array:
    """Return the Levenberg-Marquardt step of each point, (points, angles), damped in parts of the trace."""
    normal = np.einsum("nck,ncl->nkl", jacobian, jacobian)
    gradient = np.einsum("nck,nc->nk", jacobian, error)
    unit = np.eye(normal.shape[1])
    scale = np.trace(normal, axis1=1, axis2=2)[:, None, None] * unit
    damped = normal + damping[:, None, None] * scale + 1e-14 * unit
    return np.asarray(-np.linalg.solve(damped, gradient[..., None])[..., 0])


def _distinct(model: ForwardModel, points: Array, cost: Array, angles: list[int]) -> Array:
    """The points whose cost is about the best one's, inside the bounds, without repetitions."""
    near = cost <= 2 * cost.min() + 1e-6
    inside = np.all((points >= model.lower - 1e-9) & (points <= model.upper + 1e-9), axis=1)
    chosen = np.flatnonzero(near & inside) if np.any(near & inside) else np.array([np.argmin(cost)])
    span = (model.upper - model.lower)[angles]
    best_first = points[chosen[np.argsort(cost[chosen])]]
    return np.array(kept_apart(best_first, lambda a, b: np.max(np.abs((a - b)[angles]) / span) > ENDS_APART))


def _pose_error(model: ForwardModel, name: str, points: Array, angles: list[int], pose: Array) -> tuple[Array, Array]:
    """Pose minus measured pose, (points, channels), and its derivative in the angles, (points, channels, angles).

    Channels that are not known, or that are no pose (rates, accelerations), do not count.
    """
    seen, slope = poses_and_slopes(model, name, points, angles)
    channels = model.measurement.recordings[name].channels
    counted = np.isfinite(pose) & np.array([channel.is_pose for channel in channels])
    error = np.where(counted, seen - np.where(counted, pose, 0.0), 0.0)
    return error, np.where(counted[:, None] & np.isfinite(slope), slope, 0.0)


def poses_and_slopes(model: ForwardModel, name: str, points: Array, angles: list[int]) -> tuple[Array, Array]:
    """Channels at time zero, (points, channels), and their derivatives in the angles, (points, channels, angles)."""
    h = 1e-6
    shifted = np.concatenate([points, *(points + h * np.eye(points.shape[1])[k] for k in angles)])
    seen = model.poses(shifted, name).reshape(1 + len(angles), len(points), -1)
    return seen[0], np.moveaxis((seen[1:] - seen[0]) / h, 0, -1)


def _with_rates(
    model: ForwardModel, name: str, point: Array, rates: list[int], angles: list[int], slope: Array
) -> Array:
    """The point with its rates such that the channels start with the measured slope (least squares)."""
    _, jacobian = _pose_error(model, name, point[None], angles, np.where(np.isfinite(slope), 0.0, np.nan))
    if not np.all(np.isfinite(jacobian)):
        return point
    solution, *_ = np.linalg.lstsq(jacobian[0], np.where(np.isfinite(slope), slope, 0.0), rcond=None)
    point = point.copy()
    point[rates] = solution
    return point
