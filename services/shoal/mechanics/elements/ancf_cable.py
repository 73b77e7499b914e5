"""Gradient-deficient planar ANCF cable element (Bernoulli-Euler), nodes with position and slope.

Berzeri and Shabana 2000; Gerstmayr and Shabana 2006. With r(s) the cubic Hermite curve through the
nodes, the strain energy is 1/2 int EA eps^2 + EI kappa^2 ds, eps = |r'| - 1, kappa = (r' x r'')/|r'|^2.
In the three vectors d = (r2 - r1)/L, r1', r2' the derivatives r' and L r'' have coefficients that
do not depend on the element, which is what the quadrature tables below hold.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics.assembly.affine import Number
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.numerics.vector import add, copy, pointer

NODE_COORDINATES = 4
ROWS = 8


class AncfCables(NamedTuple):
    """Elements of one quadrature: eight rows of (r1, r1', r2, r2') and 1/L, EA L, EI/L for each."""

    size: int
    rows: Index
    coefficients: Array


def coefficients(length: Number, axial_stiffness: Number, bending_stiffness: Number) -> list[Number]:
    """The three numbers of an element [1/m, N m, N m]."""
    return [1.0 / length, axial_stiffness * length, bending_stiffness / length]


def mass_matrix(mass_per_length: Number, length: Number) -> list[list[Number]]:
    """Consistent mass [kg, kg m, kg m^2] on (r1, r1', r2, r2'), the same for x and y."""
    m, l = mass_per_length * length / 420, length  # noqa: E741
    return [
        [156 * m, 22 * l * m, 54 * m, -13 * l * m],
        [22 * l * m, 4 * l * l * m, 13 * l * m, -3 * l * l * m],
        [54 * m, 13 * l * m, 156 * m, -22 * l * m],
        [-13 * l * m, -3 * l * l * m, -22 * l * m, 4 * l * l * m],
    ]


def weight(mass_per_length: Number, length: Number) -> list[Number]:
    """Consistent load of a unit acceleration [kg, kg m] on (r1, r1', r2, r2')."""
    m = mass_per_length * length
    return [m / 2, m * length / 12, m / 2, -m * length / 12]


def position_shape(x: Number, length: Number) -> list[Number]:
    """Hermite shape functions of r at the fraction x of the element."""
    return [
        1 - 3 * x**2 + 2 * x**3 + 0 * length,
        length * (x - 2 * x**2 + x**3),
        3 * x**2 - 2 * x**3 + 0 * length,
        length * (x**3 - x**2),
    ]


def slope_shape(x: Number, length: Number) -> list[Number]:
    """Shape functions of r' at the fraction x of the element [1/m, 1]."""
    return [
        (6 * x**2 - 6 * x) / length,
        1 - 4 * x + 3 * x**2 + 0 * length,
        (6 * x - 6 * x**2) / length,
        3 * x**2 - 2 * x + 0 * length,
    ]


def _table(points: Array, weights: Array) -> Array:
    """Per point: coefficients of r' and of L r'' in (d, r1', r2'), and the weight on the unit interval."""
    x = points
    slope = [6 * x * (1 - x), 1 - 4 * x + 3 * x * x, 3 * x * x - 2 * x]
    curve = [6 - 12 * x, 6 * x - 4, 6 * x - 2]
    return np.column_stack([*slope, *curve, weights])


def _gauss(count: int) -> Array:
    points, weights = np.polynomial.legendre.leggauss(count)
    return _table((points + 1) / 2, weights / 2)


FULL_AXIAL = _gauss(5)
FULL_BENDING = _gauss(3)
REDUCED_AXIAL = _table(np.array([0.0, 0.5, 1.0]), np.array([1.0, 4.0, 1.0]) / 6)
REDUCED_BENDING = _gauss(2)


@njit(cache=True, error_model="numpy", forceinline=True)
def raw(cables: AncfCables) -> AncfCables:
    """The same elements with pointers in place of arrays."""
    return AncfCables(cables.size, pointer(cables.rows), pointer(cables.coefficients))


@njit(cache=True, error_model="numpy", forceinline=True)
def _gather(tile: Tile, cables: AncfCables, number: int, z: Array, w: Array) -> None:
    for k in range(ROWS):
        copy(tile, w, k, z, cables.rows[ROWS * number + k])


