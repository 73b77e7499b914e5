"""`shoal upload`: send MLflow the runs that it lacks."""

from __future__ import annotations

from shoal_flows import settings
from shoal_flows.tracking import outbox


def upload() -> int:
    """Send everything that waits; returns how many runs. Raises ComputationError if MLflow does not answer."""
    settings.apply()
    if not outbox.pending():
        return 0
    from shoal_flows.tracking import store

    return store.upload()
