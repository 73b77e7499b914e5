"""The script inside an exported unit; all the rest is in the installation of Shoal that runs it."""

from __future__ import annotations

import sys
from typing import Any

from shoal.fmu.unit import SceneUnit

_HELD: list[Any] = []
"""pythonfmu's library (0.7) gives up references to this module that it does not own; a second instance would crash."""


class ExportedUnit(SceneUnit):
    """The scene among the resources."""

    def __init__(self, **told: Any) -> None:
        super().__init__(**told)
        _HELD.extend((sys.modules[__name__], globals()))
