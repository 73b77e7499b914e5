"""Gauss's principle solved by a fish swarm at every time step: the loop of the paper's section 4.2, for one lane.

It stands beside the other ways to the acceleration so that its cost and accuracy appear in the same tables. With
M = L L' and y = L' a, Gauss's function (eq. 16) is G = 1/2 |y - y_f|^2, y_f = L^-1 Q, and the constraints are the rows
C_q L^-T y = -eta. Fish have to satisfy them, so a fish is a place x in the null space: y = y_p + N x with the
least-norm particular solution y_p and an orthonormal basis N. Its unit is that of y, sqrt(kg) m/s^2.

What the paper leaves open:
- the box of the first swarm: |x_j| <= |y_f|, because the optimum N' y_f is never longer than y_f;
- x_0 of step 3-2, the optimum of the unconstrained function: N' y_f, which is the free acceleration carried into the
  null space by the mass metric. There it is the optimum of the constrained function as well, so with this seed the
  swarm is handed the answer;
- q_{tau-1} of step 3-2, the optimum of the previous time step, carried into the present null space likewise;
- what is returned: the best fish ever seen, or (`keep_best` off) the P_g of step 3-7, which the printed steps forget.

A swarm that compares values of G cannot tell places apart whose G differs by less than its round-off: the acceleration
is known to about the square root of that, 1e-8 of |y_f|, however long it swims. And what it finds is the minimiser,
which at a singular position is in general not the acceleration of the motion (see `projection`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numba import njit
from scipy.linalg import cholesky, solve_triangular

from shoal.errors import InputError
from shoal.mechanics import dynamics, model
from shoal.mechanics.dynamics import Work
from shoal.mechanics.halts import RESOLUTION
from shoal.mechanics.least import constraints
from shoal.mechanics.march import ASSEMBLY, SAMPLED, Record
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import SINGLE, Array, Index, Tile
from shoal.mechanics.numerics.vector import pointer
from shoal.scene import Scene, Solver
from shoal.swarm import OPTIMIZERS, Afsa, EvaluationCounter, Iafsa, IafsaPrinted, minimize

INTEGRATOR = "semi-implicit-euler"
"""The paper's step 4."""


@dataclass(frozen=True, kw_only=True)
class Switches:
    """The parts of the improved swarm, each of which an ablation can leave out; `afsa` has none of them.

    seed_traditional, seed_previous: the two fish of step 3-2. mutation, velocity: terms of eq. 17.
    keep_best: return the best fish ever seen, else what the last iteration knows (differs for `iafsa-printed` only).
    """

    seed_traditional: bool = True
    seed_previous: bool = True
    mutation: bool = True
    velocity: bool = True
    keep_best: bool = True


@dataclass(frozen=True, kw_only=True)
class Search:
    """How the accelerations of a run are sought; progress(steps done, steps in all) is called after every step."""

    switches: Switches = Switches()
    progress: Callable[[int, int], None] | None = None


def asked_for(scene: Scene) -> bool:
    """Whether `solver.acceleration` names a swarm."""
    return scene.solver.acceleration in OPTIMIZERS


def suited(scene: Scene, lanes: int) -> Scene:
    """The scene with the paper's time step where it leaves the choice. Raises InputError where it cannot be had."""
    solver = scene.solver
    if solver.integrator not in ("auto", INTEGRATOR):
        raise InputError(
            f"solver.integrator: {solver.integrator} does not go with solver.acceleration={solver.acceleration}; "
            f"use {INTEGRATOR} or auto"
        )
    if lanes > 1:
        raise InputError(
            f"solver.acceleration: {solver.acceleration} moves one lane at a time, found {lanes}; use projection"
        )
    # The arrays know compiled ways to the acceleration only; none of them is called.
    return scene.with_values({"solver.integrator": INTEGRATOR, "solver.acceleration": "projection"})


@dataclass(frozen=True, eq=False)
class GaussFunction:
    """Gauss's function over the accelerations that the constraints allow (eq. 16), in y = L' a.

    origin: y_p, free: y_f, (n,); basis: N, (n, d); inverse: maps -eta to y_p, (n, constraints).
    """

    origin: Array
    free: Array
    basis: Array
    inverse: Array

    def __call__(self, fish: Array) -> Array:
        """G [kg m^2/s^4] of places in the null space (m, d), (m,)."""
        gap = self.origin - self.free + fish @ self.basis.T
        value: Array = 0.5 * np.sum(gap * gap, axis=1)
        return value

    @property
    def optimum(self) -> Array:
        """Where G is least, (d,)."""
        return self.free @ self.basis

    @property
    def radius(self) -> float:
        """Half the side of the box that holds the optimum, sqrt(kg) m/s^2."""
        return float(np.linalg.norm(self.free)) or 1.0


