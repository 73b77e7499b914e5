"""Evaluations that outlive a run: a method that starts again with the same seed finds them and goes on."""

from __future__ import annotations

import hashlib
import io
import struct
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np

from shoal.errors import ComputationError, InputError
from shoal.regular import require_regular
from shoal.trajectory import Array

_MAGIC = b"shoal-checkpoint-2\n"
_HEAD = struct.Struct("<20sII")
"""Key of a batch, bytes that follow, and their checksum."""


class EvaluationCache:
    """Answers of a model to batches of points, in a file that only grows; what a crash cut off at its end is dropped.

    Methods are deterministic, so replaying one from its seed asks for the same batches in the same order; those that
    are known cost nothing. fingerprint: of everything that they depend on.
    """

    def __init__(self, path: Path, fingerprint: str, of: str = "identification") -> None:
        """Open or begin the file.

        of: what it is of, in words. Raises InputError if it is damaged, belongs to another one or cannot be written.
        """
        self.path, self._of = path, of
        self.recalled = 0
        self._known: dict[bytes, Array] = {}
        require_regular(path, "checkpoint")
        begin = _MAGIC + fingerprint.encode() + b"\n"
        try:
            kept = self._load(begin) if path.exists() and path.stat().st_size else 0
            self._file = path.open("r+b" if kept else "wb")
            if kept:
                self._file.truncate(kept)
                self._file.seek(kept)
            else:
                self._file.write(begin)
                self._file.flush()
        except OSError as error:
            raise InputError(f"checkpoint: {path} cannot be written: {error.strerror}") from None

    def recall(self, model: object, points: Array) -> Array | None:
        """Return the cached values of a batch, or None."""
        found = self._known.get(_key(model, points))
        self.recalled += 0 if found is None else len(points)
        return found

    def keep(self, model: object, points: Array, residuals: Array) -> None:
        """Note the residuals of a batch. Raises ComputationError where they cannot be written, as on a full disk."""
        buffer = io.BytesIO()
        np.save(buffer, residuals, allow_pickle=False)
        body = buffer.getvalue()
        try:
            self._file.write(_HEAD.pack(_key(model, points), len(body), zlib.crc32(body)) + body)
            self._file.flush()
        except OSError as error:
            raise ComputationError(f"checkpoint: {self.path} cannot be written: {error.strerror}") from None

    def close(self) -> None:
        """Close the file; what could not be written was said before."""
        with suppress(OSError):
            self._file.close()

    def _load(self, begin: bytes) -> int:
        """Read what is whole; returns where it ends."""
        data = self.path.read_bytes()
        if begin.startswith(data):
            return 0
        if not data.startswith(begin):
            raise InputError(f"checkpoint: {self.path} is that of another {self._of}; name another file")
        place = len(begin)
        while place + _HEAD.size <= len(data):
            key, size, checksum = _HEAD.unpack_from(data, place)
            end = place + _HEAD.size + size
            if end > len(data):
                break
            body = data[place + _HEAD.size : end]
            if zlib.crc32(body) != checksum:
                raise InputError(f"checkpoint: {self.path} is damaged at byte {place}; name another file or delete it")
            self._known[key] = np.load(io.BytesIO(body), allow_pickle=False)
            place = end
        return place


def _key(model: object, points: Array) -> bytes:
    """Return the key of a batch; model: identifies a model of the study by its `repr`."""
    return hashlib.sha1(repr((model, points.shape)).encode() + points.tobytes()).digest()
