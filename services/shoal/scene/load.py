"""Scenes by name, from the built-in library and from one's own, and from YAML files."""

from __future__ import annotations

import os
import pickle
from collections.abc import Hashable, Mapping
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import yaml

from shoal.arguments import brief
from shoal.errors import InputError
from shoal.scene.ended import with_end
from shoal.scene.measured import with_signals
from shoal.scene.parametric import EXAMPLES, parametric
from shoal.scene.paths import unwrapped
from shoal.scene.scene import Scene
from shoal.shelf import located, shelf

LARGEST = 2**20
"""Bytes of a file; a table of the most rows that a function of time may have takes half of it."""
_MOST = 100_000
"""Values in a file, each as often as an alias repeats it."""
_DEEPEST = 50
_LONGEST_NUMBER = 400
_LISTED = 40
"""Names in an error message."""


if yaml.__with_libyaml__:

    class _Loader(yaml.composer.Composer, yaml.CSafeLoader):
        """libyaml's parser, put together node by node: its own time grows with the square of the depth."""

        def __init__(self, text: str) -> None:
            yaml.composer.Composer.__init__(self)
            yaml.CSafeLoader.__init__(self, text)

else:
    _Loader = yaml.SafeLoader  # type: ignore[assignment, misc, unused-ignore]


class _StrictLoader(_Loader):
    """Plain data of bounded size; a key that stands twice is refused instead of silently lost.

    What aliases repeat is counted before it is made: a few lines of aliases of aliases are data without end.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth, self._count = 0, 0
        self._sizes: dict[int, int] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node:
        event: Any = self.peek_event()
        before = self._count
        self._depth += 1
        if self._depth > _DEEPEST:
            raise _refused(f"nested deeper than {_DEEPEST}", event.start_mark)
        node = super().compose_node(parent, index)
        assert node is not None
        self._depth -= 1
        if isinstance(event, yaml.AliasEvent):
            if id(node) not in self._sizes:
                raise _refused(f"*{event.anchor} stands within what it repeats", event.start_mark)
            self._count += self._sizes[id(node)]
        else:
            self._count += 1
            self._sizes[id(node)] = self._count - before
        if self._count > _MOST:
            raise _refused(f"more than {_MOST} values, with what aliases repeat", event.start_mark)
        return node

    def construct_scalar(self, node: Any) -> Any:
        if node.tag.endswith((":int", ":float")) and len(node.value) > _LONGEST_NUMBER:
            raise _refused(f"a number of {len(node.value)} characters", node.start_mark)
        return super().construct_scalar(node)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for name, _ in node.value:
            key = self.construct_object(name, deep=True)
            if isinstance(key, Hashable) and key in seen:
                raise _refused(f"the key {key!r} stands twice", node.start_mark)
            seen.add(key if isinstance(key, Hashable) else id(name))
        mapping: dict[Hashable, Any] = super().construct_mapping(node, deep)
        return mapping


def _refused(problem: str, mark: Any) -> yaml.constructor.ConstructorError:
    return yaml.constructor.ConstructorError(None, None, problem, mark)


def read_yaml(text: str, source: str) -> Any:
    """Parse YAML of bounded size. Raises InputError with the line."""
    if len(text) > LARGEST:
        raise _too_large(source)
    try:
        return yaml.load(text, _StrictLoader)  # noqa: S506 - a SafeLoader
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise InputError(f"{source}: line {line}: {error.problem or 'not YAML'}") from None
    except yaml.YAMLError as error:
        raise InputError(f"{source}: not YAML: {str(error).splitlines()[0]}") from None
    except ValueError as error:  # an impossible date
        raise InputError(f"{source}: not YAML: {error}") from None


def _too_large(source: str) -> InputError:
    return InputError(
        f"{source}: larger than the {LARGEST} bytes that are read; measured motion belongs into a recording"
    )


def read_named(name: str, folder: Traversable, what: str, known: list[str]) -> Any:
    """Data of a YAML file given by path, or of a built-in one given by name. Raises InputError.

    known: names that would have been right
    """
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        return read_yaml(_text(path), name)
    if name not in names(folder):
        if name == "-" or (os.path.exists(name) and not os.path.isdir(name)):
            raise InputError(f"{name}: a {what} is read from a file whose name ends in .yaml; save it as one")
        raise InputError(f"{unknown(name, what, known)}; give a .yaml file or one of {some(known)}")
    return read_yaml((folder / f"{name}.yaml").read_text(encoding="utf-8"), name)


def unknown(name: str, what: str, known: list[str]) -> str:
    """Return the message for an unknown name, with similar names."""
    name = name if len(name) <= 80 else name[:77] + "..."
    near = list(dict.fromkeys(get_close_matches(name, known, 3) + [one for one in known if name and name in one][:3]))
    return f"{name}: no such {what}" + (f" (did you mean {' or '.join(near)}?)" if near else "")


def some(known: list[str]) -> str:
    """Names in a line, not all where there are many."""
    return ", ".join(known[:_LISTED]) + (f" and {len(known) - _LISTED} more" if len(known) > _LISTED else "")


def _text(path: Path) -> str:
    """The text of a file that is not too large. Raises InputError."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(f"{path}: cannot be read: not a file")
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise _too_large(str(path))
        return content.decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise InputError(f"{path}: cannot be read: {reason}") from None


