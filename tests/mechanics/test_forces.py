"""Force elements against differences of their own energy and power, and against formulas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from shoal.compile.pointers import pointer, raw
from shoal.mechanics import fitting, forces, functions
from shoal.mechanics.forces import ANGLE, DISTANCE, LAW, PLACE, Forces
from shoal.mechanics.numerics.tile import SINGLE, WIDE, Tile

Array = Any


@njit(cache=True)
def _force(tile, held, packed, t, z, zdot, memory, f, w, power):
    h, p = raw(held), raw(packed)
    forces.add_force(
        tile, h, p, t, pointer(z), pointer(zdot), pointer(memory), pointer(f), pointer(w), pointer(power), True
    )


@njit(cache=True)
def _energy(tile, held, packed, z, memory, w, energy):
    h, p = raw(held), raw(packed)
    forces.add_energy(tile, h, p, pointer(z), pointer(memory), pointer(w), pointer(energy), 1)


@njit(cache=True)
def _tangent(tile, held, packed, z, memory, w, out):
    h, p = raw(held), raw(packed)
    forces.tangent(tile, h, p, pointer(z), pointer(memory), pointer(w), pointer(out), 1)


@njit(cache=True)
def _damping(tile, held, z, zdot, w, out):
    forces.damping(tile, raw(held), pointer(z), pointer(zdot), pointer(w), pointer(out), 1)


@njit(cache=True)
def _remember(tile, held, z, memory):
    forces.remember(tile, raw(held), pointer(z), pointer(memory))


TABLE = fitting.fit(lambda x: np.sinh(x) + 0.3 * x**2, 2.0, begin=-2.0)
PACKED = functions.pack([TABLE, fitting.antiderivative(TABLE), fitting.fit(lambda t: np.cos(2 * t), 10.0)])
NO_TABLE, WITH_TABLE = (-1, -1, -1), (0, 1, 2)


@dataclass(frozen=True)
class Bench:
    """Elements on `rows` coordinates in one tile; states are (rows, lanes)."""

    tile: Tile
    held: Forces
    memory: Array

    def force(self, z: Array, zdot: Array, t: float = 0.7) -> tuple[Array, Array]:
        f, power = np.zeros(z.size), np.zeros(len(self.tile))
        w = np.full(64 * len(self.tile), np.nan)
        _force(self.tile, self.held, PACKED, t, z.ravel(), zdot.ravel(), self.memory, f, w, power)
        return f.reshape(z.shape), power

    def energy(self, z: Array) -> Array:
        energy, w = np.zeros(3 * len(self.tile)), np.full(64 * len(self.tile), np.nan)
        _energy(self.tile, self.held, PACKED, z.ravel(), self.memory, w, energy)
        assert not energy.reshape(3, -1)[[0, 2]].any()
        return energy.reshape(3, -1)[1]

    def assembled(self, z: Array, zdot: Array | None = None) -> Array:
        """Stiffness, or with rates damping, on the rows: (rows, rows, lanes)."""
        out = np.full((1 + 36 * self.held.size) * len(self.tile), np.nan)
        w = np.full(64 * len(self.tile), np.nan)
        if zdot is None:
            _tangent(self.tile, self.held, PACKED, z.ravel(), self.memory, w, out)
        else:
            _damping(self.tile, self.held, z.ravel(), zdot.ravel(), w, out)
        blocks = out.reshape(-1, len(self.tile))[1:].reshape(self.held.size, 6, 6, -1)
        total = np.zeros((z.shape[0], z.shape[0], len(self.tile)))
        for block, rows in zip(blocks, self.held.rows.reshape(-1, 6), strict=True):
            for i in range(6):
                for j in range(6):
                    total[rows[i], rows[j]] += block[i, j]
        return total


def bench(
    kinds: list[int], law: Array, numbers: tuple[int, int, int] = NO_TABLE, rows: Any = None, tile: Tile = SINGLE
) -> Bench:
    """One element of each kind on its own six rows unless rows are given; law: (8,) or (8, lanes)."""
    size, width = len(kinds), len(tile)
    if rows is None:
        rows = np.arange(6 * size)
    table, energy, drive = (np.full(size, number) for number in numbers)
    laws = np.tile(np.broadcast_to(np.reshape(law, (LAW, -1)), (LAW, width)), (size, 1))
    held = Forces(2, size, np.array(kinds), np.array(rows).ravel(), table, energy, drive, laws.ravel())
    return Bench(tile, held, np.zeros(size * width))


FULL_LAW = np.array([3.0, 0.7, 0.4, 0.2, 1.3, 0.6, 2.5, 0.9])
ELASTIC_LAW = np.array([3.0, 0.7, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0])
KINDS = [DISTANCE, ANGLE, PLACE]
SHARED = {
    "own": None,
    "shared": [[0, 1, 2, 3, 2, 3], [2, 3, 4, 5, 0, 1], [0, 1, 4, 5, 0, 1]],
}


def state(seed: int, rows: int = 18, lanes: int = 1) -> Array:
    return np.random.default_rng(seed).normal(size=(rows, lanes))


def slope(function: Any, z: Array, step: float = 1e-5) -> Array:
    """Central differences, fourth order, along every row; the derivative's index comes first."""
    columns = []
    for row in range(z.shape[0]):
        d = np.zeros_like(z)
        d[row] = step
        columns.append((8 * (function(z + d) - function(z - d)) - (function(z + 2 * d) - function(z - 2 * d))) / step)
    return np.array(columns) / 12


