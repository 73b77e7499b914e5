"""Every engine by its name. The package fills the list; who refuses a scene reads in it who else could run it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from shoal.engines.contract import Engine

ENGINES: dict[str, Callable[[], Engine]] = {}
