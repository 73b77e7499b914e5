"""Results as JSON text: NumPy's numbers as plain ones, null for what is not finite."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from shoal.trajectory import plain


def as_json_text(data: Any, *, indent: int | None = None) -> str:
    """One JSON value."""
    return json.dumps(plain(data), allow_nan=False, indent=indent, default=_scalar)


def _scalar(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no JSON form")
