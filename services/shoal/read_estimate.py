"""The file that an identification wrote, read again by those who use its values or their spread."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.regular import require_regular

LARGEST = 200_000_000
"""Bytes of such a file; a larger one is none."""


def read_estimate(path: Path, asked: str, part: str) -> dict[str, Any]:
    """Read an estimate of `shoal identify --json` or `--out FILE.json`: `parameters`, `left_out` and a part of it.

    asked: the option or field that named the file, which begins every error. Raises InputError.
    """
    wanted = "give what `shoal identify --out FILE.json` wrote"
    require_regular(path, asked)
    try:
        if path.stat().st_size > LARGEST:
            raise InputError(f"{asked}: {path} is no estimate: it is too large")
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{asked}: {path} cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError):
        raise InputError(f"{asked}: {path} is no JSON; {wanted}") from None
    if not isinstance(data, dict) or not isinstance(data.get("parameters"), dict) or "verdict" not in data:
        raise InputError(f"{asked}: {path} is no estimate; {wanted}")
    if not isinstance(data.get(part), dict) or not isinstance(data.get("left_out"), dict):
        raise InputError(f"{asked}: {path} holds no `{part}`, an older version wrote it; identify once more")
    return data


def checked_joint(told: Mapping[str, Any], asked: str, source: Path | str) -> dict[str, Any]:
    """The part `joint` of an estimate, or of its draws, with its numbers as numbers and the covariance as an array.

    asked, source: what the file was named in, and the file, which begin every refusal. Raises InputError.
    """
    try:
        known: dict[str, dict[str, Any]] = {
            str(name): {
                "path": None if one["path"] is None else str(one["path"]),
                "value": float(one["value"]),
                "logarithmic": bool(one["logarithmic"]),
                "known": bool(one["known"]),
            }
            for name, one in told["parameters"].items()
        }
        covariance = np.array(told["covariance"], dtype=float).reshape(len(known), len(known))
        if not np.isfinite(covariance).all() or not np.isfinite([one["value"] for one in known.values()]).all():
            raise ValueError
        ties = {str(at): str(text) for at, text in told["ties"].items()}
        constants = {str(name): float(x) for name, x in told["constants"].items()}
    except (KeyError, TypeError, ValueError, AttributeError):
        raise InputError(f"{asked}: {source}: its `joint` does not hold finite values and their covariance") from None
    return {"parameters": known, "covariance": covariance, "ties": ties, "constants": constants}