def gauss_function(lower: Array, load: Array, rows: Array, eta: Array, tolerance: float) -> GaussFunction:
    """Set up eq. 16. lower: L (n, n), load: Q (n,), rows: C_q (constraints, n), eta: (constraints,).

    tolerance: singular values below it, of rows of unit length in the mass metric, count as zero.
    """
    free = solve_triangular(lower, load, lower=True)
    scaled = solve_triangular(lower, rows.T, lower=True).T
    length = np.linalg.norm(scaled, axis=1)
    length[length == 0.0] = 1.0
    u, s, right = np.linalg.svd(scaled / length[:, None])
    rank = int(np.sum(s > tolerance))
    inverse = right[:rank].T @ (u[:, :rank] / s[:rank]).T / length
    return GaussFunction(-inverse @ eta, free, right[rank:].T, inverse)


def seek(
    function: EvaluationCounter,
    gauss: GaussFunction,
    solver: Solver,
    switches: Switches,
    previous: Array | None,
    number: int,
) -> Array:
    """The place of least G (d,) that the swarm of the time step of this number finds, steps 3-1 to 3-7.

    function: counts the evaluations of `gauss`; previous: the optimum of the previous time step (d,), if there is one.
    """
    if gauss.optimum.size == 0:
        return gauss.optimum
    upper = np.full(gauss.optimum.size, gauss.radius)
    box: dict[str, Any] = {"lower": -upper, "upper": upper, "size": solver.swarm_size}
    run: dict[str, Any] = {
        "rng": np.random.default_rng([solver.swarm_seed, number]),
        "iterations": solver.swarm_iterations,
    }
    if solver.acceleration == "afsa":
        return minimize(Afsa(**box), function, **run).best
    parts: dict[str, Any] = {
        **box,
        "traditional": gauss.optimum if switches.seed_traditional else None,
        "previous": previous if switches.seed_previous else None,
        "use_mutation": switches.mutation,
        "use_velocity": switches.velocity,
    }
    if solver.acceleration == "iafsa":
        return minimize(Iafsa(**parts), function, **run).best
    printed = minimize(IafsaPrinted(**parts), function, **run)
    return printed.best if switches.keep_best else printed.group_best


@dataclass
class _Tally:
    """Sums over the time steps; error: distance to the optimum in the mass metric relative to its length."""

    evaluations: int = 0
    accelerations: int = 0
    excess: float = 0.0
    worst_excess: float = 0.0
    error: float = 0.0
    worst_error: float = 0.0

    def add(self, evaluations: int, gap: float, length: float) -> None:
        excess, error = 0.5 * gap**2, gap / length if length > 0.0 else 0.0
        self.evaluations += evaluations
        self.accelerations += 1
        self.excess += excess
        self.error += error
        self.worst_excess = max(self.worst_excess, excess)
        self.worst_error = max(self.worst_error, error)

    def facts(self) -> dict[str, Any]:
        count = max(1, self.accelerations)
        return {
            "evaluations": self.evaluations,
            "accelerations": self.accelerations,
            "excess": self.excess / count,
            "worst_excess": self.worst_excess,
            "error": self.error / count,
            "worst_error": self.worst_error,
        }


