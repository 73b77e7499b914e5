"""A YAML text with a few of its values replaced, and every other character as its author wrote it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

Keys = tuple[str, ...]
"""The keys that lead to a value, from the outermost mapping on."""

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def edited(text: str, changes: Mapping[Keys, str]) -> str:
    """Return a YAML text with other values at some places, and the rest as it is.

    text: accepted by `load.read_yaml`, which bounds its size and depth. Where a value has no place of its own in the
    text, as an alias, the whole is written again.
    """
    root, wanted, found = yaml.compose(text, _Loader), _data(text), text
    places = [(_node(root, keys), word) for keys, word in changes.items()]
    for node, word in sorted(places, key=lambda place: -place[0].start_mark.index):
        found = f"{found[: node.start_mark.index]}{_scalar(word)}{found[node.end_mark.index :]}"
    for keys, word in changes.items():
        holder = wanted
        for key in keys[:-1]:
            holder = holder[key]
        holder[keys[-1]] = word
    try:
        same = _data(found) == wanted
    except yaml.YAMLError:
        same = False
    return found if same else as_yaml(wanted)


def as_yaml(data: Any) -> str:
    """Plain data as YAML, in its order."""
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, allow_unicode=True, width=120)


def _data(text: str) -> Any:
    return yaml.load(text, _Loader)  # noqa: S506 - a SafeLoader


def _node(node: Any, keys: Keys) -> Any:
    for key in keys:
        node = next(value for name, value in node.value if name.value == key)
    return node


def _scalar(word: str) -> str:
    """Return a scalar as it may stand anywhere, also between brackets."""
    plain = word.translate({ord(mark): None for mark in "/._-"})
    return word if plain.isalnum() and plain.isascii() else "'" + word.replace("'", "''") + "'"
