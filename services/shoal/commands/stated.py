"""A study that is kept as a file states the options of the command; see `shoal.response.stated`.

What stands on the command line comes before what stands in the file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from shoal.commands.options import Once
from shoal.errors import InputError
from shoal.shelf import shelf


def stated(context: click.Context, parameter: click.Parameter, given: str) -> str:
    """The scene of a study (a name, or a file), whose other fields become the defaults of the options.

    What is no study stays as it is. Raises InputError.
    """
    from shoal.response import stated as studies
    from shoal.scene.load import read_yaml

    path = Path(given)
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        if shelf().find("scenes", given) is not None:
            return given
        path = Path(studies.document_of(given))
        if str(path) == given:
            return given
    data = read_yaml(path.read_text(encoding="utf-8"), given)
    if not isinstance(data, dict) or studies.KEY not in data:
        return given
    fields = studies.fields(data, given)
    options = {name.removeprefix("--"): one for one in context.command.params for name in one.opts if name[:2] == "--"}
    for unfit in ("json", "help", "values"):
        options.pop(unfit, None)
    context.default_map = {}
    for field, value in fields.items():
        if field == "scene":
            continue
        if field not in options:
            listed = ", ".join(sorted(options))
            raise InputError(f"{given}: {studies.KEY}: no field {field!r}; there are scene, {listed}")
        context.default_map[str(options[field].name)] = _as_option(field, value, options[field])
    return studies.scene_of(fields["scene"], path)


def _as_option(field: str, value: Any, option: click.Parameter) -> Any:
    """Return a value as it would stand on the command line."""
    once = isinstance(option, Once)
    if option.multiple and not once:
        from shoal.response.stated import pairs

        return pairs(field, value)
    if isinstance(value, list):
        value = ",".join(map(str, value))
    text = value if isinstance(value, bool) else str(value)
    return [text] if once else text
