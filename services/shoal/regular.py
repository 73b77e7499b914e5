"""Regular files: a pipe or a device that a user names as a file may never end, and waits outside every time limit."""

from __future__ import annotations

from pathlib import Path

from shoal.errors import InputError


def require_regular(path: Path, asked: str) -> None:
    """Raise InputError for a pipe, a socket or a device.

    asked: the field or option that names the path, which begins the message. What does not exist, or is a folder, is
    left to those who open it.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        kind = "a pipe" if path.is_fifo() else "a socket" if path.is_socket() else "a device"
        raise InputError(f"{asked}: {path} cannot be read: {kind}, which may never end; save it to a file first")
