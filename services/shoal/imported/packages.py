"""Files that robot files name: packages of ROS, and macros of xacro written out."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree

from shoal.errors import InputError

_UNSTATED = "Undefined substitution argument "
_PREFIXES = ("package://", "model://")


def find_package(name: str, file: Path) -> Path | None:
    """Return the folder of a package of ROS: the first of those that stand above or beside a file, or in its variables.

    Above: a folder of that name, or whose package.xml states it. Beside: a folder of that name in one above. Then the
    folders of ROS_PACKAGE_PATH, and `share` in those of AMENT_PREFIX_PATH.
    """
    for folder in file.resolve().parents:
        if name in (folder.name, _stated_name(folder)):
            return folder
        if (folder / name).is_dir():
            return folder / name
    return next((folder for folder in _of_variables(name) if folder.is_dir()), None)


def resolve(written: str, file: Path) -> Path | None:
    """Return the file that a name in a robot file stands for, if it exists: of a package, or beside the robot file."""
    if prefix := next((one for one in _PREFIXES if written.startswith(one)), None):
        package, _, rest = written.removeprefix(prefix).partition("/")
        folder = find_package(package, file)
        found = folder / rest if folder else None
    else:
        found = file.parent / written.removeprefix("file://")
    return found if found and found.is_file() else None


def expand(file: Path, arguments: Mapping[str, str]) -> bytes:
    """Return a file with its macros of xacro written out. arguments: those of `<xacro:arg>`. Raises InputError."""
    try:
        import xacro
        from xacro import substitution_args
    except ModuleNotFoundError:
        raise InputError(
            f"{file}: has macros of xacro; install shoal[xacro], or write it out by another tool"
        ) from None

    def found(package: str) -> str:
        folder = find_package(package, file)
        if folder is None:
            raise InputError(f"$(find {package}): no such package above or beside the file, or in ROS_PACKAGE_PATH")
        return str(folder)

    before = substitution_args._eval_find
    substitution_args._eval_find = substitution_args._eval_dict["find"] = found
    try:
        return bytes(xacro.process_file(str(file), mappings=dict(arguments)).toprettyxml(encoding="utf-8"))
    except Exception as error:  # of expressions of the file, thus of any kind
        said = " ".join(str(error).split()) or type(error).__name__
        name = said.removeprefix(_UNSTATED)
        hint = f"; state it by --argument {name}=VALUE" if name != said else ""
        raise InputError(f"{file}: xacro: {said[:300]}{hint}") from None
    finally:
        substitution_args._eval_find = substitution_args._eval_dict["find"] = before


def _stated_name(folder: Path) -> str | None:
    """Return the name of the package whose description is in a folder."""
    try:
        return ElementTree.parse(folder / "package.xml").findtext("name")
    except (OSError, ElementTree.ParseError):
        return None


def _of_variables(name: str) -> Iterator[Path]:
    for folder in filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)):
        yield Path(folder) if Path(folder).name == name else Path(folder) / name
    for folder in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        yield Path(folder) / "share" / name
