"""The script inside an exported unit of FMI 3.0; all the rest is in the installation of Shoal that runs it."""

from __future__ import annotations

import sys
from typing import Any

from pythonfmu3 import Fmi3Slave

from shoal.fmu.unit3 import SceneUnit3

_HELD: list[Any] = []
"""As in `machine`: pythonfmu3 grew out of pythonfmu."""


class ExportedUnit3(SceneUnit3, Fmi3Slave):  # type: ignore[misc]
    """The scene among the resources. The builder looks for the second name."""

    def __init__(self, **told: Any) -> None:
        super().__init__(**told)
        _HELD.extend((sys.modules.get(__name__), globals()))
