"""Data that other engines compute: the same program computes the same scene once, and finds it in its state then."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from shoal.errors import InputError
from shoal.home import home
from shoal.scene import Scene
from shoal.trajectory import Array
from shoal.versions import versions

KEPT = ("exudyn", "exudyn-ge", "casadi")
"""Engines that take seconds, of a package whose version tells what they do."""


def kept(engine: str, scene: Scene, times: Array, what: object, compute: Callable[[], Array]) -> Array:
    """The numbers that `compute` gives, or gave when it was last asked for the same.

    what: of the motion of the scene by this engine at these times [s], a value that is written as what it is. A folder
    that cannot be written to, and a file that is damaged, are as good as none.
    """
    if engine not in KEPT:
        return compute()
    asked = engine, scene.model_dump_json(), times.tobytes(), what, _program()
    name = hashlib.sha256(repr(asked).encode()).hexdigest()[:32]
    with suppress(OSError, ValueError, EOFError, InputError):
        return np.asarray(np.load(home() / "data" / f"{name}.npy"))
    found = compute()
    with suppress(OSError, InputError):
        _write(home() / "data" / f"{name}.npy", found)
    return found


def _program() -> tuple[object, ...]:
    """All else that the numbers depend on: packages, and the sources of this one."""
    root = Path(__file__).parents[2]
    files = sorted((str(file), file.stat()) for file in root.rglob("*.py"))
    sources = tuple((name, about.st_size, about.st_mtime_ns) for name, about in files)
    return sources, versions(("numpy", "exudyn", "casadi"))


def _write(file: Path, numbers: Array) -> None:
    """Whole or not at all, whoever else writes it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=file.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as stream:
            np.save(stream, numbers)
        Path(name).replace(file)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
