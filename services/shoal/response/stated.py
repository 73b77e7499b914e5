"""A study that is kept as a file: `uncertain: {scene: ..., vary: ..., ...}`.

Its fields are the options of the command. Beside it stand at most its name and a description. A scene is a name, or a
file beside the document.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

from shoal.errors import InputError
from shoal.regular import require_regular
from shoal.requests.request import offered, read
from shoal.requests.uncertain import Uncertain
from shoal.scene.load import LARGEST, read_yaml, unknown
from shoal.shelf import located, shelf

KEY = "uncertain"
BESIDE = "name", "description"
OWN = ("out",)
"""Fields of a file that are the command line's alone."""
_LIBRARY = files("shoal.response") / "library"


def spelled(name: str) -> str:
    """Return the name of a field as a file writes it."""
    return name.replace("_", "-")


def fields(text: str, document: Path, name: str) -> dict[str, Any]:
    """Return the fields of a study by the names of its request; name: what it is called in messages.

    Raises InputError, also for what stands beside them.
    """
    data = read_yaml(text, name)
    if not isinstance(data, dict) or KEY not in data:
        raise InputError(f"{name}: is no study: it has no field `{KEY}`")
    found, others = data[KEY], sorted(set(data) - {KEY, *BESIDE})
    if others or not isinstance(found, dict) or not isinstance(found.get("scene"), str):
        wrong = f"{others[0]} does not belong beside it" if others else "needs a mapping with the name of a scene"
        raise InputError(f"{name}: {KEY}: {wrong}")
    names = {spelled(one): one for one in (*offered(Uncertain, "study"), *OWN) if one != "values"}
    if unknown := [one for one in found if one not in names]:
        raise InputError(f"{name}: {KEY}: no field {unknown[0]!r}; there are {', '.join(sorted(names))}")
    return {names[one]: value for one, value in found.items()} | {"scene": scene_of(found["scene"], document)}


def scene_of(stated: str, document: Path) -> str:
    """The path of a scene that lies beside the document, else what was stated."""
    beside = document.parent / stated
    return str(beside) if beside.is_file() else stated


def load_study(given: str) -> Uncertain:
    """A study by its name, built in or in the library, or from a file. Raises InputError."""
    document = Path(document_of(given))
    require_regular(document, "study")
    try:
        if document.stat().st_size > LARGEST:
            raise InputError(f"{given}: larger than the {LARGEST} bytes that are read")
        text = document.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        known = [*built_in_studies(), *(entry.name for entry in shelf().entries("studies"))]
        raise InputError(f"study: {unknown(given, 'study, nor file', known)}") from None
    stated = {name: value for name, value in fields(text, document, given).items() if name not in OWN}
    return read(Uncertain, stated, named=lambda name: f"{given}: {KEY}: {spelled(name)}", text=True)


def document_of(given: str) -> str:
    """The path of a study that is named, else what was given."""
    return str(_LIBRARY / f"{given}.yaml") if given in built_in_studies() else located("studies", given)


def built_in_studies() -> list[str]:
    """Their names."""
    return sorted(one.name.removesuffix(".yaml") for one in _LIBRARY.iterdir() if one.name.endswith(".yaml"))
