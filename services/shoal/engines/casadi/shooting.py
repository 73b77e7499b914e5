"""Direct single shooting: initial angles and rates from a measured path, by IPOPT or SQP on exact derivatives."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np
import numpy.typing as npt

from shoal.engines.capabilities import require
from shoal.engines.casadi.engine import CasadiEngine
from shoal.engines.casadi.fixed_step import runge_kutta
from shoal.engines.casadi.model import CasadiModel, casadi_model
from shoal.engines.contract import sampling_times
from shoal.engines.interrupts import interruptible
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.trajectory import Array, Status

OPTIONS: dict[str, dict[str, Any]] = {
    "ipopt": {
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": 1e-9,
        "ipopt.max_iter": 100,
        "ipopt.bound_relax_factor": 0.0,
    },
    "sqpmethod": {
        "print_header": False,
        "print_iteration": False,
        "print_status": False,
        "qpsol": "qrqp",
        "qpsol_options": {"print_iter": False, "print_header": False, "print_info": False, "error_on_fail": False},
        "tol_du": 1e-9,
        "max_iter": 100,
    },
}


_LEAST = 1e-3
"""Seconds that IPOPT is given at least: it takes no zero."""


@dataclass(frozen=True)
class ShootingResult:
    """Result and cost of direct shooting.

    values: the identified values in the order of the paths [rad or rad/s], (parameters,)
    fitness: mean over the samples of |r - r_measured|^2 at `values` [m^2]
    evaluations: forward simulation equivalents; a derivative is one more simulation per parameter
    wall_s: time of the optimisation, without that to derive the model and its derivatives [s]
    status, message: `ok` when the optimiser converged, else its own status
    """

    values: Array
    fitness: float
    evaluations: int
    iterations: int
    wall_s: float
    status: Status
    message: str

    @property
    def out_of_time(self) -> bool:
        """Return whether the limit ended it."""
        return "WallTime" in self.message


def identify_initial_angles(
    scene: Scene,
    paths: Sequence[str],
    start: Sequence[float] | Array,
    lower: Sequence[float] | Array,
    upper: Sequence[float] | Array,
    times: Sequence[float] | Array,
    marker: str,
    measured: npt.ArrayLike,
    *,
    solver: Literal["ipopt", "sqpmethod"] = "ipopt",
    step: float | None = None,
    limit: float | None = None,
) -> ShootingResult:
    """Fit the initial state named by `paths` (`initial.OA.angle`, `initial.AB.rate`) to a marker's path.

    start, lower, upper: of each path [rad or rad/s], (parameters,); times: [s], (samples,);
    measured: positions of `marker` [m], (samples, 2); step: longest Runge-Kutta step [s], else the scene's
    limit: after which IPOPT stops [s], the time to derive the model included

    Minimises the fitness with the Gauss-Newton Hessian. Raises InputError.
    """
    instants, target = record(scene, times, marker, measured)
    first, low, high = box(paths, start, lower, upper)
    began = time.perf_counter()
    longest = scene.solver.step if step is None else step
    plain, linearised = (shot(scene, paths, instants, marker, longest, count) for count in (0, len(paths)))
    optimise, fitness_at = _least_squares(plain, linearised, target, solver, left(limit, began))
    built = time.perf_counter()
    with interruptible():
        values = optimise(x0=first, lbx=low, ubx=high)["x"].full().ravel()
    wall = time.perf_counter() - built
    return result(values, float(fitness_at(values)), optimise.stats(), solver, 1, len(paths), wall)


def result(
    values: Array,
    fitness: float,
    stats: dict[str, Any],
    solver: str,
    more: int,
    directions: int,
    wall_s: float,
) -> ShootingResult:
    """Make the result from the optimiser's statistics. more: further simulations; directions: of a derivative."""
    forward = more + _calls(stats, "nlp_f", "nlp_fg", "nlp_g")
    gradient = _calls(stats, "nlp_grad_f", "nlp_jac_fg", "nlp_jac_g", "nlp_hess_l")
    trusted = bool(stats["success"]) and np.isfinite(fitness)
    return ShootingResult(
        values=values,
        fitness=fitness,
        evaluations=forward + (1 + directions) * gradient,
        iterations=int(stats["iter_count"]),
        wall_s=wall_s,
        status=Status.OK if trusted else Status.FAILED,
        message="" if trusted else f"{solver}: {stats['return_status']}",
    )


def left(limit: float | None, began: float) -> dict[str, Any]:
    """Return IPOPT's option for the rest of a time limit [s] that began at a time of `perf_counter`."""
    return {} if limit is None else {"ipopt.max_wall_time": max(limit - (time.perf_counter() - began), _LEAST)}


def _calls(stats: dict[str, Any], *names: str) -> int:
    """Count the calls of the functions of these names; IPOPT and SQP name theirs differently."""
    return sum(int(stats.get(f"n_call_{name}", 0)) for name in names)


