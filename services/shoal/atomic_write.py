"""Files that are there completely or not at all, and names that they may have."""

from __future__ import annotations

import os
import re
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from shoal.errors import ComputationError

LONGEST = 50
"""Characters of a name that is made: with an ending, in any alphabet, a file system takes them (255 bytes)."""


def file_name(name: str) -> str:
    """Return the name of a scene as that of a file in any folder, without an ending: no separators, not hidden."""
    return re.sub(r"[^\w.-]+", "-", name).strip(".-")[:LONGEST] or "scene"


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """A place to write to, beside `path`, which takes its name when the block ends well; else `path` stays as it was.

    A pipe or a device stays what it is and is written into. Raises ComputationError where it cannot be written, as on a
    full disk.
    """
    try:
        if _stream(path):
            with TemporaryDirectory() as folder:
                part = Path(folder) / f"part{path.suffix}"
                yield part
                with part.open("rb") as content, path.open("wb") as stream:
                    shutil.copyfileobj(content, stream)
            return
        target = path.resolve()
        part = target.with_name(f".{target.stem[:LONGEST]}-{os.getpid()}{target.suffix}")
        try:
            yield part
            os.replace(part, target)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise ComputationError(f"out: {path} cannot be written: {error.strerror or error}") from None


def _stream(path: Path) -> bool:
    """Return whether that is neither a file nor a folder. Raises OSError for what can be none of them."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))
