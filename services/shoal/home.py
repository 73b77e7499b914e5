"""Folders of Shoal's state: the home (library, runs, results, logs) and the cache of compiled kernels."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
from pathlib import Path
from typing import Literal

from shoal.errors import InputError

_PACKAGE = Path(__file__).parent
_KERNELS = "kernels"


def home() -> Path:
    """Return the folder of all state, made on demand; see `stated_home`. Raises InputError."""
    folder = stated_home()
    if not _writable(folder):
        raise InputError(f"SHOAL_HOME: cannot write to {folder}; set SHOAL_HOME to a folder that you may write to")
    return folder


def stated_home() -> Path:
    """Return the same folder, whether or not it exists: $SHOAL_HOME, else `.shoal` of the checkout, else the user's.

    It never depends on the current directory: a library or a run must be found from every folder. A checkout is
    recognised by where this package lies (an editable installation), so that the program `.venv/bin/shoal`, the make
    targets and the tests of one checkout share one home and compile their kernels once.
    """
    return _stated() or _of_checkout() or _of_user("data")


def origin() -> str:
    """Return which rule of `stated_home` chose the folder, in words."""
    if _stated():
        return "$SHOAL_HOME"
    return "of this checkout" if _of_checkout() else "of this user"


def unused_home() -> str:
    """Return a line that names a `.shoal` in the current directory with a library or runs that is not the home, or "".

    Until November 2026 the home was `.shoal` of the current directory; what was kept there must not be lost silently.
    """
    folder, used = Path(".shoal").absolute(), stated_home()
    kept = [what for name, what in _WORTH_KEEPING.items() if _holds(folder / name)]
    if _stated() or not kept or folder.resolve() == used.resolve():
        return ""
    return (
        f"{folder} holds {' and '.join(kept)} that this command does not use: its home is {used}; move the content "
        f"there, or set SHOAL_HOME={folder}"
    )


_WORTH_KEEPING = {"library": "a library", "mlflow.db": "runs"}


def _holds(path: Path) -> bool:
    """Return whether there is a file, or a folder that is not empty."""
    try:
        return path.is_file() or any(path.iterdir())
    except OSError:
        return False


def _stated() -> Path | None:
    text = os.environ.get("SHOAL_HOME")
    return Path(text).expanduser().absolute() if text else None


def _of_checkout() -> Path | None:
    """`.shoal` of the checkout that this package is imported from; None for an installed copy, or a read-only one."""
    root = _PACKAGE.parents[1]
    editable = _PACKAGE.parent.name == "services" and (root / "pyproject.toml").is_file()
    return root / ".shoal" if editable and os.access(root, os.W_OK) else None


def _of_user(kind: Literal["data", "cache"]) -> Path:
    from platformdirs import user_cache_path, user_data_path

    return (user_data_path if kind == "data" else user_cache_path)("shoal", appauthor=False)


def kernel_cache() -> Path:
    """Return the folder of the compiled kernels, made on demand: in the home, or in the user's cache directory.

    What is kept there is found by its content (`shoal.compile.content`), so versions may share it. Where nothing can be
    written, a private folder among the temporary files takes its place.
    """
    folder = (_stated() or _of_checkout() or _of_user("cache")) / _KERNELS
    return folder if _writable(folder) else _private_temporary(_KERNELS)


def compiled() -> bool:
    """Return whether there are compiled kernels; without, the first run takes a minute."""
    return any(Path(os.environ.get("NUMBA_CACHE_DIR") or kernel_cache()).rglob("*.nbi"))


def prepare_kernel_cache() -> None:
    """Point Numba at `kernel_cache()` unless the user chose a folder. Call before importing kernels."""
    if not os.environ.get("NUMBA_CACHE_DIR"):
        os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())
    if "numba" in sys.modules:  # which has read its settings
        sys.modules["numba"].config.reload_config()


def processor() -> str:
    """Name of the processor, on which machine code and times depend."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, "") or platform.processor() or platform.machine()


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _private_temporary(name: str) -> Path:
    """A folder that only this user can fill: Numba loads what it finds there as code."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"shoal-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        if folder.is_symlink() or (hasattr(os, "getuid") and status.st_uid != user) or status.st_mode & 0o022:
            raise PermissionError
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="shoal-"))
    cache = folder / name
    cache.mkdir(exist_ok=True)
    return cache
