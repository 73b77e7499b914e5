"""A tape: formulas as a list of operations on registers, evaluated by one compiled interpreter for all scenes.

Instruction k is (operation, a, b, c) and writes register first + k; a, b and c are registers. A register has one number
a lane. Of the operations that switch, from ABSOLUTE to MAXIMUM, c is the number of the switch: where switches are held,
their branch (1 where x, or x - y, counts as not negative) decides and not the arguments. `reverse` goes back along the
tape (Griewank and Walther, Evaluating Derivatives, 2008, chapter 4): the derivatives of one register by all others for
a few times the cost of its value.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile import simd
from shoal.mechanics.numerics.tile import Array, Index, Tile

ADD, SUBTRACT, MULTIPLY, DIVIDE, MULTIPLY_ADD, NEGATE, SQUARE = range(7)
POWER, ABSOLUTE, STEP, MINIMUM, MAXIMUM, RISE = range(7, 13)
SINE, COSINE, TANGENT, TANH, ROOT, EXPONENTIAL, LOGARITHM = range(13, 20)
SWITCHES = (ABSOLUTE, STEP, MINIMUM, MAXIMUM)
CODES = {
    "+": ADD, "-": SUBTRACT, "*": MULTIPLY, "/": DIVIDE, "neg": NEGATE, "square": SQUARE, "**": POWER, "min": MINIMUM,
    "max": MAXIMUM, "abs": ABSOLUTE, "step": STEP, "rise": RISE, "sin": SINE, "cos": COSINE,
    "tan": TANGENT, "tanh": TANH, "sqrt": ROOT, "exp": EXPONENTIAL, "log": LOGARITHM,
}  # fmt: skip
"""Operations of `formula.OPERATIONS` by their codes; ramp is rise between min and max."""
ENTRIES = 4
"""Numbers of an instruction."""
ROUND = 1e-12
"""Difference of the sides of a switch that is round-off, over their size."""


@njit(cache=True, error_model="numpy")
def run(tile: Tile, code: Index, size: int, first: int, register: Array, branch: Array, held: bool) -> None:
    """Evaluate `size` instructions; register: (registers, lanes), branch: (switches, lanes). Pointers."""
    width = len(tile)
    for k in range(size):
        operation, out = code[ENTRIES * k], (first + k) * width
        a, b, c = code[ENTRIES * k + 1] * width, code[ENTRIES * k + 2] * width, code[ENTRIES * k + 3] * width
        if operation < POWER:
            x, y = simd.load(tile, register, a), simd.load(tile, register, b)
            if operation == ADD:
                simd.store(register, out, x + y)
            elif operation == SUBTRACT:
                simd.store(register, out, x - y)
            elif operation == MULTIPLY:
                simd.store(register, out, x * y)
            elif operation == DIVIDE:
                simd.store(register, out, x / y)
            elif operation == MULTIPLY_ADD:
                simd.store(register, out, x * y + simd.load(tile, register, c))
            elif operation == NEGATE:
                simd.store(register, out, -x)
            else:
                simd.store(register, out, x * x)
        elif ABSOLUTE <= operation <= MAXIMUM:
            for lane in range(width):
                x, y = register[a + lane], register[b + lane]
                above = branch[c + lane] > 0.0 if held else _is_above(operation, x, y)
                register[out + lane] = _switched(operation, x, y, above) if x == x and y == y else np.nan
        else:
            for lane in range(width):
                register[out + lane] = _value(operation, register[a + lane], register[b + lane])


@njit(cache=True, error_model="numpy", forceinline=True)
def _is_above(operation: int, x: float, y: float) -> bool:
    """Return on which side a switch is by its arguments."""
    return x >= (y if operation >= MINIMUM else 0.0)


@njit(cache=True, error_model="numpy", forceinline=True)
def _switched(operation: int, x: float, y: float, above: bool) -> float:
    if operation == ABSOLUTE:
        return x if above else -x
    if operation == STEP:
        return 1.0 if above else 0.0
    return x if above == (operation == MAXIMUM) else y


@njit(cache=True, error_model="numpy")
def _value(operation: int, x: float, y: float) -> float:
    value = np.nan
    if operation == POWER:
        value = x**y
    elif operation == RISE:
        value = x * x * x * (10.0 + x * (6.0 * x - 15.0))
    elif operation == SINE:
        value = np.sin(x)
    elif operation == COSINE:
        value = np.cos(x)
    elif operation == TANGENT:
        value = np.tan(x)
    elif operation == TANH:
        value = np.tanh(x)
    elif operation == ROOT:
        value = np.sqrt(x)
    elif operation == EXPONENTIAL:
        value = np.exp(x)
    else:
        value = np.log(x)
    return value


@njit(cache=True, error_model="numpy")
def reverse(
    tile: Tile, code: Index, size: int, first: int, register: Array, branch: Array, held: bool, adjoint: Array
) -> None:
    """Add the derivatives by all registers to their adjoints, from those of the results; (registers, lanes) each.

    register, branch: as `run` had them. Pointers.
    """
    width = len(tile)
    for k in range(size - 1, -1, -1):
        operation, out = code[ENTRIES * k], (first + k) * width
        a, b, c = code[ENTRIES * k + 1] * width, code[ENTRIES * k + 2] * width, code[ENTRIES * k + 3] * width
        for lane in range(width):
            g = adjoint[out + lane]
            if g == 0.0:
                continue
            x, y = register[a + lane], register[b + lane]
            if ABSOLUTE <= operation <= MAXIMUM:
                above = branch[c + lane] > 0.0 if held else _is_above(operation, x, y)
                by_x, by_y = _sides(operation, x, above)
            else:
                by_x, by_y = _slopes(operation, x, y, register[out + lane])
            adjoint[a + lane] += g * by_x
            if by_y != 0.0:
                adjoint[b + lane] += g * by_y
            if operation == MULTIPLY_ADD:
                adjoint[c + lane] += g


@njit(cache=True, error_model="numpy", forceinline=True)
def _sides(operation: int, x: float, above: bool) -> tuple[float, float]:
    """Derivatives of a switch on its side; 0 of |x| at 0."""
    if operation == ABSOLUTE:
        return 0.0 if x == 0.0 else 1.0 if above else -1.0, 0.0
    if operation == STEP:
        return 0.0, 0.0
    return (1.0, 0.0) if above == (operation == MAXIMUM) else (0.0, 1.0)


@njit(cache=True, error_model="numpy")
def _slopes(operation: int, x: float, y: float, value: float) -> tuple[float, float]:
    """Derivatives of an operation that does not switch by its first two arguments; 0 where a root has no slope."""
    by_x, by_y = 1.0, 0.0
    if operation == ADD:
        by_y = 1.0
    elif operation == SUBTRACT:
        by_y = -1.0
    elif operation in (MULTIPLY, MULTIPLY_ADD):
        by_x, by_y = y, x
    elif operation == DIVIDE:
        by_x, by_y = 1.0 / y, -value / y
    elif operation == NEGATE:
        by_x = -1.0
    elif operation == SQUARE:
        by_x = 2.0 * x
    elif operation == POWER:
        by_x = y * x ** (y - 1.0) if y != 0.0 and (x != 0.0 or y >= 1.0) else 0.0
        by_y = value * np.log(x) if x > 0.0 else 0.0
    elif operation == RISE:
        by_x = 30.0 * (x * (1.0 - x)) ** 2
    elif operation == SINE:
        by_x = np.cos(x)
    elif operation == COSINE:
        by_x = -np.sin(x)
    elif operation == TANGENT:
        by_x = 1.0 + value * value
    elif operation == TANH:
        by_x = 1.0 - value * value
    elif operation == ROOT:
        by_x = 0.5 / value if value > 0.0 else 0.0
    elif operation == EXPONENTIAL:
        by_x = value
    else:
        by_x = 1.0 / x
    return by_x, by_y
