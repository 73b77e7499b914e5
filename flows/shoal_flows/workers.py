"""Worker processes for the computations: optimisations run in parallel, independent of the interpreter's lock."""

from __future__ import annotations

import atexit
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import active_children, get_all_start_methods, get_context
from threading import Event
from typing import ParamSpec, Protocol, TypeVar

from shoal.children import end_with_parent
from shoal.errors import check_trusted

from shoal_flows import cluster

P = ParamSpec("P")
T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
_abandoned = Event()


def count() -> int:
    """Computations that run at a time."""
    if cluster.setting():
        return cluster.cores()
    return max(1, os.cpu_count() or 1)


class Pending(Protocol[T_co]):
    """A computation that was asked for."""

    def result(self) -> T_co:
        """Return the result; an exception of the function is raised here."""
        ...


def submit(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Pending[T]:
    """Run a module-level function in a worker process, here or on a cluster; arguments and result are pickled.

    Raises ComputationError after `abandon`.
    """
    check_trusted(not _abandoned.is_set(), "stopped before this computation began")
    if cluster.setting():
        found: Pending[T] = cluster.submit(function, *args, **kwargs)
        return found
    return _pool().submit(function, *args, **kwargs)


def run(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """The result of `submit`; an exception of the function is raised here."""
    return submit(function, *args, **kwargs).result()


def abandon() -> None:
    """Stop all computations: end the processes of this machine, cancel what a cluster has, and begin none any more.

    Whoever waits for a result gets an exception.
    """
    _abandoned.set()
    cluster.abandon()
    if _pool.cache_info().currsize:
        _pool.cache_clear()
        for process in active_children():
            process.kill()


def warm_up() -> Pending[int]:
    """Start the processes; they load and compile while the caller does something else. The result waits for that."""
    _abandoned.clear()
    return submit(_loaded)


def _loaded() -> int:
    """Return the number of this process once it has everything. Raises what its preparation failed with."""
    from shoal_flows.preload import failure

    if failure is not None:
        raise failure
    return os.getpid()


@cache
def _pool() -> ProcessPoolExecutor:
    # A server process that imports once and forks workers is the quickest that is safe with threads around.
    method = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"
    context = get_context(method)
    if method == "forkserver":
        context.set_forkserver_preload(["shoal_flows.preload"])
    pool = ProcessPoolExecutor(count(), mp_context=context, initializer=end_with_parent)
    atexit.register(pool.shutdown, wait=False, cancel_futures=True)
    return pool
