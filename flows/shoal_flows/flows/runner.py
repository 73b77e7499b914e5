"""How many tasks of a flow run at a time: as many as there are worker processes."""

from __future__ import annotations

from typing import Any

from prefect.task_runners import ThreadPoolTaskRunner

from shoal_flows import workers


def side_by_side() -> Any:
    """Threads that wait for the worker processes."""
    return ThreadPoolTaskRunner(max_workers=workers.count())
