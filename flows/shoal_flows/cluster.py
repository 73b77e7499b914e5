"""Dask clusters for the computations, on this machine or elsewhere, by one setting.

SHOAL_CLUSTER: empty for worker processes without Dask; `local` or `local:N` for a Dask cluster of N processes on
this machine; the address of a scheduler, such as tcp://host:8786, for any other.
"""

from __future__ import annotations

import atexit
import os
from collections.abc import Callable
from functools import cache
from typing import Any
from weakref import WeakSet

from shoal.errors import ComputationError, InputError

PATIENCE = 30.0
PRELOAD = "shoal_flows.preload"
_pending: WeakSet[Any] = WeakSet()


def setting() -> str:
    """Return the requested cluster; empty for none."""
    return os.environ.get("SHOAL_CLUSTER", "").strip()


@cache
def client() -> Any:
    """The client of the cluster, which ends with this process. Raises InputError, ComputationError."""
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise InputError("SHOAL_CLUSTER: Dask is not installed; install shoal with its extra 'scale'") from None
    wanted = setting()
    address = _local(wanted) if wanted.split(":")[0] == "local" else wanted
    try:
        found = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).splitlines()[0]
        raise ComputationError(f"SHOAL_CLUSTER: no scheduler at {wanted}: {reason}") from None
    atexit.register(found.close)
    return found


def submit(function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """Run a function on the cluster; returns its future. Raises InputError, ComputationError."""
    # Not by its arguments: what is asked for again may be meant to be computed again.
    future = client().submit(function, *args, pure=False, **kwargs)
    _pending.add(future)
    return future


def abandon() -> None:
    """Cancel what was submitted and has not ended; whoever waits for it gets a CancelledError."""
    if pending := [future for future in _pending if not future.done()]:
        client().cancel(pending, force=True)


def cores() -> int:
    """Computations that the cluster runs at a time; at least one, as workers may still be on their way."""
    return max(1, int(sum(client().nthreads().values())))


def _local(wanted: str) -> Any:
    from distributed import LocalCluster

    number = wanted.partition(":")[2] or str(os.cpu_count() or 1)
    if not (number.isdigit() and int(number) > 0):
        raise InputError(f"SHOAL_CLUSTER: {wanted!r} is not local, local:N or the address of a scheduler")
    made = LocalCluster(n_workers=int(number), threads_per_worker=1, dashboard_address=None, preload=[PRELOAD])
    atexit.register(made.close)
    return made
