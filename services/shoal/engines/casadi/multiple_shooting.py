"""Direct multiple shooting: the record is cut into segments whose first states are unknowns too.

Bock and Plitt, A multiple shooting algorithm for direct solution of optimal control problems, IFAC 1984. A segment is
short, so its motion depends on its first state almost linearly even where the whole motion does not; that the segments
join is a constraint.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt

from shoal.engines.casadi.fixed_step import runge_kutta
from shoal.engines.casadi.model import casadi_model
from shoal.engines.casadi.shooting import OPTIONS, ShootingResult, box, initial_state, left, record, result, shot
from shoal.engines.interrupts import interruptible
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.trajectory import Array

LARGEST = 24
"""Components of a state, at most. A flexible double pendulum of six elements has 56, and takes minutes."""
_UNBOUNDED = 1e20


def identify_by_segments(
    scene: Scene,
    paths: Sequence[str],
    start: Sequence[float] | Array,
    lower: Sequence[float] | Array,
    upper: Sequence[float] | Array,
    times: Sequence[float] | Array,
    marker: str,
    measured: npt.ArrayLike,
    *,
    segments: int = 10,
    step: float | None = None,
    limit: float | None = None,
) -> ShootingResult:
    """Fit the initial state named by `paths` as `identify_initial_angles` does, by IPOPT on `segments` segments.

    The segments begin on the motion from `start`, each moved towards the measured position and velocity. The fitness
    is that of the whole motion from the values found. A derivative costs one more simulation for every component of
    the state, so machines with more than LARGEST of them are refused. Raises InputError.
    """
    instants, target = record(scene, times, marker, measured)
    first, low, high = box(paths, start, lower, upper)
    began = time.perf_counter()
    longest = scene.solver.step if step is None else step
    whole = shot(scene, paths, instants, marker, longest, 0)
    nlp = _Segments.of(scene, paths, instants, marker, target, longest, min(segments, instants.size))
    optimise = nlp.optimiser(left(limit, began))
    built = time.perf_counter()
    free = np.full(nlp.unknowns - len(paths), _UNBOUNDED)
    with interruptible():
        solution = optimise(x0=nlp.guess(first), lbx=np.append(low, -free), ubx=np.append(high, free), lbg=0.0, ubg=0.0)
    wall = time.perf_counter() - built
    values = np.clip(solution["x"].full().ravel()[: len(paths)], low, high)
    fitness = float(np.sum((whole(values).full() - target.T) ** 2) / len(target))
    # The first guess runs all segments once for each of them but the first; the fitness is one more.
    return result(values, fitness, optimise.stats(), "ipopt", nlp.segments, nlp.size, wall)


@dataclass(frozen=True, eq=False)
class _Segments:
    """The nonlinear programme. Its unknowns are the parameters, then the first states of all segments but the first.

    start: parameters -> first state (size,) and its derivative (size, parameters)
    seen: state (size,) -> position of the marker [m], (2,), and its derivative in the coordinates, (2, size / 2)
    run, linearised: first states (size, segments) -> states and positions of the marker at all samples, stacked in one
        column per sample; linearised: followed by their derivatives in the segment's first state
    target, velocity: measured positions [m] and their slope [m/s], (samples, 2); each: samples of a segment
    """

    start: Any
    seen: Any
    run: Any
    linearised: Any
    target: Array
    velocity: Array
    size: int
    parameters: int
    segments: int
    each: int

    @classmethod
    def of(
        cls, scene: Scene, paths: Sequence[str], times: Array, marker: str, target: Array, step: float, segments: int
    ) -> _Segments:
        model = casadi_model(scene)
        p, size = ca.SX.sym("p", len(paths)), 2 * model.unknowns
        if size > LARGEST:
            raise InputError(
                f"method: casadi-multiple takes states of up to {LARGEST} numbers, this machine has {size}; use casadi"
            )
        initial = initial_state(model, scene, paths, p)[:size]
        start = ca.Function("start", [p], [initial, ca.jacobian(initial, p)])
        x = ca.SX.sym("x", size)
        point = model.places(ca.vertcat(x, 0))[0][:, model.markers.index(marker)]
        seen = ca.Function("seen", [x], [point, ca.jacobian(point, x)[:, : model.unknowns]])
        velocity = np.gradient(target, times, axis=0)
        each = -(-times.size // segments)
        segments = -(-times.size // each)
        filled = _filled(times, segments * each)
        plain, linearised = (_run(model, marker, filled, each, segments, step, count) for count in (0, size))
        return cls(start, seen, plain, linearised, target, velocity, size, len(paths), segments, each)

    @property
    def unknowns(self) -> int:
        """Length of the vector of all unknowns."""
        return self.parameters + (self.segments - 1) * self.size

    def guess(self, parameters: Array) -> Array:
        """All unknowns on the motion from given parameters, which is led back to the data between segments."""
        states = [self.start(parameters)[0].full().ravel()]
        for _ in range(self.segments - 1):
            # Every segment starts from the same state; the one that is wanted stands at its own place.
            found = self.run(ca.repmat(states[-1], 1, self.segments)).full()
            last = len(states) * self.each - 1
            states.append(self._towards(found[: self.size, last], self.target[last], self.velocity[last]))
        return np.concatenate([parameters, *states[1:]])

    def _towards(self, state: Array, position: Array, velocity: Array) -> Array:
        """Return the least change of the state that puts the marker there, damped where it has little effect."""
        q, v = np.split(state, 2)
        for _ in range(5):
            point, slope = (part.full() for part in self.seen(np.append(q, v)))
            q = q + _smallest(slope, position - point.ravel())
        slope = self.seen(np.append(q, v))[1].full()
        return np.append(q, v + _smallest(slope, velocity - slope @ v))

    def optimiser(self, more: dict[str, Any]) -> Any:
        """IPOPT on the programme, with exact first derivatives, the Gauss-Newton Hessian, and more options."""
        z, none = ca.MX.sym("z", self.unknowns), ca.MX.sym("p", 0)
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", (self.segments - 1) * self.size)
        states, _ = self._states(z)
        value, gaps = self._fit(self.run(states)), self._gaps(self.run(states), states)
        fit, gradient, hessian, gap, slope = self._linearised(z)
        inputs = [z, none]
        options = OPTIONS["ipopt"] | {"print_time": False, "error_on_fail": False, "show_eval_warnings": False}
        options |= more | {
            "grad_f": ca.Function("nlp_grad_f", inputs, [fit, gradient]),
            "jac_g": ca.Function("nlp_jac_g", inputs, [gap, slope]),
            "hess_lag": ca.Function("nlp_hess_l", [*inputs, lam_f, lam_g], [ca.triu(lam_f * hessian)]),
        }
        return ca.nlpsol("multiple_shooting", "ipopt", {"x": z, "p": none, "f": value, "g": gaps}, options)

    def _states(self, z: Any) -> tuple[Any, Any]:
        """First states of the segments, (size, segments), and the derivative of the first one, (size, parameters)."""
        initial, slope = self.start(z[: self.parameters])
        rest = ca.reshape(z[self.parameters :], self.size, self.segments - 1)
        return ca.horzcat(initial, rest), slope

    def _fit(self, found: Any) -> Any:
        samples = len(self.target)
        return ca.sumsqr(found[self.size : self.size + 2, :samples] - self.target.T) / samples

    def _gaps(self, found: Any, states: Any) -> Any:
        """Return the continuity gaps: the end of each segment minus the beginning of the next."""
        ends = found[: self.size, self.each - 1 : -1 : self.each]
        return ca.vec(ends - states[:, 1:])

    def _linearised(self, z: Any) -> tuple[Any, ...]:
        """Fitness, its gradient and Gauss-Newton Hessian, gaps and their Jacobian."""
        states, slope = self._states(z)
        found = self.linearised(states)
        samples = len(self.target)
        blocks, gradients, rows = [], [], []
        for k in range(self.segments):
            inner = slope if k == 0 else ca.DM.eye(self.size)
            columns = range(k * self.each, min((k + 1) * self.each, samples))
            parts = [ca.reshape(found[self.size + 2 :, i], self.size + 2, self.size) for i in columns]
            jacobian = ca.mtimes(ca.vertcat(*(part[self.size :, :] for part in parts)), inner)
            residual = ca.vertcat(*(found[self.size : self.size + 2, i] - self.target[i] for i in columns))
            blocks.append(2 / samples * ca.mtimes(jacobian.T, jacobian))
            gradients.append(2 / samples * ca.mtimes(jacobian.T, residual))
            if k < self.segments - 1:
                width = [self.parameters, *[self.size] * (self.segments - 1)]
                row = [ca.DM(self.size, w) for w in width]
                row[k], row[k + 1] = ca.mtimes(parts[-1][: self.size, :], inner), -ca.DM.eye(self.size)
                rows.append(ca.horzcat(*row))
        slopes = ca.vertcat(*rows) if rows else ca.DM(0, self.unknowns)
        return self._fit(found), ca.vertcat(*gradients), ca.diagcat(*blocks), self._gaps(found, states), slopes


def _run(model: Any, marker: str, times: Array, each: int, segments: int, step: float, directions: int) -> Any:
    """Function first states (size, segments) -> one column per sample; see `_Segments`."""
    size = 2 * model.unknowns
    gaps = np.diff(times, prepend=0.0)
    # The integrator's substeps are those of the longest interval, so one function serves every segment.
    longest = np.full(each, gaps.max()).cumsum()
    run, substeps, _ = runge_kutta(model, longest, step, directions)
    steps = substeps[:1, :1] * (gaps / gaps.max())[None, :]
    x, carried = ca.SX.sym("x", size + 1), ca.SX.sym("carried", size + 1, directions)
    point = model.places(x)[0][:, model.markers.index(marker)]
    moved = ca.jtimes(point, x, carried) if directions else carried[:0, :]
    shown = ca.veccat(x[:size], point, ca.vertcat(carried[:size, :], moved))
    look = ca.Function("look", [ca.veccat(x, carried)], [shown])
    states = ca.MX.sym("states", size, segments)
    # The work that the model integrates along begins at zero and does not matter here.
    below = np.vstack([np.zeros((1, 1)), np.eye(size + 1, directions).reshape(-1, 1, order="F")])
    full = ca.vertcat(states, ca.repmat(ca.DM(below), 1, segments))
    return ca.Function("run", [states], [look.map(times.size)(run.map(segments)(full, ca.DM(steps)))])


def _smallest(slope: Array, change: Array) -> Array:
    """The least step with slope @ step = change, damped near singular poses."""
    square = slope @ slope.T
    return np.asarray(slope.T @ np.linalg.solve(square + 1e-3 * np.trace(square) * np.eye(2), change))


def _filled(times: Array, count: int) -> Array:
    """The instants, lengthened by intervals like the last one to `count`: samples that are computed and not used."""
    gap = times[-1] - times[-2] if len(times) > 1 else times[-1]
    return np.append(times, times[-1] + gap * np.arange(1, count - len(times) + 1))
