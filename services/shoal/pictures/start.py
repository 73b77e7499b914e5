"""What the start of a run needs to have said about it, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def remarks(model: Mapping[str, Any]) -> list[str]:
    """Every stated value that was changed, by body, and joints whose forces are not unique."""
    found = [
        f"start of {body} changed: {quantity} {_written(one['used'])} {one['unit']}, stated {_written(one['stated'])}"
        for body, quantities in model.get("initial_changes", {}).items()
        for quantity, one in quantities.items()
    ]
    if joints := model.get("redundant_joints"):
        found.append(f"redundant joints: {', '.join(joints)}; the motion is unique, their forces are the least ones")
    return found


def _written(value: Any) -> str:
    numbers = [f"{number:z.10g}" for number in np.atleast_1d(value)]
    return numbers[0] if len(numbers) == 1 else f"[{', '.join(numbers)}]"
