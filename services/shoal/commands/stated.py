"""A study that is kept as a file states the options of its command; see `shoal.response.stated`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shoal.shelf import shelf


def stated(given: str) -> dict[str, Any]:
    """Return the fields of a study (a name, or a file) by name; none of what is no study. Raises InputError."""
    from shoal.response import stated as studies
    from shoal.scene.load import read_yaml

    path = Path(given)
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        if shelf().find("scenes", given) is not None or studies.document_of(given) == given:
            return {}
        path = Path(studies.document_of(given))
    text = path.read_text(encoding="utf-8")
    data = read_yaml(text, given)
    return studies.fields(text, path, given) if isinstance(data, dict) and studies.KEY in data else {}
