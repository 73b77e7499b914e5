"""Steady motions (relative equilibria) of machines whose bodies turn and advance at constant rates.

A steady motion is q(s) = exp(A s) q0 along an affine field X(q) = A q + a. The field is composed of twists: each body
is carried about axes fixed in space (from the left), and a rigid body turns about axes of its own (from the right), as
far as the coordinates that bodies share allow. With q = exp(A s) p the equations of motion become
M (p'' + 2 A p' + A X) = Q(p, X + p') - C_q' lambda. They are independent of time where the tangents do not change along
the motion: a round rotor on any bearings turns from the right and keeps its bearings at rest; a rotor of any shape on
bearings that are the same about the axis is carried from the left, with its bearings, in a turning frame. Where neither
holds, small motions have periodic coefficients (Floquet), and the motion is refused.
Marsden and Ratiu, Introduction to Mechanics and Symmetry, 1999; Lalanne and Ferraris, Rotordynamics
Prediction in Engineering, 1998.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse

from shoal.errors import ComputationError
from shoal.mechanics import plane
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import points
from shoal.mechanics.analysis.balance import BALANCED, CLOSE, STALLED, STRAINED
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.freedom import Freedom, Metric
from shoal.mechanics.analysis.small_motions import ROUND, BoundedMatrix
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.frames import BeamFrame, ModalFrame, RigidFrame
from shoal.mechanics.numerics.newton import newton
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.scene import Scene

FITS = 1e-7
"""Rates of which a smaller part than this is left by twists are those of a steady motion."""
CONSTANT = 1e-5
"""Tangents that change by a smaller part than this along the motion are constant; differences make some 1e-7."""
NEAR = 0.1
"""A steady motion is that of the start if no place is farther from it [size of the machine]."""
ANGLES = np.array([0.37, 1.0, 2.1, 3.3, 4.9])
"""Angles [rad] at which tangents are compared, of which no two differ by a simple part of a turn."""
ANGLE = 1e-3
"""Half the step of differences along the motion [rad]."""
LOOSE = 1e-9
"""Stiffnesses below this part of the largest, or of the speed squared, hold nothing: the phase of a motion is free."""
SHAFT = "; a shaft of element ancf-cable does not turn with its sections, and may have any bearings"
"""Advice where a flexible rod is carried in a turning frame."""
EXACT = 1e-9
"""Relative error of what is made of differences: of fields, by differences of accelerations, and of forces of rates."""
MOST = 30
"""Iterations of Newton's method."""


class NotSteadyError(ComputationError):
    """A start that moves, and not steadily."""


class Twist(NamedTuple):
    """A field of one body: dV = matrix V + constant of all vectors V of the machine. left: about axes in space."""

    body: str
    left: bool
    spin: int | None
    """Number of the axis that it turns about, in space or of the body; None for a translation."""
    matrix: Any
    constant: Array


