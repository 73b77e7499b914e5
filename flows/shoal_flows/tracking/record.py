"""All there is to say about one run, before MLflow has heard of it, and its form in a folder."""

from __future__ import annotations

import json
import math
import re
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self
from uuid import uuid4

from shoal_flows.tracking.data import Data

LOCAL = "outbox-"
"""How the id of a run begins that MLflow has not given one yet."""
MODEL = "model"
"""The folder among the files of a run that holds its model."""
_TEXT = "record.json"
_FILES = "files"
_NOTE = "mlflow.note.content"
_LONGEST = 6000
"""Of a text that MLflow takes."""


@dataclass(frozen=True)
class Registration:
    """The version as which the model of a run enters MLflow's registry.

    name, about: of the registered model; description, tags: of the version
    doubts: why it does not become the champion, in words
    """

    name: str
    about: str
    description: str
    tags: dict[str, str]
    doubts: list[str]


@dataclass
class Run:
    """A run that is being filled; what is added is sent when it ends.

    run_id: MLflow's, or one of our own as long as MLflow cannot be reached; name, description in words; parent: the
    run_id of the study; params never change; metrics: (name, value, time [ms], step); files: artifacts by path
    data: what it was fitted to; started, ended [ms]; took: work [s] that had ended before the start
    registration: of the model below `model/` among the files, if there is one
    """

    experiment: str
    name: str
    tags: dict[str, str]
    parent: str | None = None
    run_id: str = field(default_factory=lambda: f"{LOCAL}{uuid4().hex}")
    status: str = "RUNNING"
    started: int = field(default_factory=lambda: _now())
    ended: int = 0
    took: float = 0.0
    kept_params: dict[str, str] = field(default_factory=dict)
    metrics: list[tuple[str, float, int, int]] = field(default_factory=list)
    files: dict[str, bytes] = field(default_factory=dict)
    data: list[Data] = field(default_factory=list)
    registration: Registration | None = None

    @property
    def known(self) -> bool:
        """Return whether MLflow has made this run."""
        return not self.run_id.startswith(LOCAL)

    def describe(self, text: str) -> None:
        """Set the run's description in MLflow (Markdown), cut to the allowed length."""
        if text:
            self.tags[_NOTE] = text[:_LONGEST]

    def judge(self, word: str, doubts: Sequence[str] = (), says: str = "Not to be trusted") -> None:
        """Set the tag `verdict`; doubts: every reason not to trust the run, a tag and the head of the description."""
        self.tags["verdict"] = word
        if doubts:
            self.tags["doubts"] = "; ".join(doubts)[:_LONGEST]
            self.describe(f"**{says}:** {'; '.join(doubts)}\n\n{self.tags.get(_NOTE, '')}".strip())

    def params(self, values: Mapping[str, Any]) -> None:
        """Settings, which never change; what is too long for MLflow is cut."""
        self.kept_params |= {name: str(value)[:_LONGEST] for name, value in values.items()}

    def metric(self, name: str, value: float, step: int = 0) -> None:
        """One number; what is not finite is left out."""
        if math.isfinite(value):
            self.metrics.append((re.sub(r"[^\w\-. /]", "_", name), float(value), _now(), step))

    def series(self, name: str, values: Iterable[tuple[int, float]]) -> None:
        """Numbers by step."""
        for step, value in values:
            self.metric(name, value, step)

    def text(self, content: str, path: str) -> None:
        """A text artifact at `path`."""
        self.files[path] = content.encode()

    def picture(self, content: bytes, path: str) -> None:
        """A picture at `path`."""
        self.file(content, path)

    def file(self, content: bytes, path: str) -> None:
        """An artifact of any kind at `path`."""
        self.files[path] = content

    def end(self, status: str) -> None:
        """FINISHED, FAILED or KILLED."""
        self.status, self.ended = status, _now()

    def write_files(self, folder: Path) -> None:
        """The artifacts, each at its path."""
        for path, content in self.files.items():
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)

    def save(self, folder: Path) -> None:
        """Write everything to a new folder, which is there as a whole or not at all."""
        fresh = folder.with_name(f".{folder.name}")
        fresh.mkdir(parents=True)
        self.write_files(fresh / _FILES)
        (fresh / _TEXT).write_text(json.dumps({**asdict(self), "files": None}), encoding="utf-8")
        fresh.rename(folder)

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Load a record written by `save`. Raises OSError, ValueError."""
        data = json.loads((folder / _TEXT).read_text(encoding="utf-8"))
        data["metrics"] = [(name, value, when, step) for name, value, when, step in data["metrics"]]
        if stated := data.get("registration"):
            data["registration"] = Registration(**stated)
        data["data"] = [Data(**one) for one in data.get("data", [])]
        where = folder / _FILES
        found = [path for path in where.rglob("*") if path.is_file()]
        data["files"] = {path.relative_to(where).as_posix(): path.read_bytes() for path in found}
        return cls(**data)


def _now() -> int:
    return int(time.time() * 1000)
