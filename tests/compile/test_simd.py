"""Vectors in compiled code against plain Numba, number by number, on this processor's instructions and on others'."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from llvmlite import binding
from numba import cfunc, njit, types
from shoal.compile import simd
from shoal.compile.pointers import pointer
from shoal.compile.simd import EIGHT
from shoal.mechanics.numerics.arc import arctangent, turn

LENGTHS = pytest.mark.parametrize("lanes", [(0,) * 2, (0,) * 4, EIGHT, (0,) * 16], ids=len)
SPECIAL = [0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 5e-324, 2.3e-308, 1.7e308, -1.7e308, 1e-200, 1e200]


@njit(error_model="numpy", forceinline=True)
def _formula(x, y):  # type: ignore[no-untyped-def]
    """Every operation, between vectors and with numbers on either side."""
    return (x + y, x - 2.0, 3.0 - y, x * y, 0.5 * x, y * 0.1, x / y, 1.0 / x, y / 7.0, -x)


@njit(cache=True, error_model="numpy")
def _vectors(lanes, x, y, out, count):  # type: ignore[no-untyped-def]
    x, y, out = pointer(x), pointer(y), pointer(out)
    for at in range(0, count, len(lanes)):
        found = _formula(simd.load(lanes, x, at), simd.load(lanes, y, at))
        for k in range(10):
            simd.store(out, k * count + at, found[k])
        simd.store(out, 10 * count + at, simd.root(simd.load(lanes, x, at)))


@njit(cache=True, error_model="numpy")
def _numbers(x, y, out):  # type: ignore[no-untyped-def]
    for i in range(len(x)):
        found = _formula(x[i], y[i])
        for k in range(10):
            out[k, i] = found[k]
        out[10, i] = np.sqrt(x[i])


def _pairs() -> tuple[Any, Any]:
    """Random numbers of all sizes, and every pair of special ones; a multiple of 16 of them."""
    rng = np.random.default_rng(0)
    random = rng.normal(size=(2, 512)) * 10.0 ** rng.uniform(-30, 30, (2, 512))
    pairs = zip(random, np.meshgrid(SPECIAL, SPECIAL), strict=True)
    x, y = (np.concatenate([one, special.ravel()]) for one, special in pairs)
    return np.resize(x, 688), np.resize(y, 688)


@LENGTHS
@pytest.mark.by_day(2)
def test_operations_equal_those_of_numbers(lanes: tuple[int, ...]) -> None:
    x, y = _pairs()
    found, expected = np.full((11, x.size), 7.0), np.empty((11, x.size))
    _vectors(lanes, x, y, found, x.size)
    _numbers(x, y, expected)
    np.testing.assert_array_equal(found, expected)


@njit(cache=True, error_model="numpy")
def _inverses(lanes, x, out, count):  # type: ignore[no-untyped-def]
    x, out = pointer(x), pointer(out)
    for at in range(0, count, len(lanes)):
        simd.store(out, at, simd.inverse_root(simd.load(lanes, x, at)))
        simd.store(out, count + at, simd.heaviside(simd.load(lanes, x, at)))
        simd.store(out, 2 * count + at, simd.reciprocal(simd.load(lanes, x, at)))


@LENGTHS
def test_inverses_have_all_their_digits(lanes: tuple[int, ...]) -> None:
    """Of numbers between which the processor's first guess differs most, and of all sizes but the smallest."""
    rng = np.random.default_rng(3)
    x = np.concatenate([np.linspace(1, 4, 8192), 10.0 ** rng.uniform(-300, 300, 8192)])
    out = np.empty((3, x.size))
    _inverses(lanes, x, out, x.size)
    np.testing.assert_allclose(out[0], 1 / np.sqrt(x), rtol=5e-16, atol=0)
    np.testing.assert_allclose(out[2], 1 / x, rtol=5e-16, atol=0)
    signs = np.resize([-1.0, 0.0, -0.0, 2.0, -np.inf, np.inf, np.nan, -5e-324], 16)
    out = np.empty((3, signs.size))
    _inverses(lanes, signs, out, signs.size)
    np.testing.assert_array_equal(out[1], signs >= 0)


@njit(cache=True, error_model="numpy")
def _chosen(lanes, x, limit, out, zeros, count):  # type: ignore[no-untyped-def]
    x, limit, out = pointer(x), pointer(limit), pointer(out)
    for at in range(0, count, len(lanes)):
        simd.store(out, at, simd.inverse_below(simd.load(lanes, x, at), simd.load(lanes, limit, at)))
        zeros[0] += simd.zeros(simd.load(lanes, x, at))


@LENGTHS
def test_inverses_below_a_limit_and_zeros(lanes: tuple[int, ...]) -> None:
    x, limit = _pairs()
    out, zeros = np.full(x.size, 7.0), np.zeros(1, dtype=np.int64)
    _chosen(lanes, x, limit, out, zeros, x.size)
    with np.errstate(divide="ignore", over="ignore", under="ignore"):
        np.testing.assert_array_equal(out, np.where(x < limit, 1.0 / x, 0.0))
    assert zeros[0] == np.sum(x == 0.0)


@njit(cache=True, error_model="numpy")
def _arcs(lanes, x, out, count):  # type: ignore[no-untyped-def]
    x, out = pointer(x), pointer(out)
    for at in range(0, count, len(lanes)):
        sine, cosine = turn(simd.load(lanes, x, at))
        simd.store(out, at, sine)
        simd.store(out, count + at, cosine)
        simd.store(out, 2 * count + at, arctangent(simd.load(lanes, x, at)))


