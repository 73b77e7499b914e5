"""Scenes from the built-in library and from YAML files."""

from __future__ import annotations

from collections.abc import Hashable
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import yaml

from shoal.errors import InputError
from shoal.scene.parametric import EXAMPLES, parametric
from shoal.scene.scene import Scene


class _StrictLoader(yaml.SafeLoader):
    """Plain data only; a key that stands twice is refused instead of silently lost."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.constructor.ConstructorError(None, None, f"the key {key!r} stands twice", node.start_mark)
        return super().construct_mapping(node, deep)


def read_yaml(text: str, source: str) -> Any:
    """Parse YAML. Raises InputError with the line."""
    try:
        return yaml.load(text, _StrictLoader)  # noqa: S506 - a SafeLoader
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise InputError(f"{source}: line {line}: {error.problem or 'not YAML'}") from None
    except yaml.YAMLError as error:
        raise InputError(f"{source}: not YAML: {str(error).splitlines()[0]}") from None
    except (ValueError, RecursionError) as error:  # an impossible date; brackets nested without end
        raise InputError(f"{source}: not YAML: {error}") from None


def read_named(name: str, folder: Traversable, what: str) -> Any:
    """Data of a YAML file given by path, or of a built-in one given by name. Raises InputError."""
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        try:
            return read_yaml(path.read_text(encoding="utf-8"), name)
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
            raise InputError(f"{name}: cannot be read: {reason}") from None
    if name not in names(folder):
        known = ", ".join(names(folder))
        raise InputError(f"{name}: no such {what}; give a .yaml file or one of {known}")
    return read_yaml((folder / f"{name}.yaml").read_text(encoding="utf-8"), name)


def names(folder: Traversable) -> list[str]:
    """Built-in names in a library folder, sorted."""
    return sorted(item.name.removesuffix(".yaml") for item in folder.iterdir() if item.name.endswith(".yaml"))


def scene_library() -> Traversable:
    """The folder of the built-in scenes."""
    return files("shoal.scene") / "library"


def scene_names() -> list[str]:
    """Names of the built-in scenes, sorted; of parametric ones the examples."""
    return sorted([*names(scene_library()), *EXAMPLES])


def load_scene(name: str) -> Scene:
    """The built-in scene of that name, or the scene in that YAML file as it is now. Raises InputError."""
    if (data := parametric(name)) is not None:
        return Scene.parse(data, name)
    return _built_in(name) if name in scene_names() else _read(name)


@cache
def _built_in(name: str) -> Scene:
    return _read(name)


def _read(name: str) -> Scene:
    data = read_named(name, scene_library(), "scene")
    if not isinstance(data, dict):
        raise InputError(f"{name}: a scene is a mapping of fields, found {type(data).__name__}")
    return Scene.parse(data, name)
