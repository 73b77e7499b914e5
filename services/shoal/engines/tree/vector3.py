"""Vectors and matrices of three dimensions as tuples of scalars, which compiled code keeps in registers.

Multiples and products of vectors are those of `tuples`. A vector is (x, y, z); a matrix nine numbers, row by row; a
symmetric matrix (xx, xy, xz, yy, yz, zz).
"""

from __future__ import annotations

from typing import Any

from numba import njit

Vector = tuple[float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]
Symmetric = tuple[float, float, float, float, float, float]

OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
"""How every kernel of this package is compiled; `contract` lets a product and a sum become one instruction."""


@njit(**OPTIONS)
def vector(a: Any, i: int) -> Vector:
    """Row i of a."""
    return a[i, 0], a[i, 1], a[i, 2]


@njit(**OPTIONS)
def put(a: Any, i: int, v: Vector) -> None:
    """Row i of a = v."""
    a[i, 0], a[i, 1], a[i, 2] = v


@njit(**OPTIONS)
def matrix(a: Any, i: int) -> Matrix:
    """Row i of a."""
    return a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5], a[i, 6], a[i, 7], a[i, 8]


@njit(**OPTIONS)
def put_matrix(a: Any, i: int, m: Matrix) -> None:
    """Row i of a = m."""
    a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5], a[i, 6], a[i, 7], a[i, 8] = m


@njit(**OPTIONS)
def symmetric(a: Any, i: int) -> Symmetric:
    """Row i of a."""
    return a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5]


@njit(**OPTIONS)
def put_symmetric(a: Any, i: int, s: Symmetric) -> None:
    """Row i of a = s."""
    a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5] = s


@njit(**OPTIONS)
def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit(**OPTIONS)
def multiply(m: Matrix, a: Vector) -> Vector:
    """m a."""
    return (
        m[0] * a[0] + m[1] * a[1] + m[2] * a[2],
        m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
        m[6] * a[0] + m[7] * a[1] + m[8] * a[2],
    )


@njit(**OPTIONS)
def multiply_transposed(m: Matrix, a: Vector) -> Vector:
    """m' a."""
    return (
        m[0] * a[0] + m[3] * a[1] + m[6] * a[2],
        m[1] * a[0] + m[4] * a[1] + m[7] * a[2],
        m[2] * a[0] + m[5] * a[1] + m[8] * a[2],
    )


@njit(**OPTIONS)
def multiply_symmetric(s: Symmetric, a: Vector) -> Vector:
    """s a."""
    return (
        s[0] * a[0] + s[1] * a[1] + s[2] * a[2],
        s[1] * a[0] + s[3] * a[1] + s[4] * a[2],
        s[2] * a[0] + s[4] * a[1] + s[5] * a[2],
    )


@njit(**OPTIONS)
def product(m: Matrix, n: Matrix) -> Matrix:
    """m n."""
    return (
        m[0] * n[0] + m[1] * n[3] + m[2] * n[6],
        m[0] * n[1] + m[1] * n[4] + m[2] * n[7],
        m[0] * n[2] + m[1] * n[5] + m[2] * n[8],
        m[3] * n[0] + m[4] * n[3] + m[5] * n[6],
        m[3] * n[1] + m[4] * n[4] + m[5] * n[7],
        m[3] * n[2] + m[4] * n[5] + m[5] * n[8],
        m[6] * n[0] + m[7] * n[3] + m[8] * n[6],
        m[6] * n[1] + m[7] * n[4] + m[8] * n[7],
        m[6] * n[2] + m[7] * n[5] + m[8] * n[8],
    )


@njit(**OPTIONS)
def congruence(m: Matrix, s: Symmetric) -> Symmetric:
    """m s m'."""
    x = multiply_symmetric(s, (m[0], m[1], m[2]))
    y = multiply_symmetric(s, (m[3], m[4], m[5]))
    z = multiply_symmetric(s, (m[6], m[7], m[8]))
    return (
        m[0] * x[0] + m[1] * x[1] + m[2] * x[2],
        m[3] * x[0] + m[4] * x[1] + m[5] * x[2],
        m[6] * x[0] + m[7] * x[1] + m[8] * x[2],
        m[3] * y[0] + m[4] * y[1] + m[5] * y[2],
        m[6] * y[0] + m[7] * y[1] + m[8] * y[2],
        m[6] * z[0] + m[7] * z[1] + m[8] * z[2],
    )


@njit(**OPTIONS)
def inverse(s: Symmetric) -> Symmetric:
    """The inverse of a positive definite matrix, by s = L D L'."""
    d0 = s[0]
    l10, l20 = s[1] / d0, s[2] / d0
    d1 = s[3] - l10 * s[1]
    l21 = (s[4] - l20 * s[1]) / d1
    d2 = s[5] - l20 * s[2] - l21 * l21 * d1
    k20 = l10 * l21 - l20  # L^-1 = [1; -l10, 1; k20, -l21, 1]
    i0, i1, i2 = 1.0 / d0, 1.0 / d1, 1.0 / d2
    return (
        i0 + l10 * l10 * i1 + k20 * k20 * i2,
        -l10 * i1 - k20 * l21 * i2,
        k20 * i2,
        i1 + l21 * l21 * i2,
        -l21 * i2,
        i2,
    )


@njit(**OPTIONS)
def from_quaternion(w: float, x: float, y: float, z: float) -> Matrix:
    """The rotation of a quaternion of any length."""
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x),
        s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y),
    )  # fmt: skip
