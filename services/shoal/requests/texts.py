"""Texts of values on the command line and in the files of studies. Raises ValueError."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from shoal.errors import InputError


def listed(given: Any) -> list[str]:
    """Return entries that may be one text, or several."""
    return [str(one) for one in given] if isinstance(given, list | tuple) else [str(given)]


def pairs(form: str) -> Callable[[Any], dict[str, str]]:
    """Read entries such as PATH=VALUE, `form`, as a mapping; of a key that stands twice no value is lost in silence."""

    def read(given: Any) -> dict[str, str]:
        found: dict[str, str] = {}
        for pair in listed(given):
            key, equals, value = pair.partition("=")
            if not (key and equals and value):
                reason = "; there is nothing after the =" if key and equals else ""
                raise ValueError(f"{pair!r} is not {form}{reason}")
            if (key := key.strip()) in found:
                raise ValueError(f"{key} is given twice, as {found[key]} and as {value.strip()}")
            found[key] = value.strip()
        return found

    return read


def fields(given: Any) -> Mapping[str, Any]:
    """Read PATH=VALUE entries; a value in brackets or braces is YAML, `null` is nothing."""
    if isinstance(given, Mapping):
        return given
    return {path: _structured(path, text) for path, text in pairs("PATH=VALUE")(given).items()}


def _structured(path: str, text: str) -> Any:
    if text == "null":
        return None
    if text[0] not in "[{":
        return _start(text) if path in ("initial.from", "initial_from") else text
    from shoal.scene.load import read_yaml

    try:
        return read_yaml(text, path)
    except InputError:
        raise ValueError(
            f"{path}: {text!r} is neither a list such as [0, -9.81] nor a mapping such as {{angle: 0.6}}"
        ) from None


def _start(text: str) -> Any:
    """Return a way to start, or what the file of a run says of its end."""
    from shoal.scene.ended import read_end

    return text if text == "statics" else read_end(Path(text))


def numbers(given: Any) -> Any:
    """Read T,T,... as a list of numbers."""
    parts: Iterable[Any] = given.split(",") if isinstance(given, str) else given
    try:
        return [float(part) for part in parts] if isinstance(parts, list | tuple) else [float(given)]
    except (TypeError, ValueError):
        raise ValueError(f"{given!r} is no list of numbers, such as 0.1,0.2,0.5") from None