class Twists:
    """The twists of a machine that its coordinates allow.

    basis: combinations of them that do, (twists, fields)
    """

    def __init__(self, placement: Placement, unknowns: int) -> None:
        self.dimensions = d = placement.scene.dimensions
        vectors, self.bodies, self.places = [], [], []
        frames: dict[str, Any] = {**placement.frames, **placement.drivers}
        for name, frame in frames.items():
            for own, is_place in _vectors(frame):
                vectors.append(own)
                self.bodies.append(name)
                self.places.append(is_place)
        found = points(vectors, unknowns)
        self.matrix = found.matrix.reshape(-1, unknowns)
        self.constant = found.constant.ravel()
        self._inverse = np.linalg.pinv(self.matrix)
        self.twists = [one for name, frame in frames.items() for one in self._of_body(name, frame, d)]
        rng = np.random.default_rng(0)
        states = rng.normal(size=(12, unknowns))
        off = np.concatenate([self._off(q) for q in states])
        _, sizes, ways = np.linalg.svd(off, full_matrices=False)
        self.basis = ways[int(np.sum(sizes > 1e-9 * max(1.0, float(np.max(sizes, initial=0.0))))) :].T

    def _of_body(self, name: str, frame: Any, d: int) -> Iterator[Twist]:
        here = [k for k, body in enumerate(self.bodies) if body == name]
        size = len(self.bodies) * d

        def twist(left: bool, spin: int | None, blocks: list[tuple[int, int, Array]], moved: Any = None) -> Twist:
            constant = np.zeros(size)
            matrix = scipy.sparse.lil_array((size, size))
            for row, column, block in blocks:
                matrix[d * row : d * row + d, d * column : d * column + d] += block
            for k in here if moved is not None else ():
                if self.places[k]:
                    constant[d * k : d * k + d] = moved
            return Twist(name, left, spin, matrix.tocsr(), constant)

        units = np.eye(d)
        quarters = [plane.QUARTER] if d == plane.DIMENSIONS else [_skew(axis) for axis in units]
        for number, quarter in enumerate(quarters):
            yield twist(True, number, [(k, k, quarter) for k in here])
        for axis in units:
            yield twist(True, None, [], axis)
        if not isinstance(frame, RigidFrame) or isinstance(frame, ModalFrame):
            return
        origin, *directors = here
        if d == plane.DIMENSIONS:
            yield twist(False, 0, [(directors[0], directors[0], plane.QUARTER)])
            for block in (units, plane.QUARTER):
                yield twist(False, None, [(origin, directors[0], block)])
            return
        for number, quarter in enumerate(quarters):
            pairs = [(i, k, quarter[k, i]) for i in range(d) for k in range(d) if quarter[k, i]]
            yield twist(False, number, [(directors[i], directors[k], value * units) for i, k, value in pairs])
        for director in directors:
            yield twist(False, None, [(origin, director, units)])

    def _rates(self, q: Array) -> Array:
        """The rates of all vectors under each twist, (vectors * d, twists)."""
        values = self.matrix @ q + self.constant
        return np.stack([one.matrix @ values + one.constant for one in self.twists], axis=1)

    def _off(self, q: Array) -> Array:
        """The part of these rates that no rates of the coordinates give."""
        rates = self._rates(q)
        return np.asarray(rates - self.matrix @ (self._inverse @ rates))

    def at(self, q: Array) -> Array:
        """The rates of the coordinates along the fields, (unknowns, fields)."""
        return np.asarray(self._inverse @ self._rates(q) @ self.basis)

    def field(self, weights: Array) -> tuple[Array, Array]:
        """A and a of X(q) = A q + a, of fields times weights."""
        parts = list(zip(self.basis @ weights, self.twists, strict=True))
        matrix = sum(weight * one.matrix for weight, one in parts)
        constant = sum(weight * one.constant for weight, one in parts)
        return self._inverse @ (matrix @ self.matrix), self._inverse @ (matrix @ self.constant + constant)

    def rates(self, weights: Array, *, left: bool) -> dict[str, Array]:
        """Rates of rotation [rad/s] of bodies about axes in space (left) or of their own, (1 or 3,)."""
        found: dict[str, Array] = {name: np.zeros(1 if self.dimensions == 2 else 3) for name in self.bodies}
        for weight, one in zip(self.basis @ weights, self.twists, strict=True):
            if one.left == left and one.spin is not None:
                found[one.body][one.spin] += weight
        return found

    @property
    def turning(self) -> Array:
        """The part of the basis that turns bodies about axes in space."""
        return self.basis[[one.left and one.spin is not None for one in self.twists]]

    def fastest(self, rates: Array, size: float) -> tuple[float, str]:
        """The largest of rates or accelerations of the coordinates, at a place (or a direction times a size)."""
        found = np.linalg.norm((self.matrix @ rates).reshape(-1, self.dimensions), axis=1)
        found = np.where(self.places, found, size * found)
        return float(np.max(found)), self.bodies[int(np.argmax(found))]


