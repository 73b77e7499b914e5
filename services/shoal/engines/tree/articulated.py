"""Articulated-body algorithm: accelerations of a tree at linear cost, from the tips to the ground and back.

On minimal coordinates nothing is constrained, and the minimiser of Gauss's function is qddot = M^-1 (F - C qdot).
The sum over the bodies need not be assembled for that: given the acceleration of its parent, the joint of a
tip minimises its own share, and what remains is again a quadratic function of the parent's acceleration. Its
matrix is the articulated inertia. This is the method of Popov and Vereshchagin (1974), known as the
articulated-body algorithm (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 7.3), here in
[omega; v] of each body's own origin and in the axes of the fixed frame, so that going from a body to its
parent shifts an inertia but does not rotate it.
"""

from __future__ import annotations

from numba import njit

from shoal.compile.tuples import dot, minus, plus, times, wedge
from shoal.engines.tree.motion import move, third_axis
from shoal.engines.tree.tree import PRISMATIC, REVOLUTE, SPHERICAL, Array, Room, Tree
from shoal.engines.tree.vector3 import (
    OPTIONS,
    Matrix,
    Symmetric,
    Vector,
    add,
    congruence,
    inverse,
    matrix,
    multiply,
    multiply_symmetric,
    multiply_transposed,
    put,
    put_matrix,
    put_symmetric,
    symmetric,
    vector,
)


@njit(**OPTIONS)
def accelerate(tree: Tree, w: Room, q: Array, v: Array, out: Array) -> None:
    """out = qddot at coordinates q and rates v; w is left with the motion of all bodies."""
    move(tree, w, q, v)
    gather(tree, w)
    reduce(tree, w, v)
    expand(tree, w, out)


@njit(**OPTIONS)
def gather(tree: Tree, w: Room) -> None:
    """Inertia R and velocity-dependent force W R E S - Q of the single bodies, equation (7)."""
    # What arrives at the ground is never read, but must not grow from step to step.
    w.A[0], w.B[0], w.C[0], w.torque[0], w.force[0] = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(1, tree.parents.size):
        turn, mass = matrix(w.rotation, i), tree.mass[i]
        omega = vector(w.turning, i)
        x, y, z = moment = times(mass, multiply(turn, vector(tree.lever, i)))
        inertia = congruence(turn, symmetric(tree.inertia, i))
        put_symmetric(w.A, i, inertia)
        put_matrix(w.B, i, (0.0, -z, y, z, 0.0, -x, -y, x, 0.0))
        put_symmetric(w.C, i, (mass, 0.0, 0.0, mass, 0.0, mass))
        put(w.torque, i, wedge(omega, multiply_symmetric(inertia, omega)))
        put(w.force, i, wedge(omega, wedge(omega, moment)))
    for n in range(tree.load_body.size):
        i = tree.load_body[n]
        force = vector(tree.load_force, n)
        place = multiply(matrix(w.rotation, i), vector(tree.load_place, n))
        torque = add(vector(tree.load_torque, n), wedge(place, force))
        put(w.torque, i, minus(vector(w.torque, i), torque))
        put(w.force, i, minus(vector(w.force, i), force))


@njit(**OPTIONS)
def reduce(tree: Tree, w: Room, v: Array) -> None:
    """Inward: minimise over each joint's acceleration and hand the rest of Gauss's function to the parent."""
    for i in range(tree.parents.size - 1, 0, -1):
        kind, k = tree.kinds[i], tree.first_v[i]
        A, B, C = symmetric(w.A, i), matrix(w.B, i), symmetric(w.C, i)
        torque, force = vector(w.torque, i), vector(w.force, i)
        turn_bias, speed_bias = vector(w.turn_bias, i), vector(w.speed_bias, i)
        if kind == SPHERICAL:
            # D = [1; 0] in the fixed axes; afterwards the parent meets neither A nor B.
            own = inverse(A)
            rest = times(-1.0, multiply_symmetric(own, torque))
            put_symmetric(w.turn_share, i, own)
            put_matrix(w.speed_share, i, B)
            put(w.rest, i, rest)
            C = minus_congruence(C, B, own)
            A, B = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            force = add(force, multiply_transposed(matrix(w.speed_share, i), rest))
            force = add(force, multiply_symmetric(C, speed_bias))
            torque = (0.0, 0.0, 0.0)
        else:
            if kind in (REVOLUTE, PRISMATIC):
                axis = third_axis(w, i)
                if kind == REVOLUTE:  # D = [u; 0]
                    upper, lower = multiply_symmetric(A, axis), multiply_transposed(B, axis)
                    felt, along = dot(axis, upper), dot(axis, torque)
                else:  # D = [0; u]
                    upper, lower = multiply(B, axis), multiply_symmetric(C, axis)
                    felt, along = dot(axis, lower), dot(axis, force)
                share = 1.0 / felt
                rest = -share * (tree.damping[k] * v[k] + along)
                A, C = minus_square(A, share, upper), minus_square(C, share, lower)
                B = minus_outer(B, share, upper, lower)
                torque, force = plus(torque, rest, upper), plus(force, rest, lower)
                put(w.turn_share, i, times(share, upper))
                put(w.speed_share, i, times(share, lower))
                w.rest[i, 0] = rest
            torque = add(torque, add(multiply_symmetric(A, turn_bias), multiply(B, speed_bias)))
            force = add(force, add(multiply_transposed(B, turn_bias), multiply_symmetric(C, speed_bias)))
        hand_over(w, tree.parents[i], vector(w.arm, i), A, B, C, torque, force)