@njit(cache=True, error_model="numpy", forceinline=True)
def _scatter(tile: Tile, cables: AncfCables, number: int, w: Array, f: Array) -> None:
    for k in range(ROWS):
        add(tile, f, cables.rows[ROWS * number + k], w, ROWS + k)


@njit(cache=True, error_model="numpy", inline="always")
def _axial_force(tx, ty, scale):  # type: ignore[no-untyped-def]
    return scale * (1.0 - 1.0 / np.sqrt(tx * tx + ty * ty))


@njit(cache=True, error_model="numpy", inline="always")
def _bending_force(tx, ty, ux, uy, scale):  # type: ignore[no-untyped-def]
    inverse = 1.0 / (tx * tx + ty * ty)
    kappa = (tx * uy - ty * ux) * inverse
    m = scale * kappa * inverse
    return m * (uy - 2.0 * kappa * tx), m * (-ux - 2.0 * kappa * ty), -m * ty, m * tx


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _force_full(tile: Tile, number: int, coefficient: Array, w: Array) -> None:
    """Force of the coordinates in rows 0 to 7 of w, into rows 8 to 15."""
    width = len(tile)
    base = 3 * number * width
    out = 8 * width
    for lane in range(width):
        inverse = coefficient[base + lane]
        ea = coefficient[base + width + lane]
        ei = coefficient[base + 2 * width + lane]
        dx = (w[4 * width + lane] - w[lane]) * inverse
        dy = (w[5 * width + lane] - w[width + lane]) * inverse
        px, py = w[2 * width + lane], w[3 * width + lane]
        qx, qy = w[6 * width + lane], w[7 * width + lane]
        fdx, fdy, fpx, fpy, fqx, fqy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for g in range(FULL_AXIAL.shape[0]):
            a, b, c = FULL_AXIAL[g, 0], FULL_AXIAL[g, 1], FULL_AXIAL[g, 2]
            tx, ty = a * dx + b * px + c * qx, a * dy + b * py + c * qy
            n = _axial_force(tx, ty, ea * FULL_AXIAL[g, 6])
            tx, ty = n * tx, n * ty
            fdx, fpx, fqx = fdx + a * tx, fpx + b * tx, fqx + c * tx
            fdy, fpy, fqy = fdy + a * ty, fpy + b * ty, fqy + c * ty
        for g in range(FULL_BENDING.shape[0]):
            a, b, c = FULL_BENDING[g, 0], FULL_BENDING[g, 1], FULL_BENDING[g, 2]
            d, e, h = FULL_BENDING[g, 3], FULL_BENDING[g, 4], FULL_BENDING[g, 5]
            tx, ty = a * dx + b * px + c * qx, a * dy + b * py + c * qy
            ux, uy = d * dx + e * px + h * qx, d * dy + e * py + h * qy
            gx, gy, hx, hy = _bending_force(tx, ty, ux, uy, ei * FULL_BENDING[g, 6])
            fdx, fpx, fqx = fdx + a * gx + d * hx, fpx + b * gx + e * hx, fqx + c * gx + h * hx
            fdy, fpy, fqy = fdy + a * gy + d * hy, fpy + b * gy + e * hy, fqy + c * gy + h * hy
        w[out + lane], w[out + width + lane] = fdx * inverse, fdy * inverse
        w[out + 2 * width + lane], w[out + 3 * width + lane] = -fpx, -fpy
        w[out + 4 * width + lane], w[out + 5 * width + lane] = -fdx * inverse, -fdy * inverse
        w[out + 6 * width + lane], w[out + 7 * width + lane] = -fqx, -fqy


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _force_reduced(tile: Tile, number: int, coefficient: Array, w: Array) -> None:
    """Force of the coordinates in rows 0 to 7 of w, into rows 8 to 15."""
    width = len(tile)
    base = 3 * number * width
    out = 8 * width
    for lane in range(width):
        inverse = coefficient[base + lane]
        ea = coefficient[base + width + lane]
        ei = coefficient[base + 2 * width + lane]
        dx = (w[4 * width + lane] - w[lane]) * inverse
        dy = (w[5 * width + lane] - w[width + lane]) * inverse
        px, py = w[2 * width + lane], w[3 * width + lane]
        qx, qy = w[6 * width + lane], w[7 * width + lane]
        # The outer Lobatto points are the nodes, where r' is the slope itself.
        n = _axial_force(px, py, ea / 6.0)
        fpx, fpy = n * px, n * py
        n = _axial_force(qx, qy, ea / 6.0)
        fqx, fqy = n * qx, n * qy
        tx, ty = 1.5 * dx - 0.25 * (px + qx), 1.5 * dy - 0.25 * (py + qy)
        n = _axial_force(tx, ty, ea * (4.0 / 6.0))
        tx, ty = n * tx, n * ty
        fdx, fpx, fqx = 1.5 * tx, fpx - 0.25 * tx, fqx - 0.25 * tx
        fdy, fpy, fqy = 1.5 * ty, fpy - 0.25 * ty, fqy - 0.25 * ty
        for g in range(REDUCED_BENDING.shape[0]):
            a, b, c = REDUCED_BENDING[g, 0], REDUCED_BENDING[g, 1], REDUCED_BENDING[g, 2]
            d, e, h = REDUCED_BENDING[g, 3], REDUCED_BENDING[g, 4], REDUCED_BENDING[g, 5]
            tx, ty = a * dx + b * px + c * qx, a * dy + b * py + c * qy
            ux, uy = d * dx + e * px + h * qx, d * dy + e * py + h * qy
            gx, gy, hx, hy = _bending_force(tx, ty, ux, uy, ei * REDUCED_BENDING[g, 6])
            fdx, fpx, fqx = fdx + a * gx + d * hx, fpx + b * gx + e * hx, fqx + c * gx + h * hx
            fdy, fpy, fqy = fdy + a * gy + d * hy, fpy + b * gy + e * hy, fqy + c * gy + h * hy
        w[out + lane], w[out + width + lane] = fdx * inverse, fdy * inverse
        w[out + 2 * width + lane], w[out + 3 * width + lane] = -fpx, -fpy
        w[out + 4 * width + lane], w[out + 5 * width + lane] = -fdx * inverse, -fdy * inverse
        w[out + 6 * width + lane], w[out + 7 * width + lane] = -fqx, -fqy


