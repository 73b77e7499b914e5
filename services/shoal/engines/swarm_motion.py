"""Gauss's principle solved by a fish swarm at every time step: the loop of the paper's section 4.2, for one lane.

It stands beside the other ways to the acceleration so that its cost and accuracy appear in the same tables. With
M = L L' and y = L' a, Gauss's function (eq. 16) is G = 1/2 |y - y_f|^2, y_f = L^-1 Q, and the constraints are the rows
C_q L^-T y = -eta. Fish have to satisfy them, so a fish is a place x in the null space: y = y_p + N x with the
least-norm particular solution y_p and an orthonormal basis N. Its unit is that of y, sqrt(kg) m/s^2.

What the paper leaves open:
- the box of the first swarm: |x_j| <= |y_f|, because the optimum N' y_f is never longer than y_f;
- x_0 of step 3-2, the optimum of the unconstrained function: N' y_f, which is the free acceleration carried into the
  null space by the mass metric. There it is the optimum of the constrained function as well, so this seed is
  the answer;
- q_{tau-1} of step 3-2, the optimum of the previous time step, carried into the present null space likewise;
- what is returned: the best fish ever seen, or (`keep_best` off) the P_g of step 3-7, which the printed steps forget.

A swarm compares values of G, and cannot separate places whose G differs by less than round-off: the acceleration is
known to about the square root of that, 1e-8 of |y_f|, after any number of iterations. It finds the minimiser,
which at a singular position is in general not the acceleration of the motion (see `projection`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import simulate as mechanics
from shoal.mechanics.dynamics import Work
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Scene, Solver
from shoal.swarm import OPTIMIZERS, EvaluationCounter, minimize
from shoal.trajectory import Trajectory

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
class SwarmSettings:
    """Settings of the search for the accelerations of a run.

    progress(steps done, steps in all): called after every step
    """

    switches: Switches = Switches()
    progress: Callable[[int, int], None] | None = None


def simulate(scene: Scene, times: Array, search: SwarmSettings | None = None) -> Trajectory:
    """Motion of a scene whose accelerations a swarm seeks, sampled at `times` [s]: the march of all other runs.

    The trajectory's `model` says under `swarm` what the swarm did: evaluations of Gauss's function counted,
    accelerations sought, mean and worst `excess` of G above its true minimum [kg m^2/s^4], mean and worst `error` of
    the acceleration relative to the true one, both measured in the mass metric. Raises InputError.
    """
    solver = scene.solver
    if solver.integrator not in ("auto", INTEGRATOR):
        raise InputError(
            f"solver.integrator: {solver.integrator} does not go with solver.acceleration={solver.acceleration}; "
            f"use {INTEGRATOR} or auto"
        )
    steps = int(np.ceil(times[-1] / solver.step - 1e-9))
    seeker = Seeker(solver, search or SwarmSettings(), steps)
    paced = scene.with_values({"solver.integrator": INTEGRATOR, "solver.acceleration": "projection"})
    run = mechanics.simulate(paced, times, seek=seeker.begin)
    named = "named by the scene" if solver.integrator == INTEGRATOR else "auto: the time step of the swarm's paper"
    told = {"acceleration": solver.acceleration, "integrator_reason": named, "swarm": seeker.facts()}
    return replace(run, model=run.model | told)


def only_lane(scene: Scene, values: Mapping[str, Array], lanes: int) -> Scene:
    """The scene with the values of its only lane. Raises InputError if there are more."""
    if lanes > 1:
        raise InputError(
            f"solver.acceleration: {scene.solver.acceleration} moves one lane at a time, found {lanes}; use projection"
        )
    return scene.with_values({path: float(np.ravel(lane)[0]) for path, lane in values.items()})


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
        """Return the minimiser of G, (d,)."""
        return self.free @ self.basis

    @property
    def radius(self) -> float:
        """Half the side of the box that holds the optimum, sqrt(kg) m/s^2."""
        return float(np.linalg.norm(self.free)) or 1.0


def gauss_function(lower: Array, load: Array, rows: Array, eta: Array, tolerance: float) -> GaussFunction:
    """Set up eq. 16. lower: L (n, n), load: Q (n,), rows: C_q (constraints, n), eta: (constraints,).

    tolerance: singular values below it, of rows of unit length in the mass metric, count as zero.
    """
    from scipy.linalg import solve_triangular

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
    swarm = OPTIMIZERS[solver.acceleration]
    parts: dict[str, Any] = {
        "traditional": gauss.optimum if switches.seed_traditional else None,
        "previous": previous if switches.seed_previous else None,
        "use_mutation": switches.mutation,
        "use_velocity": switches.velocity,
    }
    own = {field.name for field in fields(swarm)}
    fish = swarm(lower=-upper, upper=upper, size=solver.swarm_size, **{k: v for k, v in parts.items() if k in own})
    rng = np.random.default_rng([solver.swarm_seed, number])
    found = minimize(fish, function, rng=rng, iterations=solver.swarm_iterations)
    best: Array = found.best if switches.keep_best else getattr(found, "group_best", found.best)
    return best


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


@dataclass
class Seeker:
    """Seeks one acceleration after the other, for `mechanics.simulate`; steps: of the run, for who waits."""

    solver: Solver
    search: SwarmSettings
    steps: int
    tally: _Tally = field(default_factory=_Tally)

    def begin(self, arrays: Arrays, room: Work) -> Callable[[float, Array], None]:
        """The function that turns forces Q (unknowns,) into the acceleration, for the state in `room`."""
        from scipy.linalg import cholesky

        self._arrays, self._room = arrays, room
        self._lower = cholesky(sparse.matrix(arrays.pattern, arrays.mass).toarray(), lower=True)
        self._found: Array | None = None
        return self._seek

    def _seek(self, t: float, a: Array) -> None:
        """Steps 2 and 3 of the paper's loop."""
        from scipy.linalg import solve_triangular

        number = self.tally.accelerations
        gauss = _gauss_function(self._arrays, self._room, self._lower, a, self.solver.rank_tolerance)
        if gauss is None:
            a[:] = np.nan
            return
        counter = EvaluationCounter(gauss)
        remembered = None if self._found is None else self._found @ gauss.basis
        place = seek(counter, gauss, self.solver, self.search.switches, remembered, number)
        self._found = gauss.origin + gauss.basis @ place
        length = float(np.linalg.norm(gauss.origin + gauss.basis @ gauss.optimum))
        self.tally.add(counter.evaluations, float(np.linalg.norm(place - gauss.optimum)), length)
        self._room.gauss.multiplier[:] = (gauss.free - self._found) @ gauss.inverse
        a[:] = solve_triangular(self._lower, self._found, lower=True, trans=1)
        if self.search.progress is not None and number:
            self.search.progress(min(number, self.steps), self.steps)

    def facts(self) -> dict[str, Any]:
        """Return the statistics of the swarm, for the record."""
        solver = self.solver
        parts = {} if solver.acceleration == "afsa" else asdict(self.search.switches)
        size = {"size": solver.swarm_size, "iterations": solver.swarm_iterations, "seed": solver.swarm_seed}
        return {**size, **parts, **self.tally.facts()}


def _gauss_function(arrays: Arrays, room: Work, lower: Array, load: Array, tolerance: float) -> GaussFunction | None:
    """Eq. 16 for the state in `room` and the forces Q; None where its numbers are not finite."""
    c = arrays.constraints
    rows = np.zeros((c.size, arrays.unknowns))
    rows[np.repeat(np.arange(c.size), np.diff(c.entry)), c.column] = room.gauss.jacobian
    eta = room.gauss.gap
    with np.errstate(over="ignore", invalid="ignore"):
        if not np.isfinite(load @ load + np.sum(rows * rows) + eta @ eta):
            return None
    return gauss_function(lower, load, rows, eta, tolerance)
