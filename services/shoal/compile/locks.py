"""Compilation under locks between processes, with progress.

Numba keeps what it compiled in a folder, without a lock: processes that start together compile the same kernels, and
two that write the same index at once can lose or mix up its entries. Here each compilation has a lock: the second
process waits and then loads.
"""

from __future__ import annotations

import gc
import os
import sys
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import caching, config, dispatcher, event
from numba.core.compiler_lock import global_compiler_lock

from shoal.compile import analysis, clock, content, linking, operators
from shoal.compile.progress import report
from shoal.errors import FULL, ComputationError

if sys.platform != "win32":
    import fcntl

_SECONDS = {
    "least": 16.0,
    "loop": 6.0,
    "motion": 4.0,
    "constrain": 3.0,
    "stiffness": 3.0,
    "assemble": 4.0,
    "force": 3.0,
    "settle": 2.0,
    "step": 2.0,
    "step of Radau5": 5.0,
    "step of GeneralizedAlpha": 4.0,
    "step of EnergyMomentum": 3.0,
    "step of ImplicitGauss": 2.0,
    "energy": 1.0,
    "energies": 1.0,
    "contact": 8.0,
    "decide": 8.0,
    "hold": 3.0,
    "look": 2.0,
}
"""Seconds that large kernels take to compile on one core of a server: for their order and the estimate shown."""
_OF_ALL = ("Arrays", "Work")
"""Structures that kernels are not made for by their names."""
_WORTH_A_LINE = 1.0
"""Compilations that took at least so long are reported [s]."""
_OBJECTS = 100_000
"""Objects between two collections of garbage, in place of 700: a kernel of constraints takes 11 % less time and 10 MB
more."""


def described(name: str, kinds: tuple[Any, ...]) -> str:
    """Return a name of a kernel for people: its function, the structure it is made for and the number of lanes."""
    names = [getattr(getattr(kind, "instance_class", None), "__name__", "") for kind in kinds]
    if names == ["Frame"]:
        names, kinds = [], tuple(kinds[0].dtype)
    lanes = getattr(kinds[0], "count", 0) if kinds else 0
    width = {0: "", 1: ", single"}.get(lanes, ", lanes")
    made_for = next((one for one in names if one and one not in _OF_ALL), "")
    return f"{name.lstrip('_')}{' of ' + made_for if made_for else ''}{width}"


def seconds(name: str, kinds: tuple[Any, ...]) -> float:
    """Return about how long a kernel takes to compile [s]."""
    whole = described(name, kinds).partition(",")[0]
    return _SECONDS.get(whole) or _SECONDS.get(whole.partition(" of")[0], 1.0)


class _Listener(event.Listener):  # type: ignore[misc]
    """Reports the outermost kernels; those that they call are a part of them."""

    def __init__(self) -> None:
        self._depth, self._begin, self._announced = 0, 0.0, False

    def on_start(self, event: Any) -> None:
        """A kernel begins."""
        self._depth += 1
        if self._depth > 1:
            return
        self._begin = time.perf_counter()
        if not self._announced and event.data["dispatcher"].__name__.lstrip("_") in _SECONDS:
            self._announced = True
            report("compiling what the solver lacks for this machine, once, which time limits do not count")

    def on_end(self, event: Any) -> None:
        """A kernel is done, or could not be compiled."""
        self._depth -= 1
        took = time.perf_counter() - self._begin
        if self._depth == 0 and took >= _WORTH_A_LINE:
            report(f"  {described(event.data['dispatcher'].__name__, event.data['args'])}: {took:.1f} s")


@cache
def _lock_file() -> int | None:
    """One file for all locks of this process: POSIX gives them up when any descriptor of the file is closed."""
    if sys.platform == "win32":  # kernels may be compiled twice there
        return None
    folder = Path(config.CACHE_DIR)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return os.open(folder / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError:
        return None


@contextmanager
def _locked(what: str) -> Iterator[None]:
    """Hold a lock of this name between processes: of one byte, at an offset that the name decides.

    Numba's own lock comes first, so that one thread of a process at a time waits for other processes.
    """
    file = _lock_file() if config.CACHE_DIR else None
    place = zlib.crc32(what.encode())
    with global_compiler_lock:
        if file is not None:
            with suppress(OSError):  # a file system without locks
                fcntl.lockf(file, fcntl.LOCK_EX, 1, place)
        try:
            yield
        finally:
            if file is not None:
                with suppress(OSError):
                    fcntl.lockf(file, fcntl.LOCK_UN, 1, place)


@contextmanager
def _rare_collection() -> Iterator[None]:
    """Let Python look for circular garbage less often: the compiler makes millions of objects that stay for seconds."""
    before = gc.get_threshold()
    gc.set_threshold(max(before[0], _OBJECTS), *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


_numbas_compile = dispatcher.Dispatcher.compile
_numbas_save = caching.Cache.save_overload


def _compile(self: Any, sig: Any) -> Any:
    """`Dispatcher.compile`: looks into the cache, compiles, saves. Kernels wait for those they call: in no circle.

    No time limit counts it. Raises ComputationError where there is no room for the machine code.
    """
    content.address_by_content(self)
    whole = isinstance(self._cache, caching.NullCache)
    name = f"{self.py_func.__module__}.{self.py_func.__qualname__} {sig}"
    with (
        clock.stopped(),
        global_compiler_lock if whole else _locked(name),
        linking.level(self, sig),
        _rare_collection(),
    ):
        try:
            return _numbas_compile(self, sig)
        except OSError as error:
            if error.errno not in FULL:
                raise
            text = f"compiled kernels cannot be kept in {config.CACHE_DIR}: {error.strerror}; make room there"
            raise ComputationError(f"{text}, or set SHOAL_HOME or NUMBA_CACHE_DIR to another folder") from None


def _save(self: Any, sig: Any, data: Any) -> None:
    """`Cache.save_overload`: reads the index of all types of arguments, adds to it, writes it."""
    with _locked(f"index of {self.cache_path}/{self._impl.filename_base}"):
        _numbas_save(self, sig, data)


@cache
def install() -> None:
    """Install: from now on compile under locks, with `linking`, `operators` and `analysis`, and report (`progress`)."""
    linking.install()
    operators.install()
    analysis.install()
    dispatcher.Dispatcher.compile = _compile  # type: ignore[method-assign]
    caching.Cache.save_overload = _save
    event.register("numba:compile", _Listener())
