"""Settings of a service, from the environment: SHOAL_API_WORKERS and so on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, ValidationError
from pydantic_settings import BaseSettings, SettingsConfigDict

from shoal.errors import InputError
from shoal.scene.record import one_line
from shoal.shelf import shelf

PREFIX = "SHOAL_API_"
Count = Annotated[int, Field(ge=1)]
Seconds = Annotated[float, Field(gt=0)]


class Settings(BaseSettings):
    """Limits of one service.

    keys_file: one API key per line, after its name if it has one; without the file no key is needed
    workers, job_workers: processes for single calls and for identifications
    queue, job_queue: tasks that may wait for a worker; more are refused with Retry-After
    connections: open at once
    header_seconds: until a request's headers are complete
    body_bytes, json_depth, receive_seconds: of a request's body
    wall_seconds, job_seconds: a computation that takes longer is ended
    max_work: steps x elements x lanes of a simulation (a rigid body counts as one element)
    max_elements: of a scene; max_values: samples x markers x lanes of a result
    max_memory_mb: data of one worker process [MiB]
    keep_jobs, keep_seconds: number of finished identifications that are kept, and for how long
    library: folder of the library, else that of $SHOAL_LIBRARY; library_mb: of all files in it [MB]
    model: the problem of UM-Bridge's models where a call names none
    """

    model_config = SettingsConfigDict(env_prefix=PREFIX, frozen=True)

    keys_file: Path | None = None
    workers: Count = 2
    job_workers: Count = 1
    queue: Annotated[int, Field(ge=0)] = 64
    job_queue: Annotated[int, Field(ge=0)] = 8
    connections: Count = 256
    body_bytes: Count = 8 * 2**20
    json_depth: Count = 32
    header_seconds: Seconds = 10.0
    receive_seconds: Seconds = 30.0
    wall_seconds: Seconds = 60.0
    job_seconds: Seconds = 600.0
    max_work: Count = 1_000_000_000
    max_elements: Count = 5000
    max_values: Count = 1_000_000
    max_memory_mb: Count = 4096
    keep_jobs: Count = 100
    keep_seconds: Seconds = 3600.0
    library: Path = Field(default_factory=lambda: shelf().root)
    library_mb: Count = 1000
    model: str = "paper-case-1"

    @classmethod
    def read(cls) -> Self:
        """The settings of the environment. Raises InputError."""
        try:
            return cls()
        except ValidationError as error:
            name, _, rest = str(one_line(error, PREFIX)).removeprefix(f"{PREFIX}: ").partition(": ")
            raise InputError(f"{PREFIX}{name.upper()}: {rest}") from None

    def keys(self) -> dict[bytes, str]:
        """Return the API keys with their names; none if no key is needed. Raises InputError.

        A line is `KEY` or `NAME KEY`; a key without a name is called by its line, as in `key 2`.
        """
        if self.keys_file is None:
            return {}
        try:
            lines = self.keys_file.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{PREFIX}KEYS_FILE: {self.keys_file} cannot be read: {error}") from None
        keys = {}
        for number, words in enumerate(map(str.split, lines), 1):
            if len(words) > 2:
                raise InputError(f"{PREFIX}KEYS_FILE: line {number} of {self.keys_file} is not KEY or NAME KEY")
            if words:
                keys[words[-1].encode()] = words[0] if len(words) == 2 else f"key {number}"
        if not keys:
            raise InputError(f"{PREFIX}KEYS_FILE: {self.keys_file} holds no key; write one per line")
        return keys