def _vectors(frame: Any) -> Iterator[tuple[Any, bool]]:
    """Vectors that a body's coordinates are, and whether each is a place."""
    if isinstance(frame, BeamFrame):
        for node in frame.nodes:
            yield node[0], True
            yield from ((vector, False) for vector in node[1:])
        yield from ((vector, False) for vector in frame.axes.values())
    else:
        first, *others = getattr(frame, "vectors", [frame])
        yield first, True
        yield from ((vector, False) for vector in others)


def _skew(axis: Array) -> Array:
    return np.asarray(turns.skew(axis))


@dataclass(frozen=True, eq=False)
class Steady:
    """A steady motion and the tangents about it.

    q, v: coordinates and rates at the time t [s]; matrix, constant: A and a of its field; carried: of each body the
    rate [rad/s] of the frame that it is seen in, (3,); axis: that the fastest body turns about, (3,); speed: of that
    body [rad/s]; least: size of forces that count for nothing; moved: how far the start is away [m].
    """

    scene: Scene
    evaluator: Evaluator
    metric: Metric
    t: float
    q: Array
    v: Array
    matrix: Array
    constant: Array
    carried: dict[str, Array]
    axis: Array
    speed: float
    least: float
    moved: float = 0.0

    def look(self, q: Array, v: Array, a: Array, t: float) -> Seen:
        """Tangents, free directions and unbalanced forces at a state with a given acceleration."""
        evaluation = self.evaluator.at(q, v, t)
        freedom = self.metric.freedom(evaluation.jacobian)
        force = evaluation.force - self.evaluator.mass @ a
        multipliers = freedom.multipliers(force)
        loose = self.evaluator.stiffness(q, t)
        full = self.evaluator.stiffness(q, t, multipliers=multipliers)
        stiffness = BoundedMatrix(full.toarray(), (ROUND * (abs(loose) + abs(full - loose))).toarray())
        damping = self.evaluator.damping(q, v).toarray()
        return Seen(
            evaluation.jacobian.toarray(), freedom, freedom.basis.T @ force, evaluation.gap, stiffness, damping,
            max(self.least, *(self.metric.size(part) for part in
                              (evaluation.elastic, evaluation.force - evaluation.elastic, self.evaluator.mass @ a))),
        )  # fmt: skip

    def here(self) -> Seen:
        """The same at the state of the motion."""
        return self.look(self.q, self.v, self.matrix @ self.v, self.t)

    def after(self, s: float) -> tuple[Array, Array, Array]:
        """exp(A s), and coordinates and rates a time s [s] later."""
        n = len(self.q)
        whole = np.zeros((n + 1, n + 1))
        whole[:n, :n], whole[:n, n] = self.matrix, self.constant
        moved = scipy.linalg.expm(whole * s)
        turned = moved[:n, :n]
        return turned, turned @ self.q + moved[:n, n], turned @ self.v

    def stiffness(self, seen: Seen) -> BoundedMatrix:
        """Stiffness of small motions in the moving frame, with the centrifugal one and that of forces of rates."""
        inertial = self.evaluator.mass @ self.matrix @ self.matrix
        friction = self._by_rates(seen)
        matrix = seen.stiffness.matrix + inertial - friction
        bound = seen.stiffness.bound + EXACT * (abs(inertial) + abs(friction))
        return BoundedMatrix(np.asarray(matrix), np.asarray(bound))

    def gyroscopic(self, seen: Seen) -> BoundedMatrix:
        """Damping and gyroscopic matrix of small motions in the moving frame."""
        coriolis = 2.0 * (self.evaluator.mass @ self.matrix)
        return BoundedMatrix(seen.damping + coriolis, ROUND * abs(seen.damping) + EXACT * abs(coriolis))

    def _by_rates(self, seen: Seen) -> Array:
        """Derivative along the free directions of the forces that the rates X(q) make."""
        n, basis = len(self.q), seen.freedom.basis

        def made(q: Array) -> Array:
            at_rest = self.evaluator.force(q, np.zeros(n), self.t)
            return self.evaluator.force(q, self.matrix @ q + self.constant, self.t) - at_rest

        if not np.any(seen.damping) and not np.any(made(self.q)):
            return np.zeros((n, n))
        columns = []
        for way in basis.T:
            step = 1e-6 / max(float(np.max(np.abs(way))), 1e-300)
            columns.append((made(self.q + step * way) - made(self.q - step * way)) / (2.0 * step))
        return np.stack(columns, axis=1) @ (self.evaluator.mass @ basis).T if columns else np.zeros((n, n))


