"""The file that an identification wrote, read again by those who use its values or their spread."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from shoal.errors import InputError

LARGEST = 200_000_000
"""Bytes of such a file; a larger one is none."""


def read_estimate(path: Path, asked: str, part: str) -> dict[str, Any]:
    """What `shoal identify --json` or `--out FILE.json` wrote, with mappings `parameters`, `left_out` and a part of it.

    asked: what the file was named in, which begins every refusal. Raises InputError.
    """
    wanted = "give what `shoal identify --out FILE.json` wrote"
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