def march(
    search: Search,
    solver: Solver,
    arrays: Arrays,
    room: Work,
    steps: int,
    times: Array,
    marker_rows: Index,
    stops: Array,
) -> tuple[Record, dict[str, Any]]:
    """March one lane from the state in `room`, as `march.march` does, with accelerations that a swarm finds.

    marker_rows: (markers, 4). stops: times that steps are cut short to end at [s]. The second result says what the
    swarm did: evaluations of Gauss's function counted, accelerations sought, mean and worst `excess` of G above its
    true minimum [kg m^2/s^4], mean and worst `error` of the acceleration relative to the true one, both measured in
    the mass metric.
    """
    n, step, markers = arrays.unknowns, solver.step, len(marker_rows)
    q, v = room.z[:n], room.zdot[:n]
    record = Record(np.full(len(times) * markers * SAMPLED, np.nan), *(np.zeros(1) for _ in Record._fields[1:]))
    record = record._replace(drift=np.zeros(constraints.POWERS))
    samples = record.samples.reshape(len(times), markers, SAMPLED)
    lower = cholesky(_dense_mass(arrays), lower=True)
    inside = np.zeros(arrays.rows)
    gap = np.empty(arrays.constraints.size)
    loaded = bool(_loaded(arrays))
    tally, y = _Tally(), np.empty(n)
    power = dissipated = start = 0.0
    sample = 0
    before = q.copy(), v.copy()
    _arrive(SINGLE, arrays, room, 0.0, solver.rank_tolerance, ASSEMBLY, gap, record.drift)
    record = record._replace(begin=np.concatenate([q, v]))
    directions = marker_rows[:, 2], marker_rows[:, 3]
    turned = np.arctan2(room.z[directions[1]], room.z[directions[0]])
    instants = _instants(steps, step, float(times[-1]), stops)
    steps = len(instants) - 1
    for number, now in enumerate(instants):
        step = now - instants[number - 1] if stops.size and number else solver.step
        if left := now in stops:
            room.until[0] = np.nextafter(now, 0.0)
            _evaluate(SINGLE, arrays, room, now)
            room.until[0], supplied = np.inf, float(room.power[0])
        _evaluate(SINGLE, arrays, room, now)  # step 2
        gauss = _gauss_function(arrays, room, lower, solver.rank_tolerance)
        if gauss is None:
            record.energy_error[0] = np.nan
            break
        counter = EvaluationCounter(gauss)  # step 3
        remembered = y @ gauss.basis if number else None
        place = seek(counter, gauss, solver, search.switches, remembered, number)
        y = gauss.origin + gauss.basis @ place
        length = float(np.linalg.norm(gauss.origin + gauss.basis @ gauss.optimum))
        tally.add(counter.evaluations, float(np.linalg.norm(place - gauss.optimum)), length)

        if loaded:
            if arrays.driven:
                room.gauss.multiplier[:] = (gauss.free - y) @ gauss.inverse
                _drive_power(SINGLE, arrays, room, now)
            last, power = power, float(room.power[0])
            dissipated += 0.5 * step * (last + (supplied if left else power)) if number else 0.0
        moving, energy = float(room.energy[0] + room.energy[1]), float(np.sum(room.energy))
        start = start if number else energy
        record.energy_scale[0] = np.maximum(record.energy_scale[0], moving)
        record.energy_error[0] = np.maximum(record.energy_error[0], abs(energy + dissipated - start))
        turn = np.arctan2(room.z[directions[1]], room.z[directions[0]]) - turned
        turned = turned + turn - 2 * np.pi * np.rint(turn / (2 * np.pi))
        while sample < len(times) and times[sample] <= now + 1e-9 * step:
            inside[:n] = _between(before, (q, v), 1.0 - (now - times[sample]) / step, step) if number else q
            _derive(SINGLE, arrays, inside)
            samples[sample, :, :4], samples[sample, :, 4] = inside[marker_rows], turned
            sample += 1
        record.reached[0], record.steps[0], record.evaluations[0] = now, number, number + 1
        if search.progress is not None and number:
            search.progress(number, steps)
        if number == steps:
            break
        step = instants[number + 1] - now if stops.size else solver.step
        before = q.copy(), v.copy()
        v += step * solve_triangular(lower, y, lower=True, trans=1)  # step 4
        q += step * v
        _arrive(SINGLE, arrays, room, now + step, solver.rank_tolerance, 3, gap, record.drift)
    named = "named by the scene" if solver.integrator == INTEGRATOR else "auto: the time step of the swarm's paper"
    return record, {
        "acceleration": solver.acceleration,
        "integrator_reason": named,
        "swarm": {
            "size": solver.swarm_size,
            "iterations": solver.swarm_iterations,
            "seed": solver.swarm_seed,
            **({} if solver.acceleration == "afsa" else asdict(search.switches)),
            **tally.facts(),
        },
    }


