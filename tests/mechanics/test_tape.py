"""The tape: values and derivatives of every operation, in any lane alike."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit
from shoal.compile.pointers import pointer
from shoal.mechanics import tape
from shoal.mechanics.numerics.tile import SINGLE, WIDE, Array, Index, Tile
from shoal.scene.formula import OPERATIONS

LANES = len(WIDE)


@njit  # type: ignore[untyped-decorator]
def _run(tile: Tile, code: Index, size: int, first: int, register: Array) -> None:
    tape.run(tile, pointer(code), size, first, pointer(register), pointer(register), False)


@njit  # type: ignore[untyped-decorator]
def _reverse(tile: Tile, code: Index, size: int, first: int, register: Array, adjoint: Array) -> None:
    tape.reverse(tile, pointer(code), size, first, pointer(register), pointer(register), False, pointer(adjoint))


def evaluated(code: Any, inputs: Array) -> Array:
    """Registers (registers, lanes) after a run of a tile of as many lanes as the inputs have."""
    register = np.concatenate([inputs, np.zeros((len(code), inputs.shape[1]))])
    flat, tile = register.ravel(), SINGLE if inputs.shape[1] == 1 else WIDE
    _run(tile, np.array(code, dtype=np.int64).ravel(), len(code), len(inputs), flat)
    return flat.reshape(register.shape)


@pytest.mark.parametrize("operation", tape.CODES)
def test_an_operation_is_that_of_formulas_in_every_lane(operation: str) -> None:
    rng = np.random.default_rng(1)
    inputs = rng.uniform(0.1, 2.0, (3, LANES)) * (1.0 if operation in ("sqrt", "log", "**") else rng.choice([-1, 1]))
    code = [[tape.CODES[operation], 0, 1, 0], [tape.MULTIPLY_ADD, 3, 1, 2]]
    wide = evaluated(code, inputs)
    function = OPERATIONS[operation]
    expected = function(inputs[0]) if _one(operation) else function(*inputs[:2])
    assert wide[3] == pytest.approx(expected, rel=1e-15, abs=1e-300)
    assert wide[4] == pytest.approx(expected * inputs[1] + inputs[2], rel=1e-14)
    for lane in range(LANES):
        assert np.array_equal(evaluated(code, inputs[:, [lane]])[:, 0], wide[:, lane])


def _one(operation: str) -> bool:
    return operation not in ("+", "-", "*", "/", "**", "min", "max")


@pytest.mark.parametrize("operation", [*tape.CODES, "both"])
def test_derivatives_are_those_of_differences(operation: str) -> None:
    rng = np.random.default_rng(2)
    inputs, step = rng.uniform(0.2, 0.8, (3, LANES)), 1e-6
    number = tape.MULTIPLY_ADD if operation == "both" else tape.CODES[operation]
    code = [[number, 0, 1, 2], [tape.SINE, 3, 0, 0], [tape.MULTIPLY, 4, 0, 0]]
    register = evaluated(code, inputs)
    adjoint = np.zeros_like(register)
    adjoint[-1] = 1.0
    flat = adjoint.ravel()
    _reverse(WIDE, np.array(code, dtype=np.int64).ravel(), len(code), 3, register.ravel(), flat)
    for k in range(3):
        ahead, behind = (inputs + side * step * np.eye(3)[k][:, None] for side in (1, -1))
        slope = (evaluated(code, ahead)[-1] - evaluated(code, behind)[-1]) / (2 * step)
        assert flat.reshape(register.shape)[k] == pytest.approx(slope, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize(("operation", "at"), [("abs", 0.0), ("sqrt", 0.0), ("step", 0.0), ("**", 0.0)])
def test_no_derivative_is_no_number_at_a_kink(operation: str, at: float) -> None:
    code, register = [[tape.CODES[operation], 0, 1, 0]], np.array([[at], [0.5], [0.0]])
    flat = np.array([0.0, 0.0, 1.0])
    register = evaluated(code, register[:2])
    _reverse(SINGLE, np.array(code, dtype=np.int64).ravel(), 1, 2, register.ravel(), flat)
    assert flat[0] == 0.0
    assert np.all(np.isfinite(flat))