@njit(**OPTIONS)
def hand_over(
    w: Room, parent: int, arm: Vector, A: Symmetric, B: Matrix, C: Symmetric, torque: Vector, force: Vector
) -> None:
    """Add T' [A, B; B', C] T and T' [torque; force] to the parent; T = [1, 0; -arm~, 1]."""
    x, y, z = arm
    # The columns of arm~ C, then B + arm~ C.
    K = (
        B[0] + y * C[2] - z * C[1], B[1] + y * C[4] - z * C[3], B[2] + y * C[5] - z * C[4],
        B[3] + z * C[0] - x * C[2], B[4] + z * C[1] - x * C[4], B[5] + z * C[2] - x * C[5],
        B[6] + x * C[1] - y * C[0], B[7] + x * C[3] - y * C[1], B[8] + x * C[4] - y * C[2],
    )  # fmt: skip
    # A - B arm~ + arm~ K'
    w.A[parent, 0] += A[0] - B[1] * z + B[2] * y + y * K[2] - z * K[1]
    w.A[parent, 1] += A[1] + B[0] * z - B[2] * x + y * K[5] - z * K[4]
    w.A[parent, 2] += A[2] - B[0] * y + B[1] * x + y * K[8] - z * K[7]
    w.A[parent, 3] += A[3] + B[3] * z - B[5] * x + z * K[3] - x * K[5]
    w.A[parent, 4] += A[4] - B[3] * y + B[4] * x + z * K[6] - x * K[8]
    w.A[parent, 5] += A[5] - B[6] * y + B[7] * x + x * K[7] - y * K[6]
    for k in range(9):
        w.B[parent, k] += K[k]
    for k in range(6):
        w.C[parent, k] += C[k]
    put(w.torque, parent, add(vector(w.torque, parent), add(torque, wedge(arm, force))))
    put(w.force, parent, add(vector(w.force, parent), force))


@njit(**OPTIONS)
def expand(tree: Tree, w: Room, out: Array) -> None:
    """Outward: accelerations of the joints, then of the bodies, second line of equation (2)."""
    for i in range(1, tree.parents.size):
        parent, kind, k = tree.parents[i], tree.kinds[i], tree.first_v[i]
        epsilon = vector(w.turning_rate, parent)
        a = add(vector(w.speed_rate, parent), add(wedge(epsilon, vector(w.arm, i)), vector(w.speed_bias, i)))
        epsilon = add(epsilon, vector(w.turn_bias, i))
        if kind in (REVOLUTE, PRISMATIC):
            out[k] = w.rest[i, 0] - dot(vector(w.turn_share, i), epsilon) - dot(vector(w.speed_share, i), a)
            if kind == REVOLUTE:
                epsilon = plus(epsilon, out[k], third_axis(w, i))
            else:
                a = plus(a, out[k], third_axis(w, i))
        elif kind == SPHERICAL:
            pull = multiply(matrix(w.speed_share, i), a)
            total = minus(vector(w.rest, i), multiply_symmetric(symmetric(w.turn_share, i), pull))
            relative = multiply_transposed(matrix(w.rotation, i), minus(total, epsilon))
            out[k], out[k + 1], out[k + 2] = relative
            epsilon = total
        put(w.turning_rate, i, epsilon)
        put(w.speed_rate, i, a)


@njit(**OPTIONS)
def minus_square(s: Symmetric, factor: float, a: Vector) -> Symmetric:
    """s - factor a a'."""
    x, y, z = factor * a[0], factor * a[1], factor * a[2]
    return (
        s[0] - x * a[0], s[1] - x * a[1], s[2] - x * a[2],
        s[3] - y * a[1], s[4] - y * a[2], s[5] - z * a[2],
    )  # fmt: skip


@njit(**OPTIONS)
def minus_outer(m: Matrix, factor: float, a: Vector, b: Vector) -> Matrix:
    """m - factor a b'."""
    x, y, z = factor * a[0], factor * a[1], factor * a[2]
    return (
        m[0] - x * b[0], m[1] - x * b[1], m[2] - x * b[2],
        m[3] - y * b[0], m[4] - y * b[1], m[5] - y * b[2],
        m[6] - z * b[0], m[7] - z * b[1], m[8] - z * b[2],
    )  # fmt: skip


@njit(**OPTIONS)
def minus_congruence(s: Symmetric, m: Matrix, inner: Symmetric) -> Symmetric:
    """s - m' inner m."""
    part = congruence((m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]), inner)
    return (
        s[0] - part[0], s[1] - part[1], s[2] - part[2], s[3] - part[3], s[4] - part[4], s[5] - part[5],
    )  # fmt: skip
