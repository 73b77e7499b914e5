"""What kernels call is linked into them: optimised and emitted with them, not by itself. Numba's private names hold."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from numba import njit, types
from numba.core.codegen import JITCodeLibrary
from shoal.compile import linking

KERNELS = """
from numba import njit

@njit(cache=True)
def innermost(x):
    if x < 0.0:
        raise ValueError("negative")
    return x * x

@njit(cache=True)
def inner(x):
    return innermost(x) + 1.0

@njit(cache=True)
def kernel(x):
    return inner(x) + innermost(x)
"""
RUN = """
from shoal.compile import locks
locks.install()
import kernels
from shoal.compile.linking import Part
print(*(kernels.{first}(2.0), kernels.{second}(2.0)))
try:
    kernels.{first}(-1.0)
except ValueError as error:
    print(error)
functions = kernels.kernel, kernels.inner, kernels.innermost
print(*(sum(one.stats.cache_misses.values()) for one in functions))
print(*(any(isinstance(found.entry_point, Part) for found in one.overloads.values()) for one in functions))
"""


@pytest.fixture
def emitted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The libraries that machine code is made of."""
    names: list[str] = []
    numbas = JITCodeLibrary._finalize_specific

    def finalize(self: JITCodeLibrary) -> None:
        if self.name != "nrt":  # Numba's own runtime
            names.append(self.name)
        numbas(self)

    monkeypatch.setattr(JITCodeLibrary, "_finalize_specific", finalize)
    return names


def test_numba_is_the_version_whose_private_names_are_replaced() -> None:
    assert numba.__version__.startswith("0.68.")


def test_machine_code_is_made_of_what_is_asked_for_alone(emitted: list[str]) -> None:
    @njit
    def inner(x):  # type: ignore[no-untyped-def]
        return x * x

    @njit
    def kernel(x):  # type: ignore[no-untyped-def]
        return inner(x) + 1.0

    assert kernel(3.0) == 10.0
    assert len(emitted) == 1
    assert isinstance(inner.overloads[types.float64,].entry_point, linking.Part)
    assert inner(3.0) == 9.0
    assert len(emitted) == 2
    assert kernel(2.0) == 5.0
    assert kernel(1) == 2.0


def _printed(place: Path, program: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=place,
        env={**os.environ, "NUMBA_CACHE_DIR": str(place / "cache")},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


def _run(place: Path, first: str, second: str) -> list[str]:
    return _printed(place, RUN.format(first=first, second=second))


@pytest.mark.slow
def test_the_cache_keeps_parts_and_entries_apart(tmp_path: Path) -> None:
    """A part in the cache serves callers of other processes, and is compiled again for whoever calls it from Python."""
    (tmp_path / "kernels.py").write_text(KERNELS)
    assert _run(tmp_path, "inner", "inner") == ["5.0 5.0", "negative", "0 1 1", "False False True"]
    # `innermost` is there as a part; `inner` is there as an entry only
    assert _run(tmp_path, "kernel", "kernel") == ["9.0 9.0", "negative", "1 1 0", "False True True"]
    # an entry is loaded with all that it calls
    assert _run(tmp_path, "kernel", "inner") == ["9.0 5.0", "negative", "0 0 0", "False False False"]


ALIKE = """
from numba import njit

def made(sign):
    @njit
    def moved(x):
        return x + sign
    return moved

up, down = made(1.0), made(-1.0)

@njit(cache=True)
def rise(x):
    return up(x)

@njit(cache=True)
def fall(x):
    return down(x)

@njit(cache=True)
def first(x):
    return rise(x)

@njit(cache=True)
def second(x):
    return fall(x)

@njit(cache=True)
def both(x):
    return 10.0 * rise(x) + fall(x)
"""
CALL = """
from shoal.compile import locks
locks.install()
import alike
print(alike.{name}(5.0))
"""


@pytest.mark.slow
def test_functions_that_differ_in_what_they_enclose_stay_apart(tmp_path: Path) -> None:
    """Sums and products of vectors are such: one name, the same types. Numba tells them apart within a process only."""
    (tmp_path / "alike.py").write_text(ALIKE)
    found = [_printed(tmp_path, CALL.format(name=name)) for name in ("first", "second", "both")]
    assert found == [["6.0"], ["4.0"], ["64.0"]]
