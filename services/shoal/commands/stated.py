"""A study that is kept as a file: `uncertain: {scene: ..., vary: ..., ...}`, with the options of the command as fields.

What stands on the command line comes before what stands in the file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from shoal.errors import InputError

KEY = "uncertain"
PAIRS = {"vary": ("~", "="), "set": ("=", "="), "correlate": ("=", "="), "cost": ("=", "=")}
"""Options that a mapping may state, and what stands between key and value: before a distribution, and else."""


def stated(context: click.Context, parameter: click.Parameter, scene: str) -> str:
    """The scene of a study that is kept as a file, whose other fields become the defaults of the options.

    What is no such file stays as it is. Raises InputError.
    """
    path = Path(scene)
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        return scene
    from shoal.scene.load import read_yaml

    data = read_yaml(path.read_text(encoding="utf-8"), scene)
    if not isinstance(data, dict) or KEY not in data:
        return scene
    fields, others = data[KEY], sorted(set(data) - {KEY, "name", "description"})
    if others or not isinstance(fields, dict) or not isinstance(fields.get("scene"), str):
        wrong = f"{others[0]} does not belong beside it" if others else "needs a mapping with the name of a scene"
        raise InputError(f"{scene}: {KEY}: {wrong}")
    options = {name.removeprefix("--"): one for one in context.command.params for name in one.opts if name[:2] == "--"}
    for unfit in ("json", "help"):
        options.pop(unfit, None)
    context.default_map = {}
    for field, value in fields.items():
        if field == "scene":
            continue
        if field not in options:
            raise InputError(f"{scene}: {KEY}: no field {field!r}; there are scene, {', '.join(sorted(options))}")
        context.default_map[str(options[field].name)] = _as_option(field, value, options[field])
    beside = path.parent / fields["scene"]
    return str(beside) if beside.is_file() else str(fields["scene"])


def _as_option(field: str, value: Any, option: click.Parameter) -> Any:
    """What would stand on the command line."""
    if field in PAIRS and isinstance(value, dict):
        before, between = PAIRS[field]
        return [f"{key}{before if '(' in str(one) else between}{one}" for key, one in value.items()]
    if option.multiple:
        return [str(one) for one in (value if isinstance(value, list) else [value])]
    if isinstance(value, list):
        return ",".join(map(str, value))
    return value if isinstance(value, bool) else str(value)
