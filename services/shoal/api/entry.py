"""Where a worker's process begins. It loads what computes; the service, which imports this too, never does."""

from __future__ import annotations

from typing import Any


def main(*arguments: Any) -> None:
    """See `process.main`."""
    from shoal.api import process

    process.main(*arguments)
