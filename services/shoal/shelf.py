"""User library as a folder: a versioned file store by kind and name, whose entries are there as a whole or not at all.

KIND/NAME/VERSION/ holds the files of one version, NAME.yaml among them, and never changes; KIND/NAME/current says which
version the name stands for. What an entry means and whether it is right is no matter here; see `shoal.library`.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

from shoal.errors import InputError
from shoal.home import stated_home

Files = Mapping[str, bytes]
"""Contents by path, relative to the folder of an entry."""

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
VERSION = re.compile(r"[0-9a-f]{12}")
LARGEST = 50_000_000
"""Bytes of all files of an entry."""
_FILE = re.compile(r"\w[\w .,+()=-]{0,59}")
_DEEPEST, _MOST = 4, 100
_HELD, _CURRENT, _NEW, _DAY = "held", "current", ".new-", 86400.0
_IDENTITY = ".identity"


@dataclass(frozen=True)
class StoredVersion:
    """One version of a scene, a problem or another kind."""

    kind: str
    name: str
    version: str
    folder: Path

    @property
    def document(self) -> Path:
        """The YAML file that the name stands for."""
        return self.folder / f"{self.name}.yaml"

    def files(self) -> dict[str, bytes]:
        """Everything that was put. Raises InputError where it was changed by hand."""
        paths = [path for path in sorted(self.folder.rglob("*")) if path.is_file() and not path.is_symlink()]
        found = {path.relative_to(self.folder).as_posix(): path.read_bytes() for path in paths}
        if version_of(found) != self.version:
            raise InputError(f"{self.name}: {self.folder} was changed by hand; add the changed file instead")
        return found


@dataclass(frozen=True)
class Shelf:
    """The library in a folder, which need not be there as long as nothing is put."""

    root: Path

    def find(self, kind: str, reference: str) -> StoredVersion | None:
        """The entry of that NAME, or NAME@VERSION; None if there is none, or a link leads out of the library."""
        name, _, version = reference.partition("@")
        if not NAME.fullmatch(name) or ("@" in reference and not VERSION.fullmatch(version)):
            return None
        place = self.root / kind / name
        if not version:
            with suppress(OSError, UnicodeDecodeError):
                version = (place / _CURRENT).read_text(encoding="utf-8").strip()
        entry = StoredVersion(kind, name, version, place / version)
        there = VERSION.fullmatch(version) and entry.document.is_file() and self._inside(entry.document)
        return entry if there else None

    def entries(self, kind: str) -> list[StoredVersion]:
        """The current version of every name, sorted."""
        try:
            names = sorted(os.listdir(self.root / kind))
        except OSError:
            return []
        return [entry for name in names if (entry := self.find(kind, name)) is not None and "@" not in name]

    def versions(self, kind: str, name: str) -> list[str]:
        """Every version of a name, the oldest first."""
        place = self.root / kind / check_name(name)
        found = [path for path in place.glob("*") if VERSION.fullmatch(path.name)]
        return [path.name for path in sorted(found, key=lambda path: (path.stat().st_mtime_ns, path.name))]

    @property
    def changed(self) -> int:
        """When the library was last written to [ns]; 0 if never. Every change makes something in its folder first."""
        try:
            return self.root.stat().st_mtime_ns
        except OSError:
            return 0

    def size(self) -> int:
        """Bytes of all files."""
        sizes = 0
        for folder, _, names in os.walk(self.root):
            for name in names:
                with suppress(OSError):
                    sizes += os.lstat(os.path.join(folder, name)).st_size
        return sizes

    def put(self, kind: str, name: str, files: Files, check: Callable[[Path], None] = lambda _: None) -> StoredVersion:
        """Keep files under a name; versions that were there stay.

        check: is given the document before it is kept, and raises where it is wrong. Raises InputError.
        """
        place = self.root / kind / check_name(name)
        check_files(name, files)
        version = version_of(files)
        with self._staged(files) as fresh:
            check(fresh / f"{name}.yaml")
            with self._alone():
                self._move(fresh, place / version)
                _replace(place / _CURRENT, version.encode())
        return StoredVersion(kind, name, version, place / version)

    def remove(self, kind: str, name: str) -> None:
        """Forget a name with all its versions. Raises InputError."""
        if self.find(kind, check_name(name)) is None:
            raise InputError(f"{name}: no such entry among the {kind} of the library")
        with self._staged({}) as away, self._alone(), suppress(FileNotFoundError):
            os.rename(self.root / kind / name, away)

    def hold(self, name: str, files: Files) -> Path:
        """Keep copies of the entries that a study uses, which outlive these; return the document."""
        check_files(check_name(name), files)
        place = self.root / _HELD / version_of(files)
        if not (place / f"{name}.yaml").exists():
            with self._staged(files) as fresh, self._alone():
                self._move(fresh, place)
        return place / f"{name}.yaml"

    def is_held(self, document: Path) -> bool:
        """Return whether `hold` made this path."""
        return document.parent.parent == self.root / _HELD and document.is_file()

    def _inside(self, path: Path) -> bool:
        """Return whether no link below the library leads elsewhere."""
        try:
            return path.resolve() == self.root.resolve() / path.relative_to(self.root)
        except OSError:
            return False

    @contextmanager
    def _staged(self, files: Files) -> Iterator[Path]:
        """A folder with these files beside the library's, which is gone after the block unless it was moved."""
        with self._writable():
            self.root.mkdir(parents=True, exist_ok=True)
            self._clear()
            staged = tempfile.TemporaryDirectory(dir=self.root, prefix=_NEW, ignore_cleanup_errors=True)
        with staged as folder:
            fresh = Path(folder) / "entry"
            fresh.mkdir()
            for path, content in files.items():
                (fresh / path).parent.mkdir(parents=True, exist_ok=True)
                with (fresh / path).open("wb") as file:
                    file.write(content)
                    file.flush()
                    os.fsync(file.fileno())
            yield fresh

    def _move(self, fresh: Path, place: Path) -> None:
        """To where a version belongs; one that is there has the same content."""
        with self._writable():
            place.parent.mkdir(parents=True, exist_ok=True)
            if not self._inside(place.parent):
                raise InputError(f"{place.parent}: is a link; the library keeps its entries in its own folder")
            if not place.is_dir():
                os.rename(fresh, place)

    @contextmanager
    def _writable(self) -> Iterator[None]:
        try:
            yield
        except (PermissionError, FileExistsError, NotADirectoryError) as error:
            raise InputError(f"SHOAL_LIBRARY: cannot write to {self.root}: {error.strerror}") from None
        except OSError as error:
            if error.errno != errno.EROFS:
                raise
            raise InputError(f"SHOAL_LIBRARY: cannot write to {self.root}: {error.strerror}") from None

    def _clear(self) -> None:
        """Remove what processes left that were killed while they wrote."""
        now = self.root.stat().st_mtime
        for path in self.root.glob(f"{_NEW}*"):
            with suppress(OSError):
                if now - path.stat().st_mtime > _DAY:
                    shutil.rmtree(path)

    def identity(self, *, make: bool = False) -> str:
        """Return the identity of this library, the same by any path, or "" if it has none.

        Containers and machines reach one folder by different paths, and different folders by one path. make: give it
        one where there is none and it can be written to.
        """
        file = self.root / _IDENTITY
        with suppress(OSError, InputError, UnicodeDecodeError):
            if make and not file.exists():
                self.root.mkdir(parents=True, exist_ok=True)
                with self._alone():
                    if not file.exists():
                        _replace(file, uuid4().hex.encode())
            return file.read_text(encoding="utf-8").strip()
        return ""

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """No other process changes what names stand for within the block."""
        with self._writable():
            lock = (self.root / ".lock").open("w")
        with lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield


