"""Radau IIA of order 5 with step control: implicit, stiffly accurate, for references of stiff machines.

Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.8. The accelerations of the stages are those
of Gauss's principle, so that constraints cost no order; the drift is projected away after each step. Newton's equations
couple the three stages by the matrix A of the method. Instead of complex arithmetic, A is replaced by the lower
factor T of its Crout decomposition: three real factorisations of M + g D + g^2 K, stage after stage (van der Houwen
and de Swart, Triangularly implicit iteration methods for ODE-IVP solvers, 1997). The iteration converges for every
frequency and decay rate, and at once in three steps for infinite ones.

This file is long because all parts of the step share one room.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, typeof, types

from shoal.compile.function_pointers import call
from shoal.compile.pointers import raw, raw_type, shift
from shoal.compile.simd import assign
from shoal.compile.structures import Reference
from shoal.compile.vector import add_product, clear
from shoal.mechanics import dynamics, kernels, signals
from shoal.mechanics import tangent as tangents
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import control, feedback
from shoal.mechanics.integrators.control import RESOLUTION, Control, control_room
from shoal.mechanics.integrators.feedback import Feedback, feedback_room
from shoal.mechanics.integrators.radau5_tableau import DIFFERENCE, FILTER, RATES, STAGES, A, C, T
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.least import implicit
from shoal.mechanics.model import Arrays, Model, seen
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.mechanics.tangent import Tangent, assembled, tangent_tile
from shoal.scene import Solver

ITERATIONS = 20
CONVERGED = 1e-3
"""What may be left of Newton's error, as a fraction of the error allowed in a step."""
SLOWEST = 0.1
"""The first changes shrink faster than the later ones; no rate below this one is trusted."""
STAGNANT = 5e-2
"""A change below this that does not shrink anymore is round-off."""
ORDER_OF_ERROR = 4
_RENEW, _LOAD, _CORRECT = range(3)
"""Parts of `_feed_back`."""


class Radau5(NamedTuple):
    """Settings and room.

    stiffness, damping: K with the curvature of the constraints, and D, (slots, lanes); factors: of the three stages.
    stage_q, stage_v, stage_a, and of each stage its defect and its product with the Jacobian: (3 * unknowns, lanes).
    change_q, change_v, product: (rows, lanes). slope: acceleration at the beginning. polynomial: of the rate in the
    last step, (4 * unknowns, lanes); last: the length of that step [s], (1,). feedback: of signals, by `_feed_back`.
    """

    rank_tolerance: float
    control: Control
    tangent: Tangent
    feedback: Feedback
    slots: int
    stiffness: Array
    damping: Array
    factors: tuple[Array, Array, Array]
    block: Array
    multiplier: Array
    stage_q: Array
    stage_v: Array
    stage_a: Array
    defect_q: Array
    defect_v: Array
    product_q: Array
    product_v: Array
    change_q: Array
    change_v: Array
    product: Array
    slope: Array
    polynomial: Array
    last: Array
    evaluations: Array


