"""Fingerprints of results: hashes of the request, the data, the sources and the versions."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

import shoal
from shoal.home import processor
from shoal.identification import Measurement, load_problem
from shoal.scene import Scene

from shoal_flows import provenance
from shoal_flows.jobs import Cell

_SOURCES = (".py", ".yaml", ".j2")


@cache
def of_code() -> str:
    """Hash all source files of library and flows, the versions of their packages, and the processor."""
    digest = hashlib.sha256()
    for folder in (Path(shoal.__file__).parent, Path(__file__).parent):
        for file in sorted(path for path in folder.rglob("*") if path.suffix in _SOURCES):
            digest.update(str(file.relative_to(folder)).encode() + b"\0" + file.read_bytes() + b"\0")
    digest.update(repr((provenance.versions(), processor())).encode())
    return digest.hexdigest()


def of_cell(cell: Cell, measurement: Measurement) -> str:
    """Hash an optimisation. Raises InputError."""
    problem = load_problem(cell.problem)
    digest = hashlib.sha256(repr((cell, problem.load_scene(cell.values).fingerprint)).encode())
    digest.update(problem.model_dump_json().encode() + measurement.origin.encode())
    for name, recording in measurement.recordings.items():
        digest.update(name.encode() + recording.times.tobytes() + recording.values.tobytes())
        digest.update(recording.noise.tobytes() + repr((recording.channels, recording.stated)).encode())
        for held in recording.held:
            digest.update(repr(held.window).encode() + held.times.tobytes() + held.values.tobytes())
    return _with_code("fit", digest.hexdigest())


def of_simulations(what: str, scene: Scene, *settings: Any) -> str:
    """Hash runs of one scene."""
    return _with_code(what, repr((scene.fingerprint, settings)))


def _with_code(what: str, text: str) -> str:
    return f"{what}-{hashlib.sha256(f'{text} {of_code()}'.encode()).hexdigest()[:32]}"
