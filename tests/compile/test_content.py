"""Compiled kernels are found by their content: an edit reaches the kernels that it changes, and no others."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from numba import config
from numba.core.dispatcher import Dispatcher
from numba.extending import _Intrinsic
from shoal.compile import content

CALLEE = '''
from numba import njit
FACTOR = 2.0
TABLE = {1: (3.0, 4.0)}

@njit(cache=True)
def inner(x):
    """Return a multiple."""
    return FACTOR * x

@njit(cache=True)
def other(x):
    return x - 1.0
'''
KERNEL = """
from numba import njit
import shoal.callee as callee

@njit(cache=True)
def kernel(x):
    return callee.inner(x) + 1.0
"""
CHANGES = {
    "": ("", False),
    "docstring": ("Return a multiple.", False),
    "moved": ("from numba", False),
    "a function that is not called": ("x - 1.0", False),
    "constant": ("2.0", True),
    "body": ("FACTOR * x", True),
    "option": ("(cache=True)", True),
}


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    """Import both modules anew, as parts of the library, and return the second."""
    import shoal

    monkeypatch.setattr(shoal, "__path__", [*shoal.__path__, str(tmp_path)])
    (tmp_path / "kernels.py").write_text(KERNEL)

    def load(callee: str) -> Any:
        (tmp_path / "callee.py").write_text(callee)
        for name in ("shoal.callee", "shoal.kernels"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        return importlib.import_module("shoal.kernels")

    return load


REPLACED = {"moved": "\n\nfrom numba", "option": "(cache=True, fastmath=True)", "constant": "3.0", "body": "FACTOR + x"}


@pytest.mark.parametrize("change", CHANGES)
def test_an_edit_in_another_file_changes_the_key_of_what_it_reaches(modules: Callable[[str], Any], change: str) -> None:
    text, reaches = CHANGES[change]
    before = content.key(modules(CALLEE).kernel.py_func, "")
    edited = CALLEE.replace(text, REPLACED.get(change, "x - 5.0"), 1) if text else CALLEE
    assert (content.key(modules(edited).kernel.py_func, "") != before) == reaches


RUN = """
import shoal, sys
shoal.__path__.append(sys.argv[1])
from shoal.compile import locks
locks.install()
from shoal.kernels import kernel
print(kernel(2.0), sum(kernel.stats.cache_hits.values()))
"""


def test_a_kernel_is_loaded_until_its_callee_in_another_file_changes(tmp_path: Path) -> None:
    """Numba by itself would go on using the old one."""

    def run(callee: str) -> str:
        (tmp_path / "kernels.py").write_text(KERNEL)
        (tmp_path / "callee.py").write_text(callee)
        place = {"SHOAL_HOME": str(tmp_path / "home"), "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-c", RUN, str(tmp_path)]
        return subprocess.run(command, env=place, capture_output=True, text=True, check=True).stdout.strip()

    assert run(CALLEE) == "5.0 0"
    assert run(CALLEE.replace("Return", "Give")) == "5.0 1"
    assert run(CALLEE.replace("2.0", "7.0")) == "15.0 0"
    assert run(CALLEE) == "5.0 1", "the first is still there"


def test_every_kernel_of_the_library_has_a_key() -> None:
    """What a kernel reads is of kinds whose content the key knows."""
    from shoal.engines.tree import march  # noqa: F401
    from shoal.mechanics import warm  # noqa: F401

    every = {
        value.py_func
        for name, module in list(sys.modules.items())
        if name.startswith("shoal.")
        for value in vars(module).values()
        if isinstance(value, Dispatcher)
    }
    assert len({content.key(function, "") for function in every}) > 0.9 * len(every) > 300
    read = [value for function in every for value in function.__globals__.values()]
    made_by = {value._defn.__module__ for value in read if isinstance(value, _Intrinsic)}
    assert made_by <= {f"shoal.compile.{name}" for name in content._INSTRUCTIONS}


KEYS = """
import hashlib, sys
from numba.core.dispatcher import Dispatcher
from shoal.compile import content
from shoal.engines.tree import march
from shoal.mechanics import warm
modules = [module for name, module in sorted(sys.modules.items()) if name.startswith("shoal.")]
kernels = [value.py_func for module in modules for value in vars(module).values() if isinstance(value, Dispatcher)]
print(hashlib.sha256("".join(content.key(kernel, "") for kernel in kernels).encode()).hexdigest())
"""


def test_no_key_follows_what_a_program_has_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """A function of Python that has the name of an attribute in a kernel counts as called, with the tables it fills."""
    from shoal.mechanics import kernels, march
    from shoal.mechanics.analysis import evaluations

    def keys() -> list[str]:
        content._parts.cache_clear()
        content._hash.cache_clear()
        names = [value for one in (kernels, march, evaluations) for value in vars(one).values()]
        return [content.key(value.py_func, "") for value in names if isinstance(value, Dispatcher)]

    before = keys()
    for module, table in ((kernels, "_FOUND"), (kernels, "_READY"), (march, "_LOOPS"), (evaluations, "_ADDRESSES")):
        monkeypatch.setattr(module, table, {"some": len(table)})
    assert keys() == before


@pytest.mark.slow
def test_all_processes_have_the_same_keys() -> None:
    """The order of a set, as of the options of fast mathematics, is another in each process."""
    environments = [os.environ | {"PYTHONHASHSEED": seed} for seed in ("0", "1")]
    runs = [subprocess.Popen([sys.executable, "-c", KEYS], env=one, stdout=subprocess.PIPE) for one in environments]
    one, other = (run.communicate()[0] for run in runs)
    assert len(one) > 60
    assert one == other


def test_a_kernel_depends_on_the_kind_of_structure_that_it_is_compiled_for() -> None:
    """The force kernel of a family holds its own elements: an edit of others leaves it as it is."""
    from shoal.mechanics.elements import cubic, quintic
    from shoal.mechanics.elements.families import add_force
    from shoal.mechanics.kernels import _force

    def reached(kind: type) -> set[Any]:
        seen, pending = set(), [_force.py_func]
        while pending:
            function = pending.pop()
            if function not in seen:
                seen.add(function)
                pending += content._parts(function, frozenset([kind]))[1]
        return seen

    assert add_force in reached(cubic.Cubics)
    assert cubic.force.py_func in reached(cubic.Cubics) - reached(quintic.Quintics)
    assert quintic.force.py_func in reached(quintic.Quintics) - reached(cubic.Cubics)
    assert content.key(_force.py_func, "Cubics") != content.key(_force.py_func, "Quintics")


def test_a_time_loop_depends_on_no_integrator() -> None:
    from shoal.mechanics.integrators.scheme import IMPLEMENTATIONS
    from shoal.mechanics.march import loop

    seen, pending = set(), [loop.py_func]
    while pending:
        function = pending.pop()
        if function not in seen:
            seen.add(function)
            pending += content._parts(function, frozenset())[1]
    assert not seen & {kernels.step.py_func for kernels in IMPLEMENTATIONS.values()}


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["rk4", "radau5"])
def test_the_key_follows_all_that_the_compiler_compiles(integrator: str, tmp_path: Path) -> None:
    """Numba is the judge: each kernel that it compiles as a part of another one is among those the key follows."""
    code = JUDGE.format(integrator=integrator)
    place = {"SHOAL_HOME": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", code], env=place, capture_output=True, text=True, check=True)
    parts, missed = map(int, done.stdout.split())
    assert parts > 20
    assert missed == 0


JUDGE = """
import sys
from numba.core.dispatcher import Dispatcher
from shoal.compile import content
from shoal.mechanics import warm
from shoal.scene import load_scene

def compiled():
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("shoal.")]
    found = (value for module in modules for value in vars(module).values() if isinstance(value, Dispatcher))
    return {{value.py_func: len(value.overloads) for value in found}}

def followed(function, chosen):
    seen, pending = set(), [function]
    while pending:
        one = pending.pop()
        if one not in seen:
            seen.add(one)
            pending += content._parts(one, chosen)[1]
    return seen

scene = load_scene("parallelogram").with_values({{"solver.integrator": "{integrator}"}})
kernel = next(one for one in warm.required(scene, 1) if one.name == "step")
before = compiled()
kernel.function.compile(kernel.kinds)
parts = {{function for function, count in compiled().items() if count > before.get(function, 0)}}
text = " ".join(map(content._text, kernel.kinds))
kinds = {{kind for pairs in content.ALTERNATIVES.values() for kind, _ in pairs if kind.__name__ in text}}
print(len(parts), len(parts - followed(kernel.function.py_func, frozenset(kinds))))
"""


def test_tests_find_the_kernels_that_are_compiled_ahead() -> None:
    """Though pytest has imported Numba before; else each run would compile them into the folders of the sources."""
    assert os.environ["NUMBA_CACHE_DIR"] == config.CACHE_DIR