@LENGTHS
@pytest.mark.by_day(2)
def test_arcs_sines_and_cosines_are_those_of_numpy(lanes: tuple[int, ...]) -> None:
    x = np.concatenate([np.linspace(-np.pi / 2, np.pi / 2, 1022), [0.0, 1e-200]])
    out = np.empty((3, x.size))
    _arcs(lanes, x, out, x.size)
    np.testing.assert_allclose(out, [np.sin(x), np.cos(x), np.arctan(x)], rtol=1e-15, atol=2e-16)


@njit(cache=True)
def _moved(lanes, x, rows, out):  # type: ignore[no-untyped-def]
    x, rows, out, n = pointer(x), pointer(rows), pointer(out), len(lanes)
    simd.store(out, 0, simd.gather(lanes, x, 3, 5))
    simd.store(out, n, simd.pick(lanes, x, rows, 1, 2))
    simd.store(out, 2 * n, simd.spread(lanes, x[4]))
    simd.store(out, 3 * n, simd.repeat(lanes, (0, 0), x, 6))
    simd.add_to(out, 4 * n, simd.load(lanes, x, 2))


@LENGTHS
def test_vectors_come_from_where_they_should(lanes: tuple[int, ...]) -> None:
    n = len(lanes)
    rng = np.random.default_rng(1)
    x, rows, out = rng.normal(size=200), rng.integers(0, 200, 1 + 2 * n), np.ones(5 * n + 1)
    _moved(lanes, x, rows, out)
    expected = [x[3 : 3 + 5 * n : 5], x[rows[1::2]], [x[4]] * n, [x[6], x[7]] * (n // 2), 1 + x[2 : 2 + n], [1.0]]
    np.testing.assert_array_equal(out, np.concatenate(expected))


@njit(cache=True)
def _long(y, x, count):  # type: ignore[no-untyped-def]
    simd.add_scaled(pointer(y), 0.25, pointer(x), count)


@njit(cache=True)
def _copied(y, x, count):  # type: ignore[no-untyped-def]
    simd.assign(pointer(y), pointer(x), count)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 40, 43])
def test_so_many_numbers_and_no_more(count: int) -> None:
    x, y = np.random.default_rng(2).normal(size=(2, 50))
    found = y.copy()
    _long(found, x, count)
    np.testing.assert_allclose(found[:count], y[:count] + 0.25 * x[:count], rtol=1e-15, atol=1e-16)
    np.testing.assert_array_equal(found[count:], y[count:])
    _copied(found, x, count)
    np.testing.assert_array_equal(found, [*x[:count], *y[count:]])


def test_what_fits_no_vector_is_refused() -> None:
    @njit
    def repeated(x):  # type: ignore[no-untyped-def]
        return simd.repeat((0,) * 8, (0, 0, 0), pointer(x), 0)

    @njit
    def mixed(x):  # type: ignore[no-untyped-def]
        return simd.load((0,) * 8, pointer(x), 0) + simd.load((0,) * 4, pointer(x), 0)

    with pytest.raises(Exception, match="8 lanes are no multiple of 3"):
        repeated(np.zeros(8))
    with pytest.raises(Exception, match="lengths 8 and 4"):
        mixed(np.zeros(8))


RUN = """
import numpy as np
from shoal.mechanics.simulate import simulate
from shoal.scene import load_scene
scene = load_scene("flexible-double-pendulum")
one = simulate(scene, np.linspace(0, 0.3, 4))
many = simulate(scene, np.linspace(0, 0.3, 4), {"initial.OA.angle": np.linspace(0.1, 0.2, 3)})
assert {*one.status, *many.status} == {"ok"}
np.save("points.npy", np.concatenate([one.points.ravel(), many.points.ravel()]))
"""


@pytest.mark.slow
def test_other_processors_give_the_same_motion(tmp_path: Path) -> None:
    """Plain x86-64 has vectors of two numbers and no fused product, AVX four."""
    motions = []
    for name, processor in (
        ("own", {}),
        ("plain", {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""}),
        ("avx", {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": "+avx"}),
    ):
        place = tmp_path / name
        place.mkdir()
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(place / "cache"), **processor}
        subprocess.run([sys.executable, "-c", RUN], cwd=place, env=environment, check=True)
        motions.append(np.load(place / "points.npy"))
    for motion in motions[1:]:
        np.testing.assert_allclose(motion, motions[0], rtol=0, atol=1e-11)


def test_the_same_code_makes_vectors_of_an_arm_processor() -> None:
    """It is not run there."""
    numbers = types.CPointer(types.float64)

    @cfunc(types.void(numbers, numbers))
    def kernel(x, out):  # type: ignore[no-untyped-def]
        found = _formula(simd.load(EIGHT, x, 0), simd.load(EIGHT, x, 8))
        for k in range(10):
            simd.store(out, 8 * k, found[k])
        simd.store(out, 80, simd.root(simd.load(EIGHT, x, 16)))

    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    target = binding.Target.from_triple("aarch64-unknown-linux-gnu")
    module = binding.parse_assembly(kernel.inspect_llvm())
    module.triple = target.triple
    assembly = target.create_target_machine(opt=2).emit_assembly(module)
    for instruction in ("fadd", "fsub", "fmul", "fdiv", "fsqrt", "fneg"):
        assert f"{instruction}\tv" in assembly, instruction
