"""References of flexible scenes, computed once by another engine; `python -m shoal_validation.problems` does so anew.

A file holds what the converged Bernoulli-Euler beam does, as far as the engine named in it can tell.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.resources import files

import numpy as np
from shoal.trajectory import Array

from shoal_validation.problems.contract import Reference


def stored(name: str) -> Callable[[Array], Reference]:
    """The reference in `computed/NAME.json`, whose times have to contain those of the problem."""

    def settle(times: Array) -> Reference:
        text = (files("shoal_validation.problems") / "computed" / f"{name}.json").read_text(encoding="utf-8")
        data = json.loads(text)
        index = [int(np.argmin(np.abs(np.array(data["times"]) - t))) for t in times]
        if not np.allclose(np.array(data["times"])[index], times, rtol=0, atol=1e-12):
            raise ValueError(f"computed/{name}.json lacks some of the times {times}")
        return Reference(np.array(data["points"])[index], data["source"], data["error"])

    return settle