@njit(cache=True, error_model="numpy")
def add_force_full(tile: Tile, cables: AncfCables, z: Array, f: Array, w: Array) -> None:
    """Add the elastic force -dU/dz [N, N m] to f (rows, lanes); w is work space of 16 rows. Pointers."""
    for number in range(cables.size):
        _gather(tile, cables, number, z, w)
        _force_full(tile, number, cables.coefficients, w)
        _scatter(tile, cables, number, w, f)


@njit(cache=True, error_model="numpy")
def add_force_reduced(tile: Tile, cables: AncfCables, z: Array, f: Array, w: Array) -> None:
    """As `add_force_full`, with 3 Lobatto points axial and 2 Gauss points bending."""
    for number in range(cables.size):
        _gather(tile, cables, number, z, w)
        _force_reduced(tile, number, cables.coefficients, w)
        _scatter(tile, cables, number, w, f)


@njit(cache=True, error_model="numpy")
def add_energy(
    tile: Tile, cables: AncfCables, axial: Array, bending: Array, z: Array, w: Array, energy: Array, row: int
) -> None:
    """Add the strain energy [J] to a row of energy, with the given quadrature tables. Pointers."""
    width = len(tile)
    for number in range(cables.size):
        _gather(tile, cables, number, z, w)
        base = 3 * number * width
        for lane in range(width):
            inverse = cables.coefficients[base + lane]
            dx = (w[4 * width + lane] - w[lane]) * inverse
            dy = (w[5 * width + lane] - w[width + lane]) * inverse
            px, py = w[2 * width + lane], w[3 * width + lane]
            qx, qy = w[6 * width + lane], w[7 * width + lane]
            total = 0.0
            for g in range(axial.shape[0]):
                a, b, c = axial[g, 0], axial[g, 1], axial[g, 2]
                tx, ty = a * dx + b * px + c * qx, a * dy + b * py + c * qy
                strain = np.sqrt(tx * tx + ty * ty) - 1.0
                total += 0.5 * axial[g, 6] * cables.coefficients[base + width + lane] * strain * strain
            for g in range(bending.shape[0]):
                a, b, c = bending[g, 0], bending[g, 1], bending[g, 2]
                d, e, h = bending[g, 3], bending[g, 4], bending[g, 5]
                tx, ty = a * dx + b * px + c * qx, a * dy + b * py + c * qy
                ux, uy = d * dx + e * px + h * qx, d * dy + e * py + h * qy
                kappa = (tx * uy - ty * ux) / (tx * tx + ty * ty)
                total += 0.5 * bending[g, 6] * cables.coefficients[base + 2 * width + lane] * kappa * kappa
            energy[row * width + lane] += total


