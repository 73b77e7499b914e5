"""Where to start: every pose that the first samples allow (both elbow branches), rates by their slope.

The first samples fix a pose up to its mirror images. The poses are found by Gauss-Newton on the
placement alone, from many starts at once; no motion is simulated.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from shoal.identification.forward import ForwardModel
from shoal.trajectory import Array

_CANDIDATES = 64
_ITERATIONS = 30
_FIRST_SAMPLES = 5
_SAME = 1e-3
"""Two poses are the same if no parameter differs by more than this fraction of its range."""


def starting_points(model: ForwardModel) -> Array:
    """Starting points, best first, (points, parameters): bounds' middle or `start`, initial state from the data."""
    parameters = model.problem.parameters.values()
    middle = np.array([(p.lower + p.upper) / 2 if p.start is None else p.start for p in parameters])
    angles = [k for k, p in enumerate(parameters) if p.path.startswith("initial.") and p.path.endswith(".angle")]
    rates = [k for k, p in enumerate(parameters) if p.path.startswith("initial.") and p.path.endswith(".rate")]
    pose, slope = _first_pose(model)
    points = middle[None]
    if angles:
        points = _poses(model, middle, angles, pose)
    if rates:
        points = np.array([_with_rates(model, point, rates, angles, slope) for point in points])
    return np.asarray(np.clip(points, model.lower, model.upper))


def _first_pose(model: ForwardModel) -> tuple[Array, Array]:
    """Channels and their rates at time zero, from a polynomial through the first samples; both (channels,).

    A machine released from rest moves as a polynomial in t^2 at first, which reaches back to zero from farther away.
    """
    count = min(_FIRST_SAMPLES, len(model.measurement.times))
    times, values = model.measurement.times[:count], model.measurement.values[:count]
    if _at_rest(model):
        coefficients = np.polynomial.polynomial.polyfit(times**2, values, deg=min(2, count - 1))
        return coefficients[0], np.zeros_like(coefficients[0])
    coefficients = np.polynomial.polynomial.polyfit(times, values, deg=min(2, count - 1))
    return coefficients[0], coefficients[1]


def _at_rest(model: ForwardModel) -> bool:
    """Whether the machine starts without any velocity, whatever the parameters are."""
    moving = any(start.rate or any(start.velocity) for start in model.scene.initial.values())
    paths = [p.path for p in model.problem.parameters.values()]
    sought = any(path.startswith("initial.") and not path.endswith(".angle") for path in paths)
    return not (moving or sought or model.scene.ground_points)


def _poses(model: ForwardModel, middle: Array, angles: list[int], pose: Array) -> Array:
    """Distinct minimisers of the pose error over the angles, best first, (points, parameters)."""
    scatter = qmc.Sobol(len(angles), seed=0).random(_CANDIDATES)
    points = np.repeat(middle[None], _CANDIDATES, axis=0)
    points[:, angles] = model.lower[angles] + scatter * (model.upper - model.lower)[angles]
    damping = np.full(_CANDIDATES, 1e-3)
    error, jacobian = _pose_error(model, points, angles, pose)
    cost = np.sum(error**2, axis=1)
    for _ in range(_ITERATIONS):
        normal = np.einsum("nck,ncl->nkl", jacobian, jacobian)
        gradient = np.einsum("nck,nc->nk", jacobian, error)
        scale = np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(len(angles))
        step = np.linalg.solve(
            normal + damping[:, None, None] * scale + 1e-14 * np.eye(len(angles)), gradient[..., None]
        )
        trial = points.copy()
        trial[:, angles] -= step[..., 0]
        trial = np.clip(trial, model.lower, model.upper)
        trial_error, trial_jacobian = _pose_error(model, trial, angles, pose)
        trial_cost = np.sum(trial_error**2, axis=1)
        better = trial_cost < cost
        points[better], error[better], jacobian[better] = trial[better], trial_error[better], trial_jacobian[better]
        cost = np.where(better, trial_cost, cost)
        damping = np.where(better, damping / 10, damping * 10)
    return _distinct(model, points, cost, angles)


def _distinct(model: ForwardModel, points: Array, cost: Array, angles: list[int]) -> Array:
    """The points whose cost is about the best one's, inside the bounds, without repetitions."""
    near = cost <= 2 * cost.min() + 1e-6
    inside = np.all((points >= model.lower - 1e-9) & (points <= model.upper + 1e-9), axis=1)
    candidates = points[near & inside] if np.any(near & inside) else points[[int(np.argmin(cost))]]
    order = np.argsort(cost[near & inside]) if np.any(near & inside) else np.array([0])
    found: list[Array] = []
    for point in candidates[order]:
        span = (model.upper - model.lower)[angles]
        if all(np.max(np.abs((point - other)[angles]) / span) > _SAME for other in found):
            found.append(point)
    return np.array(found)


def _pose_error(model: ForwardModel, points: Array, angles: list[int], pose: Array) -> tuple[Array, Array]:
    """Pose minus measured pose, (points, channels), and its derivative in the angles, (points, channels, angles)."""
    h = 1e-6
    shifted = np.concatenate([points, *(points + h * np.eye(points.shape[1])[k] for k in angles)])
    seen = model.poses(shifted).reshape(1 + len(angles), len(points), -1)
    return seen[0] - pose, np.moveaxis((seen[1:] - seen[0]) / h, 0, -1)


def _with_rates(model: ForwardModel, point: Array, rates: list[int], angles: list[int], slope: Array) -> Array:
    """The point with its rates such that the channels start with the measured slope (least squares)."""
    paths = [p.path for p in model.problem.parameters.values()]
    partner = [paths.index(paths[k].removesuffix("rate") + "angle") for k in rates if _has_partner(paths, k)]
    if len(partner) != len(rates):
        return point
    _, jacobian = _pose_error(model, point[None], partner, np.zeros(len(slope)))
    solution, *_ = np.linalg.lstsq(jacobian[0], slope, rcond=None)
    point = point.copy()
    point[rates] = solution
    return point


def _has_partner(paths: list[str], k: int) -> bool:
    return paths[k].removesuffix("rate") + "angle" in paths