def _instants(steps: int, step: float, end: float, stops: Array) -> list[float]:
    """The ends of fixed steps [s], cut short at the stops."""
    grid = np.arange(steps + 1) * step
    if stops.size:
        apart = np.abs(grid[:, None] - stops).min(axis=1) > RESOLUTION * end
        grid = np.union1d(grid[apart & (grid <= end * (1 + RESOLUTION))], stops)
    instants: list[float] = grid.tolist()
    return instants


def _gauss_function(arrays: Arrays, room: Work, lower: Array, tolerance: float) -> GaussFunction | None:
    """Eq. 16 for the state that was just evaluated; None where its numbers are not finite."""
    c = arrays.constraints
    rows = np.zeros((c.size, arrays.unknowns))
    rows[np.repeat(np.arange(c.size), np.diff(c.entry)), c.column] = room.gauss.jacobian
    load, eta = room.a[: arrays.unknowns], room.gauss.gap
    with np.errstate(over="ignore", invalid="ignore"):
        if not np.isfinite(load @ load + np.sum(rows * rows) + eta @ eta):
            return None
    return gauss_function(lower, load, rows, eta, tolerance)


def _dense_mass(arrays: Arrays) -> Array:
    """M, (n, n), from its sparse pattern for one lane."""
    n, pattern = arrays.unknowns, arrays.pattern
    mass = np.diag(arrays.mass[:n])
    column = np.repeat(np.arange(n), np.diff(pattern.column))
    mass[pattern.row, column] = mass[column, pattern.row] = arrays.mass[n:]
    return mass


def _between(before: tuple[Array, Array], after: tuple[Array, Array], x: float, h: float) -> Array:
    """Coordinates at the fraction x of a step of h [s] from coordinates and rates at its ends (Hermite), (n,)."""
    (q0, v0), (q1, v1), y = before, after, 1.0 - x
    place: Array = (1 + 2 * x) * y * y * q0 + h * x * y * y * v0 + (1 + 2 * y) * x * x * q1 - h * y * x * x * v1
    return place


# Doors: what one compiled kernel after the other computes of the state in `room`.


@njit(cache=True, error_model="numpy")
def _loaded(arrays: Arrays) -> bool:
    """Whether power is dissipated or supplied."""
    loaded: bool = dynamics.loaded(model.raw(arrays))
    return loaded


@njit(cache=True, error_model="numpy")
def _evaluate(tile: Tile, arrays: Arrays, room: Work, t: float) -> None:
    """Q into room.a, C_q into room.gauss.jacobian, eta into room.gauss.gap; all derived rows are filled."""
    m, w = model.raw(arrays), dynamics.raw(room)
    dynamics.enter(m, w)
    dynamics.force(tile, m, w, t, w.z, w.zdot, w.a)
    dynamics.derive(tile, m, w.z, m.rows, False)
    dynamics.derive(tile, m, w.zdot, m.rows, True)
    constraints.jacobian(tile, m.constraints, w.z, 1.0, w.gauss.jacobian)
    constraints.bias(tile, m.constraints, m.functions, t, w.zdot, w.gauss.gap)


@njit(cache=True, error_model="numpy")
def _drive_power(tile: Tile, arrays: Arrays, room: Work, t: float) -> None:
    """Subtract from room.power what the driven constraints supply by room.gauss.multiplier."""
    m, w = model.raw(arrays), dynamics.raw(room)
    constraints.add_power(tile, m.constraints, m.functions, t, w.gauss.multiplier, w.power)


@njit(cache=True, error_model="numpy")
def _arrive(
    tile: Tile, arrays: Arrays, room: Work, t: float, tolerance: float, iterations: int, gap: Array, worst: Array
) -> None:
    """After a step: remove the drift if the scene wants it, then look at energy (room.energy) and drift (worst)."""
    m, w = model.raw(arrays), dynamics.raw(room)
    dynamics.enter(m, w)
    dynamics.settle(tile, m, w, t, tolerance, iterations)
    dynamics.remember(tile, m, w)
    dynamics.energies(tile, m, w)
    dynamics.derive(tile, m, w.z, m.rows, False)
    constraints.drift(tile, m.constraints, m.functions, t, w.z, gap, worst)


@njit(cache=True, error_model="numpy")
def _derive(tile: Tile, arrays: Arrays, z: Array) -> None:
    """Fill the derived rows of coordinates z (rows,)."""
    dynamics.derive(tile, model.raw(arrays), pointer(z), arrays.rows, False)
