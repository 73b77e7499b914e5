"""Newton's iteration of the implicit steps, with the factored tangent kept as long as that converges fast.

Coordinates and multipliers are corrected together, by [H C_q'; C_q 0] as one sparse factor. It is kept over iterations
and over steps (modified Newton) and renewed where the changes shrink too slowly. They shrink by a rate theta, so that
theta/(1 - theta) of the last change estimates the error (Hairer and Wanner, Solving Ordinary Differential Equations II,
section IV.8). Where they grow, the step begins again, with a new factor, then with one for every iteration.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, typeof, types

from shoal.compile.function_pointers import call
from shoal.compile.pointers import raw_type, shift
from shoal.compile.simd import add_scaled, assign
from shoal.compile.structures import Reference
from shoal.compile.vector import add, clear, copy, subtract
from shoal.mechanics import constraints, dynamics, kernels, saddle, signals
from shoal.mechanics import tangent as tangents
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import feedback, guess
from shoal.mechanics.integrators.feedback import Feedback, feedback_room
from shoal.mechanics.integrators.guess import Guess, guess_room
from shoal.mechanics.model import Arrays, Model, seen
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.mechanics.tangent import Tangent, assembled, tangent_tile
from shoal.scene import Solver

ITERATIONS = 30
"""With a tangent of its own for each of them, after which a step has failed."""
SLACK = 1e3
"""A step that misses the tolerance by more than this factor has failed."""
EXACT = 1e-3
"""What may be left of a change, as a fraction of the tolerance: stiff parts turn a small error into a large force."""
FURTHER = 3
"""A factor that needs more than so many further iterations, or iterations more than a new one, is renewed."""
NEGLIGIBLE = 1e-4
"""A change smaller than this fraction of the tolerance is round-off."""
LONGEST_PAUSE = 63
"""Steps in a row that begin with a new factor where none served a second step."""
RENEW, FULL, BEGAN, AGE, USUAL, PAUSE, WAIT, MASS, DAMPING = range(9)
"""What is remembered of the factor: whether the next iteration needs a new one, and all of this step, and whether its
first one did; how many steps it has served; how many iterations a step with a new one took; how many steps are to begin
with a new one, and how many still; the factors of M and D in it."""
GO_ON, CONVERGED, LOST = range(3)


class Newton(NamedTuple):
    """Settings and room. tolerance: of a coordinate [m].

    matrix: the factored tangent, (slots, lanes); memory: its factors, age and convergence. block: tangents of the
    elements. residual: the unbalanced force, then the change of the coordinates, (rows, lanes). multiplier: lambda,
    kept from step to step, (constraints, lanes). x: right-hand side in the order of elimination. begin: coordinates,
    rates, accelerations and multipliers of the first guess. change, left: the largest change of a coordinate and its
    estimated error, (lanes,). feedback: of signals, by `_feed_back`. The kernels take it with pointers (`raw`).
    """

    tolerance: float
    rank_tolerance: float
    tangent: Tangent
    slots: int
    matrix: Array
    memory: Array
    block: Array
    residual: Array
    multiplier: Array
    x: Array
    begin: Array
    change: Array
    left: Array
    guess: Guess
    feedback: Feedback


def newton_room(solver: Solver, model: Model, tile: Tile, lanes: slice) -> Newton:
    """Settings and room for one tile of lanes."""
    width = len(tile)
    tangent = assembled(model, tile, lanes, tangent_tile(model, tile, lanes, held=True))
    held = max(1, model.constraints.size) * width
    newton = Newton(
        solver.newton_tolerance,
        solver.rank_tolerance,
        tangent,
        tangent.pattern.slots,
        np.zeros(tangent.mass.size),
        np.zeros(9),
        np.zeros((2 * tangent.blocks + 1) * width),
        np.zeros(model.rows * width),
        np.zeros(held),
        np.zeros(tangent.pattern.size * width),
        np.zeros(3 * model.unknowns * width + held),
        np.zeros(width),
        np.zeros(width),
        guess_room(model, tile),
        feedback_room(model, tile, tangent.pattern.size),
    )
    if not model.signals:
        return newton
    found = kernels.address(("feedback", width), lambda: _kernel(model, tile, lanes, newton))
    return newton._replace(feedback=newton.feedback._replace(address=found))


def _kernel(model: Model, tile: Tile, lanes: slice, newton: Newton) -> kernels.Kernel:
    """Return the kernel of `_feed_back` with the types of its arguments."""
    arrays = model.tile(tile, lanes)
    parts = arrays.followed, newton, seen(arrays), dynamics.work_space(tile, arrays)
    s, own, m, w = (Reference(raw_type(typeof(part))) for part in parts)
    return _feed_back, (typeof(tile), s, own, m, w, types.float64, types.CPointer(types.float64), types.boolean)


@njit(cache=True, error_model="numpy")
def _feed_back(tile, s, newton, m, w, damping_factor, x, renew):  # type: ignore[no-untyped-def]
    """Prepare Woodbury's formula for a new factor, or correct a solution x, in the order of elimination."""
    f, pattern, place = newton.feedback, newton.tangent.pattern, newton.tangent.held.place
    placed, n, size = m.constraints.size > 0, m.unknowns, s.strengths
    if renew:
        signals.follow(tile, m, w, 0.0, w.z, w.zdot, w.stage, signals.DERIVE)
        for k in range(size):
            column = shift(f.column, k * pattern.size * len(tile))
            for i in range(pattern.size):
                clear(tile, column, i)
            for i in range(n):
                copy(tile, column, place[i] if placed else i, signals.block(tile, s, m, w, k), i)
            sparse.solve(tile, pattern, newton.matrix, column, 0)
            for i in range(n):
                copy(tile, w.stage, i, column, place[i] if placed else i)
            out = shift(f.inverse, k * size * len(tile))
            feedback.project(tile, s, m, w, 1.0, damping_factor, w.stage, out)
        feedback.close(tile, size, f.inverse, f.part)
    else:
        for i in range(n):
            copy(tile, w.stage, i, x, place[i] if placed else i)
        feedback.project(tile, s, m, w, 1.0, damping_factor, w.stage, f.part)
        feedback.add(tile, size, f.inverse, f.column, pattern.size, f.part, x)


