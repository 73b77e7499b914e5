"""Take out of an environment what no service reads: headers, tests, and what libraries hold twice. For the image.

python deploy/slim.py SITE_PACKAGES
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

UNREAD = (
    "casadi/include",
    "pyarrow/include",
    "prefect/server/ui-v2",
    *(f"{name}/**/tests" for name in ("numba", "numpy", "pandas", "pyarrow", "scipy", "sklearn")),
)
"""Folders: what compilers and the authors of the packages need, and the set of Prefect's pages that is not served."""


def slim(packages: Path) -> int:
    """Returns the bytes that are gone."""
    before = _size(packages)
    for pattern in UNREAD:
        for folder in list(packages.glob(pattern)):
            shutil.rmtree(folder, ignore_errors=True)
    for archive in packages.glob("casadi/*.a"):
        archive.unlink()
    for same in _repeated(packages / "casadi"):
        first, *others = sorted(same, key=lambda path: (-len(path.name), path.name))
        for path in others:
            path.unlink()
            path.symlink_to(first.name)
    for library in packages.rglob("*.so*"):
        if library.is_file() and not library.is_symlink():
            _strip(library)
    return before - _size(packages)


def _strip(library: Path) -> None:
    """Takes the symbols that debuggers read; libraries that the makers of a wheel have renamed stay as they are."""
    if library.parent.suffix != ".libs":
        subprocess.run(["strip", "--strip-unneeded", str(library)], check=False, stderr=subprocess.DEVNULL)


def _repeated(folder: Path) -> Iterator[list[Path]]:
    """Shared libraries that a wheel, which knows no links, holds under several names."""
    found: dict[str, list[Path]] = {}
    for path in sorted(folder.glob("*.so*")):
        if not path.is_symlink():
            found.setdefault(sha256(path.read_bytes()).hexdigest(), []).append(path)
    yield from (same for same in found.values() if len(same) > 1)


def _size(folder: Path) -> int:
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file() or path.is_symlink())


if __name__ == "__main__":
    sys.stdout.write(f"{slim(Path(sys.argv[1])) / 1e6:.0f} MB less\n")
