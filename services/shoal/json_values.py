"""Values as JSON can hold them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np


def plain(values: Any) -> Any:
    """Numbers as JSON can hold them: lists and floats, null for what is not finite."""
    if isinstance(values, Mapping):
        return {key: plain(value) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [plain(value) for value in values]
    if isinstance(values, np.ndarray):
        return plain(values.tolist())
    if isinstance(values, np.generic):
        return plain(values.item())
    if isinstance(values, float):
        return values if np.isfinite(values) else None
    return values


def json_text(data: Any, *, indent: int | None = None) -> str:
    """One JSON value; numbers as `plain` makes them."""
    return json.dumps(plain(data), allow_nan=False, indent=indent)
