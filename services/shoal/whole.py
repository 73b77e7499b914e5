"""Files that are there completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from shoal.errors import ComputationError


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A place to write to, beside `path`, which takes its name when the block ends well; else `path` stays as it was.

    Raises ComputationError where it cannot be written, as on a full disk.
    """
    target = path.resolve()
    part = target.with_name(f".{target.stem}-{os.getpid()}{target.suffix}")
    try:
        yield part
        os.replace(part, target)
    except OSError as error:
        raise ComputationError(f"out: {path} cannot be written: {error.strerror or error}") from None
    finally:
        part.unlink(missing_ok=True)