def record(scene: Scene, times: Sequence[float] | Array, marker: str, measured: npt.ArrayLike) -> tuple[Array, Array]:
    """Instants [s], (samples,), and the marker's measured positions [m], (samples, 2). Raises InputError."""
    instants = sampling_times(scene, times)
    target = np.asarray(measured, dtype=float)
    if target.shape != (instants.size, 2) or not np.all(np.isfinite(target)):
        raise InputError(f"measured: needs ({instants.size}, 2) finite positions in m, found shape {target.shape}")
    if marker not in scene.markers:
        raise InputError(f"marker: no marker {marker!r}; there are {', '.join(scene.markers)}")
    return instants, target


def box(paths: Sequence[str], *sides: Sequence[float] | Array) -> tuple[Array, Array, Array]:
    """Start, lower and upper bound as arrays, (parameters,). Raises InputError."""
    if not paths or len(set(paths)) != len(paths):
        raise InputError(f"paths: needs one or more different paths, found {list(paths)}")
    first, low, high = (np.asarray(side, dtype=float) for side in sides)
    for label, side in (("start", first), ("lower", low), ("upper", high)):
        if side.shape != (len(paths),):
            raise InputError(f"{label}: needs one number for each of {len(paths)} paths, found shape {side.shape}")
    if not np.all((low <= first) & (first <= high)):
        raise InputError(f"start: {first.tolist()} is not between lower {low.tolist()} and upper {high.tolist()}")
    return first, low, high


def shot(scene: Scene, paths: Sequence[str], times: Array, marker: str, step: float, directions: int) -> Any:
    """Function parameters -> path of the marker [m] with its derivatives below, (2 + 2 directions, samples)."""
    require(CasadiEngine(), scene)
    model = casadi_model(scene)
    p, size = ca.SX.sym("p", len(paths)), 2 * model.unknowns + 1
    initial = initial_state(model, scene, paths, p)
    first = ca.Function("first", [p], [ca.veccat(initial, ca.jacobian(initial, p)[:, :directions])])
    x, carried = ca.SX.sym("x", size), ca.SX.sym("carried", size, directions)
    point = model.places(x)[0][:, model.markers.index(marker)]
    moved = ca.jtimes(point, x, carried) if directions else carried[:0, :]
    seen = ca.Function("seen", [ca.veccat(x, carried)], [ca.veccat(point, moved)])
    run, substeps, _ = runge_kutta(model, times, step, directions)
    parameters = ca.MX.sym("p", len(paths))
    path = seen.map(times.size)(run(first(parameters), substeps))
    return ca.Function("shot", [parameters], [path])


def initial_state(model: CasadiModel, scene: Scene, paths: Sequence[str], p: Any) -> Any:
    """The state x at the start as an expression in the parameters p. Raises InputError."""
    for name, load in scene.loads.items():
        for field in ("length", "angle"):
            if getattr(load, field, 0.0) is None:
                raise InputError(f"loads.{name}.{field}: shooting moves the start, so say where the spring rests")
    angles: list[Any] = [scene.start(body).angle for body in model.bodies]
    rates: list[Any] = [scene.start(body).rate for body in model.bodies]
    for i, path in enumerate(paths):
        match path.split("."):
            case ["initial", body, "angle"] if body in model.bodies:
                angles[model.bodies.index(body)] = p[i]
            case ["initial", body, "rate"] if body in model.bodies:
                rates[model.bodies.index(body)] = p[i]
            case _:
                known = ", ".join(model.bodies)
                raise InputError(f"{path}: shooting finds initial.BODY.angle or .rate; the bodies are {known}")
    return model.start(ca.vertcat(*angles), ca.vertcat(*rates))


def _least_squares(plain: Any, linearised: Any, measured: Array, solver: str, more: dict[str, Any]) -> tuple[Any, Any]:
    """The optimiser of the fitness, with its exact gradient and Gauss-Newton Hessian, and the fitness itself."""
    samples, parameters = len(measured), plain.numel_in(0)
    x, p = ca.MX.sym("x", parameters), ca.MX.sym("p", 0)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 0)
    fitness = ca.sumsqr(plain(x) - measured.T) / samples
    path = linearised(x)
    residual = ca.vec(path[:2, :] - measured.T)
    jacobian = ca.horzcat(*(ca.vec(path[2 + 2 * i : 4 + 2 * i, :]) for i in range(parameters)))
    gradient = 2 / samples * ca.mtimes(jacobian.T, residual)
    hessian = 2 / samples * lam_f * ca.mtimes(jacobian.T, jacobian)
    value = ca.sumsqr(residual) / samples
    none = ca.MX(0, 1)
    options = OPTIONS[solver] | {"print_time": False, "error_on_fail": False, "show_eval_warnings": False}
    if solver == "ipopt":
        options |= more
        options["grad_f"] = ca.Function("nlp_grad_f", [x, p], [value, gradient])
        options["hess_lag"] = ca.Function("nlp_hess_l", [x, p, lam_f, lam_g], [ca.triu(hessian)])
    else:
        options["jac_fg"] = ca.Function("nlp_jac_fg", [x, p], [value, gradient, none, ca.MX(0, parameters)])
        options["hess_lag"] = ca.Function("nlp_hess_l", [x, p, lam_f, lam_g], [hessian])
    optimise = ca.nlpsol("shooting", solver, {"x": x, "p": p, "f": fitness}, options)
    return optimise, ca.Function("fitness", [x], [fitness])
