"""Request of a study, kept with its run, from which it can be repeated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic_core import to_jsonable_python
from shoal.shelf import shelf

CALL = "call.json"
INPUTS = "inputs"


def of_flow() -> dict[str, bytes] | None:
    """The artifacts that state the flow that runs, with what it holds on to (see `inputs`); None outside a flow."""
    from prefect.context import FlowRunContext

    context = FlowRunContext.get()
    if context is None or context.flow is None:
        return None
    parameters, files = dict(to_jsonable_python(context.parameters or {})), dict[str, bytes]()
    for name, value in parameters.items():
        if isinstance(value, str) and shelf().is_held(Path(value)):
            path = Path(value)
            for needed in sorted(one for one in path.parent.rglob("*") if one.is_file()):
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
        # A run of the release before states none in this way.
        if not (name == "tolerance" and value == 0)
    }
    return call["flow"], parameters
