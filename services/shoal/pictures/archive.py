"""An identification as a file that a page can be made of later: everything, the data included."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from shoal.errors import InputError
from shoal.identification import Estimate, Problem
from shoal.pictures.answer import Answer
from shoal.scene.record import one_line

_ARRAY = "array"


class _Archived(BaseModel):
    """Content of `record` in the file."""

    model_config = ConfigDict(arbitrary_types_allowed=True, ser_json_inf_nan="strings")
    problem: Problem
    estimate: Estimate


def archived(answer: Answer) -> dict[str, Any]:
    """Return the object of `shoal identify --json`, and below `record` all that a page needs."""
    record = _Archived(problem=answer.problem, estimate=answer.estimate).model_dump_json(fallback=_listed)
    return {**answer.estimate.to_json(), "record": json.loads(record)}


def read(path: Path) -> Answer:
    """The answer in a file that `shoal identify --out FILE.json` wrote. Raises InputError."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    return parse(text, str(path))


def parse(text: str, source: str) -> Answer:
    """The answer in the text of such a file; source: its name for messages. Raises InputError."""
    try:
        data = json.loads(text, object_hook=_arrays)
    except ValueError:
        raise InputError(
            f"{source}: is not JSON; `shoal identify PROBLEM --out FILE.json` writes such a file"
        ) from None
    if not isinstance(data, Mapping) or "record" not in data:
        raise InputError(f"{source}: holds no identification; `shoal identify PROBLEM --out FILE.json` writes one")
    try:
        record = _Archived.model_validate(data["record"])
    except ValidationError as error:
        raise one_line(error, source) from None
    return Answer(record.problem, record.estimate)


def _listed(value: Any) -> Any:
    """Return values that pydantic does not know as JSON holds them."""
    if isinstance(value, np.ndarray):
        return {_ARRAY: value.tolist()}
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no place in a file")


def _arrays(data: dict[str, Any]) -> Any:
    """Lists that were arrays are arrays again."""
    return np.array(data[_ARRAY], dtype=float) if data.keys() == {_ARRAY} else data