def names(folder: Traversable) -> list[str]:
    """Built-in names in a library folder, sorted."""
    return sorted(item.name.removesuffix(".yaml") for item in folder.iterdir() if item.name.endswith(".yaml"))


def scene_library() -> Traversable:
    """The folder of the built-in scenes."""
    return files("shoal.scene") / "library"


def scene_names() -> list[str]:
    """List the scenes that there are.

    Returns:
        The names of built-in scenes (of parametric ones the examples), then of the user library, each sorted.

    Examples:
        >>> "single-pendulum" in shoal.scene_names()
        True
    """
    return [*built_in_scenes(), *(entry.name for entry in shelf().entries("scenes"))]


def built_in_scenes() -> list[str]:
    """Names of the scenes that come with Shoal, sorted."""
    return sorted([*names(scene_library()), *EXAMPLES])


def as_scene(given: Scene | Mapping[str, Any] | str | Path) -> Scene:
    """A scene as it is, by its fields, or as `load_scene` takes it; files that fields name are found from here.

    Raises InputError.
    """
    if isinstance(given, Scene):
        return given
    if isinstance(given, Mapping):
        return _parsed(unwrapped(given), Path(), "scene")
    if not isinstance(given, str | Path):
        raise InputError(f"scene: needs a scene, its fields, a name or the path of a YAML file, found {brief(given)}")
    return load_scene(given)


def load_scene(name: str | Path) -> Scene:
    """Load a scene.

    Args:
        name: A built-in name, one of the user library (NAME@VERSION is an earlier version), or a YAML file.

    Returns:
        The scene; whoever edits it edits no other.

    Raises:
        InputError: There is no such scene, or a field of it is wrong.

    Examples:
        >>> list(shoal.load_scene("single-pendulum").markers)
        ['A']
    """
    name = str(name)
    if (data := parametric(name)) is not None:
        return Scene.parse(data, name)
    # Whoever edits the mappings of a scene edits his own; of all copies this one costs least.
    return pickle.loads(_built_in(name)) if name in built_in_scenes() else _read(located("scenes", name))


@cache
def _built_in(name: str) -> bytes:
    return pickle.dumps(_read(name))


def _read(name: str) -> Scene:
    data = read_named(name, scene_library(), "scene", scene_names())
    if not isinstance(data, dict):
        raise InputError(f"{name}: a scene is a mapping of fields, found {type(data).__name__}")
    return _parsed(data, Path(name).parent, name)


def _parsed(data: dict[str, Any], folder: Path, name: str) -> Scene:
    return Scene.parse(with_end(with_signals(data, folder, name), folder, name), name)