class Seen(NamedTuple):
    """A state of a steady motion. unbalanced: forces along the free directions; size: of all forces."""

    jacobian: Array
    freedom: Freedom
    unbalanced: Array
    gap: Array
    stiffness: BoundedMatrix
    damping: Array
    size: float


class _Scaled:
    """Matrices of small motions by modes, relative to what these are stiff and move by at a speed."""

    def __init__(self, steady: Steady, seen: Seen) -> None:
        self.basis = seen.freedom.basis
        stiffness = self.basis.T @ ((seen.stiffness.matrix + seen.stiffness.matrix.T) / 2) @ self.basis
        squares, self.turn = scipy.linalg.eigh(stiffness) if len(stiffness) else (np.zeros(0), stiffness)
        self.least = max(steady.speed**2, 1e-12 * float(np.max(np.abs(squares), initial=1e-12)))
        self.modes = self.basis @ self.turn
        self.weight = 1.0 / np.sqrt(np.abs(squares) + self.least)

    def stiffness(self, matrix: Array) -> Array:
        return np.asarray(self.weight[:, None] * (self.modes.T @ matrix @ self.modes) * self.weight)

    def damping(self, matrix: Array) -> Array:
        root = np.sqrt(self.weight)
        return np.asarray(root[:, None] * (self.modes.T @ matrix @ self.modes) * root)

    def mass(self, matrix: Array) -> Array:
        return np.asarray(self.modes.T @ matrix @ self.modes)

    def rows(self, jacobian: Array, matrix: Array) -> Array:
        lengths = np.linalg.norm(jacobian, axis=1, keepdims=True)
        return np.asarray(matrix @ self.modes / np.where(lengths > 0, lengths, 1.0))


def steady_motion(
    scene: Scene, placement: Placement, evaluator: Evaluator, q: Array, v: Array, t: float, *, seek: bool
) -> Steady:
    """The steady motion that begins at coordinates q with rates v.

    seek: whether its place may be elsewhere, near, as where rods stretch; the field of the rates is that of the start.
    Raises ComputationError where there is none, with the residual acceleration in the moving frame.
    """
    if bent := [name for name, frame in placement.frames.items() if isinstance(frame, ModalFrame)]:
        # Kane, Ryan and Banerjee, Dynamics of a cantilever beam attached to a moving base, 1987.
        raise NotSteadyError(
            f"{scene.name}: the start moves, and the modes of bodies.{bent[0]} lack the centrifugal stiffening of a "
            "rod that turns; take element ancf-cable or ancf-quintic"
        )
    twists = Twists(placement, len(q))
    metric, size = Metric(evaluator.mass), span(scene)
    refusal: ComputationError | None = None
    for weights, idle in _fields(twists, evaluator, q, v, t):
        begun = _steady(scene, evaluator, metric, twists, weights, q, t)
        try:
            return _checked(begun, twists, weights, idle, v, size, seek=seek)
        except ComputationError as error:
            refusal = refusal or error
            if not seek:
                break
    assert refusal is not None
    raise refusal


