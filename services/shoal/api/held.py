"""The installation's own library behind the service: lists, gives, takes and forgets entries."""

from __future__ import annotations

import base64
import binascii

from shoal import library as own
from shoal.api.limits import TooMuch
from shoal.api.schemas import LibraryTask
from shoal.api.tasks import Bench, Note, to_json
from shoal.errors import InputError
from shoal.identification.problem import built_in_problems
from shoal.scene.load import built_in_scenes
from shoal.shelf import StoredVersion, shelf


class NoSuch(InputError):  # noqa: N818 - a refusal, not a failure
    """There is no entry of that name."""


def library(bench: Bench, asked: LibraryTask, note: Note) -> bytes:
    """Perform a task on the library and return its entries. Raises InputError, NoSuch, TooMuch."""
    if asked.operation == "list":
        entries = [own.about(entry) for entry in own.entries()]
        names = {"scenes": built_in_scenes(), "problems": built_in_problems()}
        return to_json({"identity": shelf().identity(), **names, "entries": entries})
    kind = own.kind_of(asked.kind).folder
    if asked.operation == "put":
        return to_json(own.about(_put(kind, asked, 1_000_000 * bench.settings.library_mb)))
    found = shelf().find(kind, asked.name)
    if found is None:
        raise NoSuch(f"name: no entry {asked.name!r} among the {kind} of the library")
    if asked.operation == "delete":
        shelf().remove(kind, found.name)
        return b""
    files = {path: base64.b64encode(content).decode() for path, content in found.files().items()}
    return to_json({**own.about(found), "versions": shelf().versions(kind, found.name), "files": files})


def _put(kind: str, asked: LibraryTask, room: int) -> StoredVersion:
    files = {}
    for path, content in (asked.files or {}).items():
        try:
            files[path] = base64.b64decode(content, validate=True)
        except binascii.Error as error:
            raise InputError(f"files.{path}: not base64: {error}") from None
    if shelf().size() + sum(map(len, files.values())) > room:
        raise TooMuch(
            f"files: the library of this service has {room / 1e6:.0f} MB, and is full; delete what is not used"
        )
    return own.put(kind, asked.name, files)