@njit(cache=True, error_model="numpy")
def add_reactions(tile: Tile, m: Arrays, w: Work, newton: Newton, z: Array) -> None:
    """residual -= C_q(z)' lambda. Leaves C_q in w.gauss.jacobian."""
    if m.constraints.size > 0:
        derive(tile, m.derived, z, m.unknowns, m.held_rows, False)
        constraints.jacobian(tile, m.constraints, z, 1.0, w.gauss.jacobian)
        constraints.subtract_transposed(tile, m.constraints, w.gauss.jacobian, newton.multiplier, newton.residual)


@njit(cache=True, error_model="numpy")
def correct(
    tile: Tile, m: Arrays, w: Work, newton: Newton, z: Array, mass_factor: float, damping_factor: float
) -> None:
    """Solve H dq + C_q' dlambda = residual, C_q dq = -gap: the residual becomes dq, the multipliers are updated.

    H = mass_factor M + damping_factor D + K + curvature of the constraints at z, whose derived rows are filled, or at
    an earlier z; C_q, gap: w.gauss.jacobian, w.gauss.gap.
    """
    pattern, held, count = newton.tangent.pattern, newton.tangent.held, m.constraints.size
    if newton.memory[RENEW] > 0.0:
        _renew(tile, m, w, newton, z, mass_factor, damping_factor)
    if count == 0:
        sparse.solve(tile, pattern, newton.matrix, newton.residual, 0)
        if newton.feedback.address != 0:
            arguments = (m.signals, newton, m, w, damping_factor, newton.residual, False)
            call(newton.feedback.address, (tile, *arguments))
        return
    for i in range(m.unknowns):
        copy(tile, newton.x, held.place[i], newton.residual, i)
    for k in range(count):
        clear(tile, newton.x, held.place[m.unknowns + k])
        subtract(tile, newton.x, held.place[m.unknowns + k], w.gauss.gap, k)
    sparse.solve(tile, pattern, newton.matrix, newton.x, 0)
    if newton.feedback.address != 0:
        arguments = (m.signals, newton, m, w, damping_factor, newton.x, False)
        call(newton.feedback.address, (tile, *arguments))
    for i in range(m.unknowns):
        copy(tile, newton.residual, i, newton.x, held.place[i])
    for k in range(count):
        add(tile, newton.multiplier, k, newton.x, held.place[m.unknowns + k])


