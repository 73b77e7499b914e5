"""Entry point of a worker's process. It loads the library; the service, which imports this module too, never does."""

from __future__ import annotations

from typing import Any


def main(*arguments: Any) -> None:
    """See `process.main`."""
    from shoal.api import process

    process.main(*arguments)
