"""Remarks on the start of a run, and reasons of failed points of a sweep, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.pictures.event_text import told

if TYPE_CHECKING:
    from shoal.engines.sweep import Sweep

REASONS = 4
"""So many reasons of points that failed are told."""


def remarks(model: Mapping[str, Any], ok: bool = True) -> list[str]:
    """Return sentences on changed values, redundant joints, drives whose rate jumps, and events of contacts.

    ok: whether the run is believed.
    """
    found = [
        f"start of {body} changed: {quantity} {_written(one['used'])} {one['unit']}, stated {_written(one['stated'])}"
        for body, quantities in model.get("initial_changes", {}).items()
        for quantity, one in quantities.items()
    ]
    if joints := model.get("redundant_joints"):
        unique = "; the motion is unique, their forces are the least ones" if ok else ""
        found.append(f"redundant joints: {', '.join(joints)}{unique}")
    return [*found, *model.get("held_drives", ()), *told(model)]


def reasons(sweep: Sweep) -> list[str]:
    """Return the reasons of failed points of a sweep, with their numbers, the most frequent first."""
    counted = Counter(filter(None, sweep.reasons)).most_common()
    found = [f"{number} point{'s' * (number > 1)}: {reason}" for reason, number in counted[:REASONS]]
    return found + ([f"{len(counted) - REASONS} more reasons"] if len(counted) > REASONS else [])


def _written(value: Any) -> str:
    numbers = [f"{number:z.10g}" for number in np.atleast_1d(value)]
    return numbers[0] if len(numbers) == 1 else f"[{', '.join(numbers)}]"