@pytest.mark.parametrize("rows", SHARED.values(), ids=SHARED)
@pytest.mark.parametrize("numbers", [NO_TABLE, WITH_TABLE], ids=["law", "table"])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.by_day(1)
def test_force_tangent_and_energy_agree(seed: int, numbers: tuple[int, int, int], rows: Any) -> None:
    tested = bench(KINDS, ELASTIC_LAW, numbers, rows)
    z = 0.7 * state(seed)
    rest = np.zeros_like(z)
    force, power = tested.force(z, rest)
    assert power[0] == 0.0
    np.testing.assert_allclose(force, -slope(tested.energy, z), rtol=1e-7, atol=1e-7)
    stiffness = tested.assembled(z)[..., 0]
    expected = -slope(lambda x: tested.force(x, rest)[0], z)[..., 0]
    np.testing.assert_allclose(stiffness, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(stiffness, stiffness.T, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("rows", SHARED.values(), ids=SHARED)
def test_damping_is_the_slope_of_the_force_in_the_rates(rows: Any) -> None:
    tested = bench(KINDS, FULL_LAW, WITH_TABLE, rows)
    z, zdot = state(1), state(2)
    expected = -slope(lambda v: tested.force(z, v)[0], zdot)[..., 0]
    damping = tested.assembled(z, zdot)[..., 0]
    np.testing.assert_allclose(damping, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max())
    assert np.linalg.eigvalsh(damping).min() > -1e-12 * np.abs(damping).max()


@given(st.integers(0, 2**32 - 1), st.sampled_from(KINDS), st.lists(st.floats(0, 10), min_size=LAW, max_size=LAW))
def test_power_balance(seed: int, kind: int, law: list[float]) -> None:
    """The power of all forces is what the springs give back, less what is dissipated, plus what is supplied."""
    law = [*law[:5], law[5] + 0.1, *law[6:]]
    tested = bench([kind], np.array(law), WITH_TABLE)
    elastic = bench([kind], np.array([law[0], law[1], 0, law[3], 0, 1, 0, 0]), WITH_TABLE)
    z, zdot = state(seed, 6), state(seed + 1, 6)
    force, power = tested.force(z, zdot)
    released = np.sum(elastic.force(z, zdot)[0] * zdot)
    np.testing.assert_allclose(np.sum(force * zdot), released - power[0], rtol=1e-10, atol=1e-10 * (1 + abs(released)))
    passive = bench([kind], np.array([*law[:6], 0.0, law[7]]), WITH_TABLE)
    assert passive.force(z, zdot)[1][0] >= 0.0


@given(st.integers(0, 2**32 - 1), st.sampled_from(KINDS))
def test_no_net_force_and_the_same_in_a_turned_frame(seed: int, kind: int) -> None:
    tested = bench([kind], FULL_LAW)
    z, zdot = state(seed, 6), state(seed + 1, 6)
    force, power = tested.force(z, zdot)
    if kind != ANGLE:
        np.testing.assert_allclose(force[:2], -force[2:4], rtol=0, atol=1e-12 * np.abs(force).max())
    turned = tested.force(*(turn(x) for x in (z, zdot)))
    np.testing.assert_allclose(turned[0], turn(force), rtol=0, atol=1e-9 * (1 + np.abs(force).max()))
    np.testing.assert_allclose(turned[1], power, rtol=1e-9, atol=1e-9)


def turn(rows: Array) -> Array:
    pairs = (rows[0::2] + 1j * rows[1::2]) * np.exp(0.8j)
    out = np.empty_like(rows)
    out[0::2], out[1::2] = pairs.real, pairs.imag
    return out


def test_laws_by_hand() -> None:
    k, k3, c, g0, limit, speed, amplitude, drag = FULL_LAW
    drive = amplitude * np.cos(2 * 0.7)
    for kind, z, zdot, x, rate in (
        (DISTANCE, [1, 1, 4, 5, 0, 0], [0, 0, 3, 4, 0, 0], 5.0 - g0, 5.0),
        (ANGLE, [2, 0, 0, 3, 0, 0], [0, 0, -6, 0, 0, 0], np.pi / 2 - g0, 2.0),
        (PLACE, [1, 1, 4, 5, 0, -2], [0, 1, 0, 0, 0, 0], -4.0 - g0, 1.0),
    ):
        state = np.array(z, dtype=float)[:, None]
        rates = np.array(zdot, dtype=float)[:, None]
        force, power = bench([kind], FULL_LAW, (-1, -1, 2)).force(state, rates)
        resisting = c * rate + drag * abs(rate) * rate + limit * np.tanh(rate / speed) - drive
        assert power[0] == pytest.approx(resisting * rate)
        # The power of F dg/dz is F g', whatever the measure.
        assert np.sum(force * rates) == pytest.approx((-(k * x + k3 * x**3) - resisting) * rate)


@pytest.mark.parametrize("natural", [0.0, 0.2])
def test_a_distance_of_zero_has_no_direction(natural: float) -> None:
    tested = bench([DISTANCE], np.array([3.0, 0.7, 0.4, natural, 1.3, 0.6, 0.0, 0.0]))
    z, zdot = np.ones((6, 1)), state(1, 6)
    force, power = tested.force(z, zdot)
    assert not force.any()
    assert power[0] == 0.0
    assert tested.energy(z)[0] == pytest.approx(1.5 * natural**2 + 0.175 * natural**4)
    spread = np.kron([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]], np.eye(2))
    np.testing.assert_array_equal(tested.assembled(z)[..., 0], 3.0 * spread if natural == 0.0 else 0.0 * spread)
    assert not tested.assembled(z, zdot).any()


@pytest.mark.parametrize("start", [0.0, 6 * np.pi, -0.5 - 40 * np.pi])
def test_an_angle_over_many_turns(start: float) -> None:
    tested = bench([DISTANCE, ANGLE], np.array([2.0, 0, 0, 0, 0, 0, 0, 0]), rows=[[0, 1, 2, 3, 0, 1]] * 2)

    def place(angle: float) -> Array:
        # Both directions turn, and neither is a unit vector.
        first, second = 2.0 * np.exp(0.3j * angle), 0.5 * np.exp(1.3j * angle)
        return np.array([[first.real], [first.imag], [second.real], [second.imag]])

    memory = forces.initial_memory(SINGLE, tested.held, place(start).ravel(), np.array([0.0, start + 0.1]))
    assert memory == pytest.approx([0.0, start], abs=1e-12)
    for angle in start + np.concatenate([np.arange(0.0, 30.0, 2.9), np.arange(30.0, -60.0, -2.9)]):
        turning = Bench(SINGLE, bench([ANGLE], np.array([2.0, 0, 0, 0, 0, 0, 0, 0])).held, memory[1:])
        z = np.vstack([place(angle), np.ones((2, 1))])
        assert turning.energy(z)[0] == pytest.approx(angle**2, rel=1e-12, abs=1e-10)
        _remember(SINGLE, tested.held, place(angle).ravel(), memory)
        assert memory[1] == pytest.approx(angle, abs=1e-10)
        assert memory[0] == 0.0


def test_a_table_beyond_its_range_keeps_its_force() -> None:
    tested = bench([PLACE], np.zeros(LAW), WITH_TABLE)
    ends = np.sinh([-2.0, 2.0]) + 0.3 * 4
    for end, far in zip(ends, (-3.5, 3.5), strict=True):
        z = np.array([[0.0], [0.0], [far], [0.0], [1.0], [0.0]])
        assert tested.force(z, np.zeros_like(z))[0][2, 0] == pytest.approx(-end)
        np.testing.assert_allclose(tested.force(z, 0 * z)[0], -slope(tested.energy, z), rtol=1e-7, atol=1e-7)


def test_lanes_are_what_they_are_alone() -> None:
    lanes = len(WIDE)
    z, zdot = state(1, 18, lanes), state(2, 18, lanes)
    law = FULL_LAW[:, None] * np.linspace(0.5, 2.0, lanes)
    law[4, 3] = 0.0
    wide = bench(KINDS, law, WITH_TABLE, tile=WIDE)
    force, power = wide.force(z, zdot)
    for lane in range(lanes):
        single = bench(KINDS, law[:, lane], WITH_TABLE)
        at, rate = z[:, [lane]].copy(), zdot[:, [lane]].copy()
        for found, alone in (
            (force, single.force(at, rate)[0]),
            (power, single.force(at, rate)[1]),
            (wide.energy(z), single.energy(at)),
            (wide.assembled(z), single.assembled(at)),
            (wide.assembled(z, zdot), single.assembled(at, rate)),
        ):
            np.testing.assert_allclose(found[..., lane], alone[..., 0], rtol=1e-13, atol=1e-13 * np.abs(alone).max())


@pytest.mark.slow
def test_nothing_from_no_elements() -> None:
    tested = bench([], FULL_LAW)
    z = state(1)
    assert not tested.force(z, z)[0].any()
    assert tested.energy(z)[0] == 0.0