FACTS = Facts(
    order=5,
    explicit=False,
    adaptive=True,
    constraint_forces=True,
    seconds_per_unknown=(1.5e-5, 1.5e-5),
    good_for="stiff machines to a known accuracy: fast vibrations and strong damping do not limit its step",
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> Radau5:
    """Settings for one tile of lanes.

    The error of the embedded method shrinks slower than that of the method itself; the tolerance it is compared with
    is the solver's to the power 2/3, as in Hairer and Wanner's code.
    """
    width = len(tile)
    tangent = assembled(model, tile, lanes, tangent_tile(model, tile, lanes))
    inner = solver.model_copy(
        update={
            "relative_tolerance": 0.1 * solver.relative_tolerance ** (2 / 3),
            "absolute_tolerance": 0.1
            * solver.relative_tolerance ** (2 / 3)
            * (solver.absolute_tolerance / solver.relative_tolerance),
        }
    )
    slots, rows, unknowns = tangent.mass.size, model.rows * width, model.unknowns * width
    room = Radau5(
        solver.rank_tolerance,
        control_room(inner, tile),
        tangent,
        feedback_room(model, tile, model.unknowns, STAGES),
        tangent.pattern.slots,
        np.zeros(slots),
        np.zeros(slots),
        (np.zeros(slots), np.zeros(slots), np.zeros(slots)),
        np.zeros((2 * tangent.blocks + 1) * width),
        np.zeros(max(1, model.constraints.size) * width),
        *(np.zeros(size) for size in (*(STAGES * unknowns,) * 7, rows, rows, rows, unknowns, 4 * unknowns, 1, 1)),
    )
    if not model.signals:
        return room
    found = kernels.address(("feedback of radau5", width), lambda: _kernel(model, tile, lanes, room))
    return room._replace(feedback=room.feedback._replace(address=found))


def _kernel(model: Model, tile: Tile, lanes: slice, room: Radau5) -> kernels.Kernel:
    """Return the kernel of `_feed_back` with the types of its arguments."""
    arrays = model.tile(tile, lanes)
    parts = arrays.followed, room, seen(arrays), dynamics.work_space(tile, arrays)
    s, own, m, w = (Reference(raw_type(typeof(part))) for part in parts)
    return _feed_back, (typeof(tile), s, own, m, w, types.float64, types.int64, types.int64)


@njit(cache=True, error_model="numpy")
def _linearise(tile: Tile, scheme: Radau5, m: Arrays, w: Work, t: float) -> None:
    """Stiffness and damping at the state in w.z, with the multipliers of its acceleration."""
    multiplier = scheme.multiplier
    for k in range(m.constraints.size * len(tile)):
        multiplier[k] = w.gauss.multiplier[k]
    derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
    derive(tile, m.derived, w.zdot, m.unknowns, m.force_rows, True)
    # D is needed where there is friction only; then it is what a second tangent has more.
    for part in range(2 if dynamics.loaded(m) else 1):
        values = scheme.stiffness if part == 0 else scheme.damping
        tangents.assemble(
            tile, m, scheme.tangent, w, w.z, multiplier, 0.0, float(part), scheme.block, values, scheme.slots
        )
    if dynamics.loaded(m):
        for i in range(scheme.slots * len(tile)):
            scheme.damping[i] -= scheme.stiffness[i]
    if scheme.feedback.address != 0:
        signals.follow(tile, m, w, dynamics.instant(w, t), w.z, w.zdot, w.stage, signals.LINEARISE)


@njit(cache=True, error_model="numpy")
def _factor(tile: Tile, scheme: Radau5, m: Arrays, w: Work, h: float) -> None:
    """The matrices M + g D + g^2 K of the three stages, g = h T_ss."""
    pattern = scheme.tangent.pattern
    for s in range(STAGES):
        g = h * T[s, s]
        values = scheme.factors[s]
        for i in range(scheme.slots * len(tile)):
            values[i] = scheme.tangent.mass[i] + g * scheme.damping[i] + g * g * scheme.stiffness[i]
        sparse.factor(tile, pattern, values)
        if scheme.feedback.address != 0:
            call(scheme.feedback.address, (tile, m.signals, scheme, m, w, g, s, _RENEW))


@njit(cache=True, error_model="numpy")
def _solve(tile: Tile, scheme: Radau5, m: Arrays, w: Work, h: float, s: int) -> None:
    """Replace r = (change_q, change_v) by the solution of (1 - g J) x = r, J the Jacobian of the constrained motion.

    H x_v + C_q' mu = M r_v - g K r_q, C_q x_v = C_q r_v, x_q = r_q + g x_v.
    """
    end = m.unknowns * len(tile)
    g = h * T[s, s]
    pattern = scheme.tangent.pattern
    factors = scheme.factors[s]
    change_q, change_v, product = scheme.change_q, scheme.change_v, scheme.product
    sparse.multiply(tile, m.pattern, m.mass, change_v, w.stage)
    sparse.multiply(tile, pattern, scheme.stiffness, change_q, product)
    for i in range(end):
        product[i] = w.stage[i] - g * product[i]
    if scheme.feedback.address != 0:
        call(scheme.feedback.address, (tile, m.signals, scheme, m, w, g, s, _LOAD))
    sparse.solve(tile, pattern, factors, product, 0)
    if m.constraints.size > 0:
        for i in range(end):
            w.stage[i] = product[i] - change_v[i]
        _constrain(tile, scheme, m, w, factors, product)
    if scheme.feedback.address != 0:
        call(scheme.feedback.address, (tile, m.signals, scheme, m, w, g, s, _CORRECT))
    for i in range(end):
        change_v[i] = product[i]
        change_q[i] += g * product[i]


@njit(cache=True, error_model="numpy")
def _constrain(tile: Tile, scheme: Radau5, m: Arrays, w: Work, factors: Array, x: Array) -> None:
    """Let x, a solution without constraints, obey C_q x = C_q (x - w.stage)."""
    implicit.prepare(tile, m, factors, scheme.tangent.pattern, w.z, w.gauss)
    for k in range(m.constraints.size):
        clear(tile, w.gauss.gap, k)
    implicit.add_rates(tile, m, w.gauss, w.stage)
    implicit.apply(tile, m, w.gauss, scheme.rank_tolerance, x)


@njit(cache=True, error_model="numpy")
def _feed_back(tile, s, scheme, m, w, g, stage, part):  # type: ignore[no-untyped-def]
    """Prepare Woodbury's formula for the matrix of a stage, or apply it around a solution in `product`.

    Signals add g b (dS/dq)' r_q to the right-hand side, and take b (g dS/dv + g^2 dS/dq)' from the matrix.
    """
    f, n, size, end = scheme.feedback, m.unknowns, s.strengths, m.unknowns * len(tile)
    column, inverse = shift(f.column, stage * size * end), shift(f.inverse, stage * size * size * len(tile))
    if part == _LOAD:
        feedback.project(tile, s, m, w, g, 0.0, scheme.change_q, f.part)
        for k in range(size):
            force = signals.block(tile, s, m, w, k)
            for i in range(n):
                add_product(tile, scheme.product, i, f.part, k, force, i)
    elif part == _CORRECT:
        feedback.project(tile, s, m, w, g * g, g, scheme.product, f.part)
        feedback.add(tile, size, inverse, column, n, f.part, scheme.product)
    else:
        factors = scheme.factors[0]
        if stage == 1:
            factors = scheme.factors[1]
        elif stage == 2:
            factors = scheme.factors[2]
        for k in range(size):
            x = shift(column, k * end)
            assign(x, signals.block(tile, s, m, w, k), end)
            sparse.solve(tile, scheme.tangent.pattern, factors, x, 0)
            if m.constraints.size > 0:
                assign(w.stage, x, end)
                _constrain(tile, scheme, m, w, factors, x)
            feedback.project(tile, s, m, w, g * g, g, x, shift(inverse, k * size * len(tile)))
        feedback.close(tile, size, inverse, f.part)


@njit(cache=True, error_model="numpy")
def _guess(tile: Tile, scheme: Radau5, m: Arrays, w: Work, h: float) -> None:
    """Set the first stages: the rates predicted by the last step's polynomial, and what follows from them."""
    end = m.unknowns * len(tile)
    q, v, p = scheme.stage_q, scheme.stage_v, scheme.polynomial
    last = scheme.last[0]
    for s in range(STAGES):
        x = 1.0 + C[s] * h / last if last > 0.0 else 0.0
        for i in range(end):
            if last > 0.0:
                v[s * end + i] = p[i] + x * (p[end + i] + x * (p[2 * end + i] + x * p[3 * end + i]))
            else:
                v[s * end + i] = w.before[end + i]
    for s in range(STAGES):
        for i in range(end):
            q[s * end + i] = w.before[i] + h * (A[s, 0] * v[i] + A[s, 1] * v[end + i] + A[s, 2] * v[2 * end + i])


@njit(cache=True, error_model="numpy")
def _evaluate(tile: Tile, scheme: Radau5, m: Arrays, w: Work, t: float, h: float) -> None:
    """Accelerations and defects of the stages."""
    end = m.unknowns * len(tile)
    q, v, a = scheme.stage_q, scheme.stage_v, scheme.stage_a
    defect_q, defect_v = scheme.defect_q, scheme.defect_v
    scheme.evaluations[0] += STAGES
    for s in range(STAGES):
        for i in range(end):
            w.z[i], w.zdot[i] = q[s * end + i], v[s * end + i]
        kernels.acceleration(tile, m, w, t + C[s] * h, w.z, w.zdot, scheme.rank_tolerance, w.a)
        for i in range(end):
            a[s * end + i] = w.a[i]
    for s in range(STAGES):
        for i in range(end):
            slope_q = A[s, 0] * v[i] + A[s, 1] * v[end + i] + A[s, 2] * v[2 * end + i]
            slope_v = A[s, 0] * a[i] + A[s, 1] * a[end + i] + A[s, 2] * a[2 * end + i]
            defect_q[s * end + i] = q[s * end + i] - w.before[i] - h * slope_q
            defect_v[s * end + i] = v[s * end + i] - w.before[end + i] - h * slope_v


@njit(cache=True, error_model="numpy")
def _sweep(tile: Tile, scheme: Radau5, m: Arrays, w: Work, h: float) -> None:
    """Correct the stages one after the other; the size of the correction goes into control.error."""
    width = len(tile)
    end = m.unknowns * width
    c = scheme.control
    defect_q, defect_v = scheme.defect_q, scheme.defect_v
    product_q, product_v = scheme.product_q, scheme.product_v
    change_q, change_v = scheme.change_q, scheme.change_v
    for lane in range(width):
        c.error[lane] = 0.0
    for s in range(STAGES):
        for i in range(end):
            change_q[i], change_v[i] = 0.0, 0.0
            for j in range(s):
                change_q[i] += T[s, j] * product_q[j * end + i]
                change_v[i] += T[s, j] * product_v[j * end + i]
            # What h J times the change of this stage adds to, once the change is known.
            product_q[s * end + i] = defect_q[s * end + i] - change_q[i]
            product_v[s * end + i] = defect_v[s * end + i] - change_v[i]
            change_q[i] -= defect_q[s * end + i]
            change_v[i] -= defect_v[s * end + i]
        _solve(tile, scheme, m, w, h, s)
        for i in range(end):
            scheme.stage_q[s * end + i] += change_q[i]
            scheme.stage_v[s * end + i] += change_v[i]
            product_q[s * end + i] = (product_q[s * end + i] + change_q[i]) / T[s, s]
            product_v[s * end + i] = (product_v[s * end + i] + change_v[i]) / T[s, s]
        _add_square(tile, m, scheme, 1.0 / (2 * STAGES * m.unknowns))
    for lane in range(width):
        c.error[lane] = np.sqrt(c.error[lane])


@njit(cache=True, error_model="numpy")
def _add_square(tile: Tile, m: Arrays, scheme: Radau5, factor: float) -> None:
    """control.error += factor * sum of squares of change_q, change_v in units of the allowed error."""
    width = len(tile)
    c = scheme.control
    for i in range(m.unknowns):
        for lane in range(width):
            q, v = scheme.change_q[i * width + lane], scheme.change_v[i * width + lane]
            c.error[lane] += factor * ((q * c.weight_q[lane]) ** 2 + (v * c.weight_v[lane]) ** 2)


@njit(cache=True, error_model="numpy")
def _iterate(tile: Tile, scheme: Radau5, m: Arrays, w: Work, t: float, h: float) -> bool:
    """Newton's iteration for the stages; true if it converged. If not, control.error is infinite where it failed."""
    c = scheme.control
    previous, rate = np.inf, 1.0
    for iteration in range(ITERATIONS):
        _evaluate(tile, scheme, m, w, t, h)
        _sweep(tile, scheme, m, w, h)
        size = control.worst(tile, c)
        if not np.isfinite(size):
            break
        if iteration > 0:
            rate = size / previous if previous > 0.0 else 0.0
            if rate < 1.0 and size * max(rate, SLOWEST) <= CONVERGED * (1.0 - rate):
                return True
            if rate >= 1.0 and size <= STAGNANT:
                return True
            if rate >= 2.0 or (rate >= 1.0 and iteration > 4):
                break
        elif size <= CONVERGED * CONVERGED:
            return True
        previous = size
    for lane in range(len(tile)):
        if not c.error[lane] <= STAGNANT:
            c.error[lane] = np.inf
    remaining: float = control.worst(tile, c)
    return remaining <= STAGNANT


@njit(cache=True, error_model="numpy")
def _estimate(tile: Tile, scheme: Radau5, m: Arrays, w: Work, h: float) -> None:
    """The error of the step in units of the allowed one, into control.error (Hairer and Wanner II, eq. IV.8.19)."""
    width = len(tile)
    end = m.unknowns * width
    c = scheme.control
    q, v = scheme.stage_q, scheme.stage_v
    for i in range(end):
        raw_q = h * T[FILTER, FILTER] * w.before[end + i]
        raw_v = h * T[FILTER, FILTER] * scheme.slope[i]
        for s in range(STAGES):
            raw_q += DIFFERENCE[s] * (q[s * end + i] - w.before[i])
            raw_v += DIFFERENCE[s] * (v[s * end + i] - w.before[end + i])
        scheme.change_q[i], scheme.change_v[i] = raw_q, raw_v
    _solve(tile, scheme, m, w, h, FILTER)
    for lane in range(width):
        c.error[lane] = 0.0
    _add_square(tile, m, scheme, 1.0 / (2 * m.unknowns))
    for lane in range(width):
        c.error[lane] = np.sqrt(c.error[lane])


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: Radau5, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step from the time t, of at most h [s]; returns its length. w.a holds the acceleration before and after."""
    rest, room = h, raw(scheme)
    end = m.unknowns * len(tile)
    c = room.control
    if not control.begin(tile, m, w, c, t):
        return rest
    for i in range(end):
        room.slope[i] = w.a[i]
    control.weigh(tile, m, w, c)
    _linearise(tile, room, m, w, t)
    h = control.first_trial(c, rest)
    rejected = False
    while True:
        _factor(tile, room, m, w, h)
        _guess(tile, room, m, w, h)
        trial = h
        if _iterate(tile, room, m, w, t, h):
            _estimate(tile, room, m, w, h)
            error = control.worst(tile, c)
            if error <= 1.0:
                break
            h = control.shorter(error, h, ORDER_OF_ERROR)
        else:
            h = control.shorter(np.inf, h, ORDER_OF_ERROR)
        rejected = True
        if h < RESOLUTION * (t + rest):
            if not control.give_up(tile, m, w, c, t):
                return rest
            h = control.first_trial(c, rest)
    control.accept(c, error, trial, ORDER_OF_ERROR, rejected)
    p = room.polynomial
    for i in range(end):
        p[i] = w.before[end + i]
        for k in range(STAGES):
            p[(k + 1) * end + i] = 0.0
            for s in range(STAGES):
                p[(k + 1) * end + i] += RATES[k, s] * (room.stage_v[s * end + i] - w.before[end + i])
        w.z[i], w.zdot[i] = room.stage_q[2 * end + i], room.stage_v[2 * end + i]
    room.last[0] = trial
    kernels.settle(tile, m, w, t + trial, room.rank_tolerance)
    kernels.acceleration(tile, m, w, t + trial, w.z, w.zdot, room.rank_tolerance, w.a)
    room.evaluations[0] += 1
    return trial


@njit(cache=True, error_model="numpy")
def inside(tile: Tile, scheme: Radau5, m: Arrays, w: Work, past: Array, x: float, h: float, q: Array, v: Array) -> None:
    """The collocation polynomial of the rates at the fraction x of the last step, and its integral."""
    end = m.unknowns * len(tile)
    p = raw(scheme).polynomial
    for i in range(end):
        p0, p1, p2, p3 = p[i], p[end + i], p[2 * end + i], p[3 * end + i]
        v[i] = p0 + x * (p1 + x * (p2 + x * p3))
        q[i] = w.before[i] + h * x * (p0 + x * (p1 / 2 + x * (p2 / 3 + x * p3 / 4)))


@njit(cache=True, error_model="numpy")
def forget(scheme: Radau5) -> None:
    """Forget the polynomial of the last step."""
    scheme.last[0] = 0.0


implement(Radau5, step, FACTS, inside, forget)
