"""The request for a scene as a file of another tool."""

from __future__ import annotations

from dataclasses import KW_ONLY
from pathlib import Path
from typing import Annotated, Literal

from pydantic.dataclasses import dataclass

from shoal.requests.fields import OfScene
from shoal.requests.option import Option
from shoal.requests.request import STRICT

_TO = "Tool: exudyn, a Python script that runs by itself, or mjcf, MuJoCo's format, of rigid bodies."
_FILE = "Written where it is stated, .py or .xml."
_VERIFY = "Run the scene there and here, and compare the motions."


@dataclass(frozen=True, config=STRICT)
class Export(OfScene):
    """Write a scene as a file of another tool."""

    to: Annotated[Literal["exudyn", "mjcf"], Option(_TO)]
    file: Annotated[str | Path | None, Option(_FILE, fronts=("python",))] = None
    _: KW_ONLY
    verify: Annotated[bool, Option(_VERIFY)] = True
