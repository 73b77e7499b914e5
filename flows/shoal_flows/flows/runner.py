"""Concurrency of the tasks of a flow: the number of worker processes, or enough to keep a cluster busy."""

from __future__ import annotations

from typing import Any

from prefect.task_runners import ThreadPoolTaskRunner

from shoal_flows import cluster, workers

_ON_CLUSTER = 64
"""Threads that do nothing but wait for a cluster, whose size is not known before it is asked."""


def side_by_side() -> Any:
    """Threads that wait for the worker processes."""
    return ThreadPoolTaskRunner(max_workers=_ON_CLUSTER if cluster.setting() else workers.count())