@njit(cache=True, error_model="numpy")
def _renew(tile: Tile, m: Arrays, w: Work, newton: Newton, z: Array, mass_factor: float, damping_factor: float) -> None:
    """Factor the tangent at z."""
    tangent, matrix, memory, c = newton.tangent, newton.matrix, newton.memory, m.constraints
    factors = mass_factor, damping_factor
    tangents.assemble(tile, m, tangent, w, z, newton.multiplier, *factors, newton.block, matrix, newton.slots)
    if c.size == 0:
        sparse.factor(tile, tangent.pattern, matrix)
    else:
        for e in range(c.entry[c.size]):
            copy(tile, matrix, tangent.held.slot[e], w.gauss.jacobian, e)
        # Pivots are squares of distances from singular, whose round-off is that of the tangent.
        tolerance = max(newton.rank_tolerance**2, 1e-13)
        # Distances in the metric of the tangent are not recorded; x is free until the right-hand side is put there.
        saddle.eliminate(tile, tangent.pattern, tangent.held.multiplier, matrix, tolerance, newton.x)
    if newton.feedback.address != 0:
        arguments = (m.signals, newton, m, w, damping_factor, newton.residual, True)
        call(newton.feedback.address, (tile, *arguments))
    memory[RENEW], memory[AGE], memory[MASS], memory[DAMPING] = memory[FULL], 0.0, mass_factor, damping_factor


@njit(cache=True, error_model="numpy")
def begin(
    tile: Tile, m: Arrays, w: Work, newton: Newton, mass_factor: float, damping_factor: float, tied: bool
) -> None:
    """Begin the iteration from the guess in w, or a better one; decide whether the factor serves.

    tied: whether the iteration moves rates and accelerations with the coordinates, as in `solve`.
    """
    width, end, memory = len(tile), m.unknowns * len(tile), newton.memory
    guess.improve(tile, m, newton.guess, w.z, newton.residual)
    if tied:
        add_scaled(w.zdot, damping_factor, newton.residual, end)
        add_scaled(w.a, mass_factor, newton.residual, end)
    assign(newton.begin, w.z, end)
    assign(shift(newton.begin, end), w.zdot, end)
    assign(shift(newton.begin, 2 * end), w.a, end)
    assign(shift(newton.begin, 3 * end), newton.multiplier, m.constraints.size * width)
    for lane in range(width):
        # What is no number now does not keep the others waiting.
        nothing = 0.0
        for i in range(lane, end, width):
            nothing += 0.0 * (w.z[i] + w.zdot[i])
        newton.change[lane] = np.inf if nothing == 0.0 else np.nan
    memory[FULL] = 0.0
    memory[AGE] += 1.0
    if memory[MASS] != mass_factor or memory[DAMPING] != damping_factor:
        memory[RENEW] = 1.0
    if memory[WAIT] > 0.0:
        memory[WAIT] -= 1.0
        memory[RENEW] = 1.0
    memory[BEGAN] = memory[RENEW]


