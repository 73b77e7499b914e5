"""Results that cross as JSON: every bit comes back, and nothing that was not a result is made."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest
from scipy import stats
from shoal.engines.sweep import SpotCheck
from shoal.error_budget import ErrorBudget
from shoal.scene import load_scene
from shoal.serialization import KIND, packed, unpacked
from shoal.trajectory import Status


def crossed(value: Any) -> Any:
    return unpacked(orjson.loads(orjson.dumps(packed(value))))


def drawn(rng: np.random.Generator, depth: int = 0) -> Any:
    """Any value that can be, compared by its repr, which tells kind and every bit."""
    bits = float(rng.integers(0, 2**64, dtype=np.uint64).view(np.float64))
    leaves = (
        None, True, int(rng.integers(-(2**62), 2**62)), bits, -0.0, math.inf, complex(bits, -math.inf), "\u00b5@\n",
        np.float64(bits), np.bool_(True), rng.integers(0, 2**64, (2, 0, 3), dtype=np.uint64), Status.DRIFTED,
        rng.integers(0, 2**64, (3, 2), dtype=np.uint64).view(np.float64).T, np.array(["a", "bc"]),
        SpotCheck(1, 2, ErrorBudget({"time": bits})),
    )  # fmt: skip
    if depth == 3 or rng.random() < 0.4:
        return leaves[rng.integers(len(leaves))]
    inner = [drawn(rng, depth + 1) for _ in range(rng.integers(4))]
    keys = ("a", KIND, 1, ("b", 2), None)
    return (inner, tuple(inner), dict(zip(keys, inner, strict=False)))[rng.integers(3)]


def test_every_bit_comes_back() -> None:
    rng = np.random.default_rng(5)
    with np.printoptions(threshold=10**6, floatmode="unique"):
        for _ in range(300):
            value = drawn(rng)
            assert repr(crossed(value)) == repr(value)


def test_scenes_and_distributions_come_back() -> None:
    scene = load_scene("andrews-squeezer")
    assert crossed({"scene": scene}) == {"scene": scene}
    there, here = crossed(known := stats.truncnorm(-1.0, 2.0, loc=0.5, scale=0.1)), known
    assert there.ppf([0.1, 0.9]).tobytes() == here.ppf([0.1, 0.9]).tobytes()


def test_plain_json_is_left_alone() -> None:
    found = {"a": [1, 2.5, None, {"b": "c"}], "status": "ok"}
    assert unpacked(found) == found


@pytest.mark.parametrize(
    "found",
    [
        {KIND: "os:system", "is": "true"},
        {KIND: "shoal.cli:main", "is": {}},
        {KIND: "shoal.library:Path", "is": {}},
        {KIND: "shoal.atomic_write:os.remove", "is": {}},
        {KIND: "shoal.engines.sweep:SpotCheck", "is": {"looked_at": 1, "guess": 2}},
        {KIND: "shoal.trajectory:Status", "is": "fine"},
        {KIND: "shoal.nowhere:Nothing", "is": {}},
        {KIND: "array", "is": "bm90IGFuIGFycmF5", "scalar": False},
        {KIND: "distribution", "name": "test", "is": [[], {}]},
        {KIND: ["tuple"], "is": []},
        {KIND: "tuple"},
    ],
)
def test_nothing_else_is_made(found: Any) -> None:
    with pytest.raises(ValueError, match=r".+"):
        unpacked(found)


def test_what_cannot_cross_is_said() -> None:
    with pytest.raises(TypeError, match="PosixPath does not cross"):
        packed([Path("here")])