@njit(cache=True, error_model="numpy")
def tangent(
    tile: Tile, cables: AncfCables, axial: Array, bending: Array, z: Array, w: Array, out: Array, first: int
) -> None:
    """Stiffness d2U/dz2 of every element; rows of out from `first` on: (elements * 64, lanes), 8 x 8 blocks."""
    width = len(tile)
    shape = np.empty((2, 8))
    hessian = np.empty((4, 4))
    for number in range(cables.size):
        _gather(tile, cables, number, z, w)
        base = 3 * number * width
        for k in range((first + 64 * number) * width, (first + 64 * number + 64) * width):
            out[k] = 0.0
        for lane in range(width):
            inverse = cables.coefficients[base + lane]
            for kind in range(2):
                table = axial if kind == 0 else bending
                stiffness = cables.coefficients[base + (1 + kind) * width + lane]
                for g in range(table.shape[0]):
                    for part in range(2):
                        d, b, c = table[g, 3 * part], table[g, 3 * part + 1], table[g, 3 * part + 2]
                        shape[part, 0], shape[part, 1], shape[part, 2], shape[part, 3] = -d * inverse, b, d * inverse, c
                    tx, ty, ux, uy = 0.0, 0.0, 0.0, 0.0
                    for k in range(4):
                        x, y = w[2 * k * width + lane], w[(2 * k + 1) * width + lane]
                        tx, ty = tx + shape[0, k] * x, ty + shape[0, k] * y
                        ux, uy = ux + shape[1, k] * x, uy + shape[1, k] * y
                    if kind == 0:
                        _axial_hessian(tx, ty, hessian)
                    else:
                        _bending_hessian(tx, ty, ux, uy, hessian)
                    scale = stiffness * table[g, 6]
                    for i in range(8):
                        for j in range(8):
                            total = 0.0
                            for a in range(2):
                                for b_ in range(2):
                                    total += (
                                        shape[a, i // 2] * shape[b_, j // 2] * hessian[2 * a + i % 2, 2 * b_ + j % 2]
                                    )
                            out[(first + 64 * number + 8 * i + j) * width + lane] += scale * total


@njit(cache=True, error_model="numpy")
def _axial_hessian(tx: float, ty: float, hessian: Array) -> None:
    """Second derivatives of (|t| - 1)^2 / 2 in t = r'."""
    hessian[:] = 0.0
    square = tx * tx + ty * ty
    stretch = np.sqrt(square)
    cube = square * stretch
    hessian[0, 0] = 1.0 - ty * ty / cube
    hessian[1, 1] = 1.0 - tx * tx / cube
    hessian[0, 1] = tx * ty / cube
    hessian[1, 0] = hessian[0, 1]


@njit(cache=True, error_model="numpy")
def _bending_hessian(tx: float, ty: float, ux: float, uy: float, hessian: Array) -> None:
    """Second derivatives of k^2 / 2 in (t, u), k = (t x u)/|t|^2, t = r', u = L r''."""
    n = tx * tx + ty * ty
    k = (tx * uy - ty * ux) / n
    gradient = np.array([(uy - 2 * k * tx) / n, (-ux - 2 * k * ty) / n, -ty / n, tx / n])
    t = np.array([tx, ty])
    cross = np.array([[0.0, 1.0], [-1.0, 0.0]])
    for i in range(4):
        for j in range(4):
            second = 0.0
            if i < 2 and j < 2:
                # d2k = -(2/n) (t g' + g t') - 2 k I / n with g the gradient of k in t
                second = -2.0 * (t[i] * gradient[j] + t[j] * gradient[i]) / n
                if i == j:
                    second -= 2.0 * k / n
            elif i < 2 <= j:
                second = cross[i, j - 2] / n - 2.0 * t[i] * gradient[j] / n
            elif j < 2 <= i:
                second = cross[j, i - 2] / n - 2.0 * t[j] * gradient[i] / n
            hessian[i, j] = gradient[i] * gradient[j] + k * second
