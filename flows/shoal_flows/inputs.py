"""What a flow was given, held on to: a library that changes meanwhile changes neither the study nor its repetition."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from shoal import library
from shoal.errors import InputError
from shoal.scene.load import read_yaml
from shoal.shelf import NAME, located, shelf


def held(parameter: str, kind: str, given: str) -> str:
    """The path of a copy of a scene, a problem or a recording with all that it names; built-in names stay.

    parameter: of the flow that runs, whose run keeps the copy; given: a name, a path, or YAML of several lines.
    Raises InputError.
    """
    if not given or library.KINDS[kind].built_in(given):
        return given
    if "\n" in given:
        name, files = _of_text(parameter, kind, given)
    elif located(kind, given) == given and not Path(given).is_file():
        return given  # whoever uses it says that there is no such thing
    else:
        name = title(given)
        files = library.gathered(kind, given, name, whole=True)
    path = str(shelf().hold(name, files))
    _remember(parameter, path)
    return path


def title(given: str) -> str:
    """How a scene, a problem or a recording is called: by its name, or by that of its file."""
    stem = Path(given).name.partition("@")[0].removesuffix(".gz")
    stem = stem.rpartition(".")[0] or stem
    return stem if NAME.fullmatch(stem) else re.sub(r"[^A-Za-z0-9_-]+", "-", stem).strip("-_")[:64] or "given"


def headed(given: str) -> str:
    """The title of a parameter as it was given, YAML among them, before anybody has looked whether it is right."""
    return "own" if "\n" in given else title(given)


def _of_text(parameter: str, kind: str, text: str) -> tuple[str, Mapping[str, bytes]]:
    data: Any = read_yaml(text, parameter)
    name = title(str(data.get("name") or "own")) if isinstance(data, dict) else "own"
    with TemporaryDirectory() as folder:
        file = Path(folder) / f"{name}.yaml"
        file.write_text(text, encoding="utf-8")
        try:
            return name, library.gathered(kind, str(file), name, whole=True)
        except InputError as error:
            raise InputError(str(error).replace(str(file), parameter)) from None


def _remember(parameter: str, path: str) -> None:
    """As the value of the parameter that `tracking.origin` keeps."""
    from prefect.context import FlowRunContext

    context = FlowRunContext.get()
    if context is not None and context.parameters is not None:
        context.parameters[parameter] = path