@njit(cache=True, error_model="numpy")
def judge(tile: Tile, m: Arrays, w: Work, newton: Newton, iteration: int, limit: int) -> int:
    """Judge the iteration of this number by the last change of the coordinates, which is still in the residual.

    LOST: w and the multipliers are those of the first guess again. limit: the last iteration.
    """
    width, end, memory = len(tile), m.unknowns * len(tile), newton.memory
    fresh, full = memory[AGE] == 0.0, memory[FULL] > 0.0
    done, slow, lost = True, False, iteration == limit
    for lane in range(width):
        before = newton.change[lane]
        if before != before:
            continue
        change = 0.0
        for i in range(lane, end, width):
            size = abs(newton.residual[i])
            if not size <= change and change == change:
                change = size
        newton.change[lane], newton.left[lane] = change, change
        rate = change / before if before > 0.0 else 0.0
        if before < np.inf and rate < 1.0:
            newton.left[lane] = min(change, change * rate / (1.0 - rate))
        within = newton.left[lane] <= EXACT * newton.tolerance or (full and change <= newton.tolerance)
        # A change that is that small and does not shrink may be round-off, or the factor's fault.
        if within and (fresh or full or rate <= 0.5 or change <= NEGLIGIBLE * newton.tolerance):
            continue
        done = False
        lost = lost or not change < np.inf or (rate >= 1.0 and not within)
        slow = slow or within or newton.left[lane] * rate**FURTHER > EXACT * newton.tolerance
    if done:
        if full or (not fresh and iteration > memory[USUAL] + FURTHER):
            memory[RENEW] = 1.0
        elif memory[BEGAN] > 0.0:
            memory[USUAL] = iteration
        return CONVERGED
    if full:
        return GO_ON
    if lost or slow:
        memory[RENEW] = 1.0
        if memory[AGE] == 1.0:
            memory[PAUSE] = min(2.0 * memory[PAUSE] + 1.0, LONGEST_PAUSE)
            memory[WAIT] = memory[PAUSE]
        elif not fresh:
            memory[PAUSE] = 0.0
    if not lost:
        return GO_ON
    memory[FULL] = 1.0 if fresh or iteration == limit else 0.0
    assign(w.z, newton.begin, end)
    assign(w.zdot, shift(newton.begin, end), end)
    assign(w.a, shift(newton.begin, 2 * end), end)
    assign(newton.multiplier, shift(newton.begin, 3 * end), m.constraints.size * width)
    for lane in range(width):
        if newton.change[lane] == newton.change[lane]:
            newton.change[lane] = np.inf
    return LOST


@njit(cache=True, error_model="numpy")
def finish(tile: Tile, m: Arrays, w: Work, newton: Newton) -> None:
    """Remember the end of a step, found or not.

    A lane whose iteration did not converge must not go on with a plausible number: it becomes nan.
    """
    width = len(tile)
    for lane in range(width):
        if not newton.left[lane] <= SLACK * newton.tolerance:
            for i in range(lane, m.unknowns * width, width):
                w.z[i] = np.nan
    guess.learn(tile, m, newton.guess, w.z)


@njit(cache=True, error_model="numpy")
def solve(tile: Tile, m: Arrays, w: Work, newton: Newton, t: float, mass_factor: float, damping_factor: float) -> int:
    """Find the end of a step at the time t: M a + C_q' lambda = Q(q, v, t), C(q) = 0; returns the iterations.

    The method ties rates and accelerations to coordinates: dv = damping_factor dq, da = mass_factor dq. w holds the
    first guess, of a step begun by `guess.start`, then the solution. The power that is left in w is that of the
    last guess; see `take_power`.
    """
    residual = newton.residual
    end = m.unknowns * len(tile)
    iterations, limit = 0, ITERATIONS
    t = dynamics.instant(w, t)
    begin(tile, m, w, newton, mass_factor, damping_factor, True)
    while iterations < limit:
        iterations += 1
        kernels.force(tile, m, w, t, w.z, w.zdot, residual)
        dynamics.multiply_mass(tile, m, w.a, w.stage)
        add_scaled(residual, -1.0, w.stage, end)
        add_reactions(tile, m, w, newton, w.z)
        constraints.residual(tile, m.constraints, m.functions, t, w.z, w.gauss.gap)
        correct(tile, m, w, newton, w.z, mass_factor, damping_factor)
        add_scaled(w.z, 1.0, residual, end)
        add_scaled(w.zdot, damping_factor, residual, end)
        add_scaled(w.a, mass_factor, residual, end)
        verdict = judge(tile, m, w, newton, iterations, limit)
        if verdict == CONVERGED:
            break
        if verdict == LOST:
            limit = iterations + ITERATIONS
    finish(tile, m, w, newton)
    return iterations


@njit(cache=True, error_model="numpy")
def take_power(tile: Tile, m: Arrays, w: Work, newton: Newton, t: float) -> None:
    """w.power [W] of loads and drives at the end of a step at the time t; uses w.stage.

    The last correction, however small beside the machine, may be all that small forces did in a short step.
    """
    if dynamics.loaded(m):
        t = dynamics.instant(w, t)
        kernels.force(tile, m, w, t, w.z, w.zdot, w.stage)
        if m.driven:
            constraints.add_power(tile, m.constraints, m.functions, t, newton.multiplier, w.power)