def _fields(twists: Twists, evaluator: Evaluator, q: Array, v: Array, t: float) -> Iterator[tuple[Array, Array]]:
    """Weights of fields through a start, and of those that may be added, (fields,) and (fields, combinations).

    First the field whose motion has the start's acceleration and its rate, too; then, for starts out of balance, any
    that has its rates.
    """
    root = np.linalg.cholesky(evaluator.mass.toarray()).T
    pace = float(np.linalg.norm(root @ v))
    any_of = _narrowed(root @ twists.at(q), root @ v, np.zeros(twists.basis.shape[1]), None)
    a = evaluator.acceleration(q, v, t)
    unit = span(evaluator.model.scene) * np.sqrt(
        sum(float(body.mass) for body in evaluator.model.scene.bodies.values())
    )
    step = 1e-5 * min(pace / max(float(np.linalg.norm(root @ a)), 1e-300), unit / pace)
    before, after = (evaluator.acceleration(q + s * v + 0.5 * s * s * a, v + s * a, t + s) for s in (-step, step))
    found = any_of
    for state, wanted in ((v, a), (a, (after - before) / (2.0 * step))):
        size = float(np.linalg.norm(root @ state))
        if found[1].shape[1] and size > FITS * pace:
            columns = np.stack([root @ (twists.field(one)[0] @ state) for one in found[1].T], axis=1)
            left = root @ (wanted - twists.field(found[0])[0] @ state)
            found = _narrowed(columns, left, *found, least=FITS * size)
    yield found
    yield any_of


def _narrowed(
    columns: Array, wanted: Array, weights: Array, idle: Array | None, least: float | None = None
) -> tuple[Array, Array]:
    """Weights of fields, those that are idle so far changed to fit what is wanted, and those that still are idle."""
    idle = np.eye(len(weights)) if idle is None else idle
    left, sizes, ways = np.linalg.svd(columns, full_matrices=True)
    rank = int(np.sum(sizes > (1e-9 * np.max(sizes, initial=0.0) if least is None else least)))
    change = ways[:rank].T @ (left[:, :rank].T @ wanted / sizes[:rank])
    return weights + idle @ change, idle @ ways[rank:].T


def _checked(
    begun: Steady, twists: Twists, weights: Array, idle: Array, v: Array, size: float, *, seek: bool
) -> Steady:
    """The steady motion of a field, as far as it is one."""
    root = np.linalg.cholesky(begun.evaluator.mass.toarray()).T
    misfit = float(np.linalg.norm(root @ (begun.v - v)) / np.linalg.norm(root @ v))
    seen = begun.look(begun.q, v, begun.matrix @ v, begun.t)
    if misfit > FITS or (not seek and np.linalg.norm(seen.unbalanced) > BALANCED * seen.size):
        raise _refused(begun, twists, v, size)
    weights = _constant(twists, begun, seen, weights, idle)
    found = _steady(begun.scene, begun.evaluator, begun.metric, twists, weights, begun.q, begun.t)
    if seek:
        sought = _near_start(found, twists, size)
        if sought is None:
            raise _refused(begun, twists, v, size)
        found = sought
    off, part = _compare(found)
    if part == "force" and off > CONSTANT:
        raise _refused(begun, twists, v, size)
    if off > CONSTANT:
        raise ComputationError(
            f"{found.scene.name}: at {found.speed:.4g} rad/s the {part} changes along the motion (by {off:.2g} of its "
            "size) in a frame at rest and in one that turns: small motions have coefficients that are periodic in "
            f"time, and no modes{SHAFT if begun.scene.flexible_rods else ''}"
        )
    return found


def _refused(begun: Steady, twists: Twists, v: Array, size: float) -> NotSteadyError:
    """The refusal of a motion, with its largest residual acceleration along the field."""

    def residual(q: Array, v: Array, t: float) -> tuple[float, str]:
        return twists.fastest(begun.evaluator.acceleration(q, v, t) - begun.matrix @ v, size)

    states = [(*begun.after(s)[1:], begun.t + s) for s in _seconds(begun)]
    worst, body = max([residual(begun.q, v, begun.t), *(residual(*state) for state in states)])
    central, _ = twists.fastest(begun.matrix @ v, size)
    frame = f"in the frame that turns at {begun.speed:.4g} rad/s" if begun.speed else "as it advances"
    return NotSteadyError(
        f"{begun.scene.name}: the start moves, and it is no steady motion: {frame} the residual acceleration of {body} "
        f"is up to {worst:.3g} m/s^2 (the steady one is {central:.3g})"
    )


