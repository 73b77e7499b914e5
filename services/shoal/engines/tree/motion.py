"""Outward pass: poses, velocities and velocity-dependent accelerations of all bodies, equation (2), and energies.

S_j = T_j S_i + D_j qdot_j with S = [omega; v] of the body's origin in the axes of the fixed frame;
the tests compare it with dense matrices. Here each body takes a constant number of operations.
"""

from __future__ import annotations

import math

from numba import njit

from shoal.compile.tuples import dot, plus, times, wedge
from shoal.engines.tree.tree import PRISMATIC, REVOLUTE, SPHERICAL, Array, Room, Tree
from shoal.engines.tree.vector3 import (
    OPTIONS,
    Matrix,
    Vector,
    add,
    from_quaternion,
    matrix,
    multiply,
    multiply_symmetric,
    multiply_transposed,
    product,
    put,
    put_matrix,
    symmetric,
    vector,
)


@njit(**OPTIONS)
def turn_about_third(m: Matrix, angle: float) -> Matrix:
    """m times the rotation about the third axis."""
    c, s = math.cos(angle), math.sin(angle)
    return (
        c * m[0] + s * m[1], c * m[1] - s * m[0], m[2],
        c * m[3] + s * m[4], c * m[4] - s * m[3], m[5],
        c * m[6] + s * m[7], c * m[7] - s * m[6], m[8],
    )  # fmt: skip


@njit(**OPTIONS)
def third_axis(w: Room, i: int) -> Vector:
    """Direction of the joint of body i."""
    return w.rotation[i, 2], w.rotation[i, 5], w.rotation[i, 8]


@njit(**OPTIONS)
def move(tree: Tree, w: Room, q: Array, v: Array) -> None:
    """Poses, velocities and Tdot S + Ddot qdot of all bodies at coordinates q and rates v, into w."""
    for i in range(1, tree.parents.size):
        parent, kind = tree.parents[i], tree.kinds[i]
        k, first = tree.first_v[i], tree.first_q[i]
        carrier = matrix(w.rotation, parent)
        arm = multiply(carrier, vector(tree.offset, i))
        turn = product(carrier, matrix(tree.turn, i))
        omega = vector(w.turning, parent)
        spin, slide = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)  # D_j qdot_j
        if kind == REVOLUTE:
            turn = turn_about_third(turn, q[first])
            spin = times(v[k], (turn[2], turn[5], turn[8]))
        elif kind == PRISMATIC:
            axis = (turn[2], turn[5], turn[8])
            arm = plus(arm, q[first], axis)
            slide = times(v[k], axis)
        elif kind == SPHERICAL:
            turn = product(turn, from_quaternion(q[first], q[first + 1], q[first + 2], q[first + 3]))
            spin = multiply(turn, (v[k], v[k + 1], v[k + 2]))
        swing = wedge(omega, arm)
        put_matrix(w.rotation, i, turn)
        put(w.arm, i, arm)
        put(w.position, i, add(vector(w.position, parent), arm))
        put(w.turning, i, add(omega, spin))
        put(w.speed, i, add(add(vector(w.speed, parent), swing), slide))
        put(w.turn_bias, i, wedge(omega, spin))
        put(w.speed_bias, i, wedge(omega, plus(swing, 2.0, slide)))


@njit(**OPTIONS)
def energies(tree: Tree, w: Room) -> tuple[float, float]:
    """Kinetic energy and potential energy of gravity [J] of the motion in w."""
    kinetic, potential = 0.0, 0.0
    gravity = (tree.gravity[0], tree.gravity[1], tree.gravity[2])
    for i in range(1, tree.parents.size):
        turn, mass, speed = matrix(w.rotation, i), tree.mass[i], vector(w.speed, i)
        omega = vector(w.turning, i)
        lever = multiply(turn, vector(tree.lever, i))
        own = multiply_transposed(turn, omega)
        kinetic += 0.5 * dot(own, multiply_symmetric(symmetric(tree.inertia, i), own))
        kinetic += mass * (0.5 * dot(speed, speed) + dot(speed, wedge(omega, lever)))
        potential -= mass * dot(gravity, add(vector(w.position, i), lever))
    return kinetic, potential


@njit(**OPTIONS)
def power(tree: Tree, w: Room, v: Array) -> float:
    """Power [W] of dampers and loads."""
    total = 0.0
    for k in range(v.size):
        total -= tree.damping[k] * v[k] * v[k]
    for n in range(tree.load_body.size):
        i = tree.load_body[n]
        omega = vector(w.turning, i)
        place = multiply(matrix(w.rotation, i), vector(tree.load_place, n))
        total += dot(vector(tree.load_force, n), add(vector(w.speed, i), wedge(omega, place)))
        total += dot(vector(tree.load_torque, n), omega)
    return total


@njit(**OPTIONS)
def coordinate_rates(tree: Tree, q: Array, v: Array, out: Array) -> None:
    """Time derivative of the coordinates: the rates, and of quaternions p half of p (0, omega)."""
    for i in range(1, tree.parents.size):
        k, first = tree.first_v[i], tree.first_q[i]
        if tree.kinds[i] == SPHERICAL:
            s, x, y, z = q[first], q[first + 1], q[first + 2], q[first + 3]
            a, b, c = v[k], v[k + 1], v[k + 2]
            out[first] = -0.5 * (x * a + y * b + z * c)
            out[first + 1] = 0.5 * (s * a + y * c - z * b)
            out[first + 2] = 0.5 * (s * b + z * a - x * c)
            out[first + 3] = 0.5 * (s * c + x * b - y * a)
        elif tree.kinds[i] != 0:
            out[first] = v[k]


@njit(**OPTIONS)
def normalise(tree: Tree, q: Array) -> None:
    """Quaternions back to unit length."""
    for i in range(1, tree.parents.size):
        if tree.kinds[i] == SPHERICAL:
            first = tree.first_q[i]
            length = math.sqrt(q[first] ** 2 + q[first + 1] ** 2 + q[first + 2] ** 2 + q[first + 3] ** 2)
            for k in range(first, first + 4):
                q[k] /= length
