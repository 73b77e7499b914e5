"""What rounding leaves of the numbers of a file."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

ROUNDED = 1e-5
"""Of an angle [rad] or a length [m] as a file's rounding may leave it: 3.1416 is 7e-6 off half a turn."""


def numbers(values: Any) -> list[float]:
    """Numbers of any unit in a flat list, without the last digits of rounding."""
    return [float(f"{x:.15g}") if abs(x) > 1e-15 else 0.0 for x in np.ravel(values)]