def _seconds(steady: Steady) -> list[float]:
    """Instants [s] of a motion at which it is compared with its start."""
    pace = steady.speed or float(np.max(np.abs(steady.v), initial=1e-300)) / span(steady.scene)
    return [float(angle) / pace for angle in ANGLES]


def _steady(
    scene: Scene, evaluator: Evaluator, metric: Metric, twists: Twists, weights: Array, q: Array, t: float
) -> Steady:
    """The motion of a field, with the axis and the speed of its fastest body."""
    matrix, constant = twists.field(weights)
    carried, own = twists.rates(weights, left=True), twists.rates(weights, left=False)
    vectors = (twists.matrix @ q + twists.constant).reshape(-1, twists.dimensions)
    fastest = np.zeros(3)
    for name, rate in carried.items():
        whole = rate
        if twists.dimensions == 2:
            whole = np.array([0.0, 0.0, float((rate + own[name])[0])])
        elif np.any(own[name]):
            here = [k for k, body in enumerate(twists.bodies) if body == name]
            whole = rate + own[name] @ vectors[here[1:4]]
        fastest = whole if np.linalg.norm(whole) > (1.0 + 1e-9) * np.linalg.norm(fastest) else fastest
    speed = float(np.linalg.norm(fastest))
    axis = fastest / speed if speed else np.array([0.0, 0.0, 1.0])
    spatial = {name: rate if len(rate) == 3 else np.array([0.0, 0.0, float(rate[0])]) for name, rate in carried.items()}
    least = STRAINED * metric.size(abs(evaluator.stiffness(q, t, load=0.0)) @ np.abs(q))
    return Steady(scene, evaluator, metric, t, q, matrix @ q + constant, matrix, constant, spatial, axis, speed, least)


def _constant(twists: Twists, begun: Steady, seen: Seen, weights: Array, idle: Array) -> Array:
    """Weights of the field along which the tangents are constant, with as little turning in space as may be.

    idle: combinations of fields that do not move the start, of which any may be added, (fields, combinations)
    """
    if not idle.shape[1]:
        return weights
    scaled, pace = _Scaled(begun, seen), begun.speed or 1.0
    mass, step = begun.evaluator.mass, ANGLE / pace
    later = [begun.look(*_state(begun, k * step)) for k in (-2, -1, 1, 2)]

    def rate(part: Callable[[Seen], Array]) -> Array:
        two_before, before, after, two_after = (part(one) for one in later)
        return (8.0 * (after - before) - (two_after - two_before)) / (12.0 * step)

    changing = (
        rate(lambda one: one.stiffness.matrix), rate(lambda one: one.damping), rate(lambda one: one.jacobian)
    )  # fmt: skip

    def change(matrix: Array, of_state: float) -> Array:
        """The rates of mass, damping, stiffness and constraints in the frame of a field, relative to the speed."""
        stiff, rubbing, rows = (of_state * one for one in changing)
        carried = matrix.T @ seen.stiffness.matrix + seen.stiffness.matrix @ matrix + stiff
        damped = matrix.T @ seen.damping + seen.damping @ matrix + rubbing
        parts = (
            scaled.mass(matrix.T @ mass + mass @ matrix),
            scaled.damping(damped),
            scaled.stiffness(carried),
            scaled.rows(seen.jacobian, rows + seen.jacobian @ matrix),
        )
        return np.concatenate([part.ravel() for part in parts]) / pace

    begins = change(begun.matrix, 1.0)
    columns = np.stack([change(twists.field(one)[0], 0.0) for one in idle.T], axis=1)
    left, sizes, ways = np.linalg.svd(columns, full_matrices=False)
    rank = int(np.sum(sizes > 1e-6 * max(1.0, float(np.max(sizes, initial=0.0)))))
    weights = weights - idle @ (ways[:rank].T @ (left[:, :rank].T @ begins / sizes[:rank]))
    rest = idle @ np.linalg.svd(columns)[2][rank:].T if columns.shape[1] > rank else idle[:, :0]
    if rest.shape[1]:
        cost = np.vstack([twists.turning, 1e-4 * twists.basis])
        weights = weights - rest @ np.linalg.lstsq(cost @ rest, cost @ weights, rcond=1e-12)[0]
    return weights


