"""What a study was asked for, kept with its run, so that it can be repeated from there alone."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from pydantic_core import to_jsonable_python

CALL = "call.json"
INPUTS = "inputs"


def of_flow() -> dict[str, bytes] | None:
    """The artifacts that state the flow that runs, with the files it was given; None outside a flow."""
    from prefect.context import FlowRunContext

    context = FlowRunContext.get()
    if context is None or context.flow is None:
        return None
    parameters, files = dict(to_jsonable_python(context.parameters or {})), dict[str, bytes]()
    for name, value in parameters.items():
        if isinstance(value, str) and value and (path := Path(value)).is_file():
            for needed in (path, *_beside(path)):
                files[f"{INPUTS}/{name}/{needed.relative_to(path.parent).as_posix()}"] = needed.read_bytes()
            parameters[name] = f"{INPUTS}/{name}/{path.name}"
    call = {"flow": context.flow.name, "parameters": parameters}
    return {CALL: json.dumps(call, indent=1).encode(), **files}


def restored(folder: Path) -> tuple[str, dict[str, Any]]:
    """Flow and parameters from downloaded artifacts; files are those in the folder. Raises OSError, ValueError."""
    call = json.loads((folder / CALL).read_text(encoding="utf-8"))
    parameters = {
        name: str(folder / value) if isinstance(value, str) and value.startswith(f"{INPUTS}/") else value
        for name, value in call["parameters"].items()
    }
    return call["flow"], parameters


def _beside(path: Path) -> Iterator[Path]:
    """Files in the folder of a YAML document that it names."""
    if path.suffix not in (".yaml", ".yml"):
        return
    for word in _words(yaml.safe_load(path.read_text(encoding="utf-8"))):
        # A path that leads elsewhere is not taken along: the document then depends on this machine.
        if len(word) < 256 and not Path(word).is_absolute() and ".." not in word and (path.parent / word).is_file():
            yield path.parent / word


def _words(data: Any) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict | list):
        for part in data.values() if isinstance(data, dict) else data:
            yield from _words(part)
