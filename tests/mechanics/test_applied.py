"""Applied loads against formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from shoal.compile.pointers import pointer, raw
from shoal.mechanics import applied, fitting, functions
from shoal.mechanics.applied import Applied
from shoal.mechanics.numerics.tile import SINGLE, WIDE, Tile

Array = Any
PACKED = functions.pack([fitting.fit(lambda t: 1 + t, 2.0), fitting.fit(lambda t: np.sin(3 * t), 2.0)])
TIME = 0.7
NONE = np.zeros(0, dtype=np.int64)


@njit(cache=True)
def _force(tile, held, packed, t, z, zdot, f, power):
    h, p = raw(held), raw(packed)
    applied.add_force(tile, h, p, t, pointer(z), pointer(zdot), pointer(f), pointer(power))


def loads(coefficient: Array, factor: Array) -> Applied:
    """Fixed loads on rows 0, 1 and 1; loads at (0, 1) and (2, 3) that turn with (2, 3) and (4, 5)."""
    return Applied(
        2, 3, np.array([0, 1, 1]), np.ravel(coefficient), np.array([-1, 0, 1]),
        2, np.array([0, 1, 2, 3, 2, 3, 4, 5]), np.ravel(factor), np.array([1, -1]),
        0, NONE, NONE, 0, NONE, NONE,
    )  # fmt: skip


def force(tile: Tile, held: Applied, z: Array, zdot: Array) -> tuple[Array, Array]:
    f, power = np.zeros(z.size), np.zeros(len(tile))
    _force(tile, held, PACKED, TIME, z.ravel(), zdot.ravel(), f, power)
    return f.reshape(z.shape), power


@given(st.integers(0, 2**32 - 1), st.sampled_from([SINGLE, WIDE]))
def test_loads_and_their_power(seed: int, tile: Tile) -> None:
    draw = np.random.default_rng(seed)
    z, zdot, coefficient, factor = (draw.normal(size=(rows, len(tile))) for rows in (6, 6, 3, 4))
    expected = np.zeros_like(z)
    expected[0] = coefficient[0]
    expected[1] = coefficient[1] * (1 + TIME) + coefficient[2] * np.sin(3 * TIME)
    for number, strength in enumerate((np.sin(3 * TIME), 1.0)):
        direction = z[2 * number + 2] + 1j * z[2 * number + 3]
        load = (factor[2 * number] + 1j * factor[2 * number + 1]) * direction / np.abs(direction) * strength
        expected[2 * number] += load.real
        expected[2 * number + 1] += load.imag
    found, power = force(tile, loads(coefficient, factor), z, zdot)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(power, -np.sum(expected * zdot, axis=0), rtol=1e-11, atol=1e-12)


def test_lanes_are_what_they_are_alone() -> None:
    draw = np.random.default_rng(1)
    z, zdot, coefficient, factor = (draw.normal(size=(rows, len(WIDE))) for rows in (6, 6, 3, 4))
    wide = force(WIDE, loads(coefficient, factor), z, zdot)
    for lane in range(len(WIDE)):
        held = loads(coefficient[:, lane], factor[:, lane])
        alone = force(SINGLE, held, z[:, [lane]].copy(), zdot[:, [lane]].copy())
        for found, expected in zip(wide, alone, strict=True):
            np.testing.assert_allclose(found[..., lane], expected[..., 0], rtol=1e-14, atol=1e-14)


def test_nothing_from_no_loads() -> None:
    none = np.zeros(0)
    found, power = force(
        SINGLE,
        Applied(2, 0, NONE, none, NONE, 0, NONE, none, NONE, 0, NONE, NONE, 0, NONE, NONE),
        np.ones((6, 1)),
        np.ones((6, 1)),
    )
    assert not found.any()
    assert power[0] == pytest.approx(0.0)


def test_a_torque_on_a_section_works_in_its_turn_alone() -> None:
    """A torque n f(t) on a node in space with the slope r' and the director d: its power in a turn w is n . w f(t)."""
    draw = np.random.default_rng(3)
    n, turn = draw.normal(size=3), draw.normal(size=3)
    slope = 1.2 * np.linalg.qr(draw.normal(size=(3, 3)))[0][:, 0]
    director = np.cross(slope, n) / np.linalg.norm(np.cross(slope, n))
    z = np.concatenate([n, slope, director])
    held = Applied(
        3, 0, NONE, np.zeros(0), NONE, 0, NONE, np.zeros(0), NONE, 0, NONE, NONE,
        1, np.arange(9), np.array([0]),
    )  # fmt: skip
    rates = np.concatenate([np.zeros(3), np.cross(turn, slope) + 0.3 * slope, np.cross(turn, director)])
    found, power = force(SINGLE, held, z[:, None], rates[:, None])
    assert power[0] == pytest.approx(-(1 + TIME) * (n @ turn), rel=1e-12)
    moment = np.cross(slope, found[3:6, 0]) + np.cross(director, found[6:9, 0])
    np.testing.assert_allclose(moment, (1 + TIME) * n, rtol=1e-12)