def _state(steady: Steady, s: float) -> tuple[Array, Array, Array, float]:
    """Coordinates, rates, acceleration and time [s] of a motion later."""
    _, q, v = steady.after(s)
    return q, v, steady.matrix @ v, steady.t + s


def _near_start(begun: Steady, twists: Twists, size: float) -> Steady | None:
    """The steady motion of the same field near the start, by Newton's method; None where there is none."""
    mass = sum(float(body.mass) for body in begun.scene.bodies.values())
    unit = size * np.sqrt(mass)

    def correct(found: Steady) -> tuple[Array, float]:
        seen = found.here()
        if np.linalg.norm(seen.unbalanced) <= ROUND * seen.size and np.max(np.abs(seen.gap), initial=0.0) < CLOSE:
            return np.zeros_like(found.q), 0.0
        scaled = _Scaled(found, seen)
        matrix = scaled.stiffness(found.stiffness(seen).matrix)
        back = seen.freedom.shift(-seen.gap)
        right = scaled.weight * (scaled.turn.T @ seen.unbalanced)
        left, sizes, ways = np.linalg.svd(matrix)
        rank = int(np.sum(sizes > LOOSE))
        y = scaled.weight * (ways[:rank].T @ (left[:, :rank].T @ right / sizes[:rank]))
        correction = back + scaled.modes @ y
        is_near = way(found.q + correction) < NEAR * size
        unmet = float(np.linalg.norm(y)) / unit + float(np.max(np.abs(back), initial=0.0))
        return correction, unmet if is_near else np.inf

    def way(q: Array) -> float:
        return float(twists.fastest(q - begun.q, size)[0])

    def move(found: Steady, correction: Array) -> Steady:
        q = found.q + correction
        return replace(found, q=q, v=found.matrix @ q + found.constant, moved=way(q))

    found, converged, *_ = newton(correct, begun, close=CLOSE, round_off=STALLED, most=MOST, move=move)
    if not converged:
        return None
    seen = found.here()
    return found if np.linalg.norm(seen.unbalanced) <= BALANCED * max(seen.size, 1e-300) else None


def _compare(found: Steady) -> tuple[float, str]:
    """The largest relative change along the motion, of forces if they change at all, else of tangents, and its name."""
    seen = found.here()
    scaled, mass = _Scaled(found, seen), found.evaluator.mass
    off: dict[str, float] = {}
    for s in _seconds(found):
        turned, q, v = found.after(s)
        later = found.look(q, v, found.matrix @ v, found.t + s)
        pairs = {
            "inertia": scaled.mass(turned.T @ mass @ turned - mass),
            "damping": scaled.damping(turned.T @ later.damping @ turned - seen.damping),
            "stiffness": scaled.stiffness(turned.T @ later.stiffness.matrix @ turned - seen.stiffness.matrix),
            "constraint": scaled.rows(later.jacobian, later.jacobian @ turned),
            "force": np.array([np.linalg.norm(later.unbalanced) / max(later.size, 1e-300)]),
        }
        for name, change in pairs.items():
            off[name] = max(off.get(name, 0.0), float(np.max(np.abs(change), initial=0.0)))
    name = "force" if off["force"] > CONSTANT else max(off, key=lambda one: off[one])
    return off[name], name