def shelf() -> Shelf:
    """The library: $SHOAL_LIBRARY, else `library` below Shoal's home. Nothing is made."""
    stated = os.environ.get("SHOAL_LIBRARY")
    return Shelf(Path(stated).expanduser().absolute() if stated else stated_home() / "library")


def located(kind: str, given: str) -> str:
    """The path of the document if this is the name of an entry (NAME or NAME@VERSION), else what was given."""
    entry = shelf().find(kind, given)
    return given if entry is None else str(entry.document)


def version_of(files: Files) -> str:
    """Short hash of paths and contents."""
    digest = hashlib.sha256()
    for path, content in sorted(files.items()):
        digest.update(f"{path}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:12]


def check_name(name: str) -> str:
    """The name, if an entry may have it. Raises InputError."""
    if not NAME.fullmatch(name):
        shown = repr(name if len(name) <= 80 else name[:77] + "...")
        raise InputError(f"name: {shown}: 1 to 64 letters, digits, - and _ make a name, a letter or digit first")
    return name


def check_files(name: str, files: Files) -> None:
    """Return whether files can be kept as an entry. Raises InputError."""
    if f"{name}.yaml" not in files:
        raise InputError(f"{name}: files: {name}.yaml is missing; there are {', '.join(sorted(files)[:5]) or 'none'}")
    try:
        check_paths(files)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    if (size := sum(map(len, files.values()))) > LARGEST:
        raise InputError(
            f"{name}: files: {size / 1e6:.0f} MB; an entry of the library has at most {LARGEST / 1e6:.0f} MB"
        )


def check_paths(files: Iterable[str]) -> None:
    """Return whether these can be the paths of an entry's files. Raises InputError."""
    paths = set(files)
    if len(paths) > _MOST:
        raise InputError(f"files: an entry has at most {_MOST}, found {len(paths)}")
    for path in sorted(paths):
        parts = path.split("/")
        if len(parts) > _DEEPEST or not all(_FILE.fullmatch(part) for part in parts):
            raise InputError(f"files: {path[:80]!r} is not a plain path below the entry's folder")
        if any("/".join(parts[:k]) in paths for k in range(1, len(parts))):
            raise InputError(f"files: {path!r} lies in what is a file itself")


def _replace(path: Path, content: bytes) -> None:
    """Write a file at once."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=_NEW)
    with os.fdopen(handle, "wb") as file:
        file.write(content)
    os.chmod(name, 0o644)
    os.replace(name, path)
