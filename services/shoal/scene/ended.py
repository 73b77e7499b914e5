"""The end of a run, from which another one of the same machine goes on."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.regular import require_regular
from shoal.scene.record import Record
from shoal.shelf import LARGEST

_SAME = 1e-9
"""Lengths that differ by less, relative, are the same."""
CURVES = ("ancf-cable", "ancf-quintic")
"""Elements whose nodes have a curve and its derivatives, of which more nodes are exactly known."""


class BodyState(Record):
    """State of a body at the end of a run."""

    element: str
    """Element of the body in that run."""
    mesh: dict[str, int] = {}
    """Numbers of its elements or modes in that run."""
    length: float | None = None
    """Length of the rod in that run [m]."""
    vectors: tuple[tuple[float, ...], ...]
    """Of a rigid body its origin [m] and its directors [1] (of a point mass the origin alone), of a flexible rod those
    of its nodes (place, slope, ...), one node after the other, of a modal body its origin, its director and a vector of
    every mode [m].
    """
    rates: tuple[tuple[float, ...], ...]
    """Time derivatives of the vectors [m/s, 1/s]."""


class End(Record):
    """The state of a machine at the end of a run."""

    t: float
    """Time [s]."""
    bodies: dict[str, BodyState]
    """State of every body by name."""
    turns: dict[str, tuple[float, ...]] = {}
    """Angles that joints and loads have counted, in their order [rad]."""
    angles: dict[str, float] = {}
    """Directions of markers, counted over full turns [rad]."""
    states: dict[str, float] = {}
    """Values of states of the user [1]."""
    measures: dict[str, float] = {}
    """Angles that signals measure, such as `angle(hinge)`, counted over full turns [rad]."""

    def check(self, bodies: Mapping[str, Any]) -> None:
        """Raises ValueError, one line, where it is that of other bodies."""
        if missing := [*(set(self.bodies) ^ set(bodies))]:
            whose = "the run has" if missing[0] in self.bodies else "the scene has"
            raise ValueError(f"initial.from: bodies.{missing[0]}: only {whose} such a body")
        for name, body in bodies.items():
            for field, there, here in _differences(self.bodies[name], body):
                raise ValueError(f"initial.from: bodies.{name}.{field}: {here} in the scene, {there} in the run")


def _differences(state: BodyState, body: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield the fields that differ from the run: the field, its value there and here."""
    if state.element != body.element:
        yield "element", state.element, body.element
    mesh = mesh_of(body)
    for field in sorted({*state.mesh, *mesh}):
        there, here = state.mesh.get(field, 0), mesh.get(field, 0)
        if there != here and not (state.element in CURVES and there > 0 and here % there == 0):
            yield field, there, here
    length = getattr(body, "length", None)
    if length is None and state.length is None:
        return
    known = np.nan if state.length is None else state.length
    lengths = np.atleast_1d(np.nan if length is None else length)
    if np.any(off := ~(np.abs(lengths - known) <= _SAME * np.abs(known))):
        yield "length", state.length, float(lengths[off][0])


def mesh_of(body: Any) -> dict[str, int]:
    """Return the mesh of a body; empty for all but flexible rods."""
    return dict(getattr(body, "mesh", {}))


def read_end(path: Path) -> Any:
    """Read the final state from the JSON of a run (`shoal simulate --json`, `--out FILE.json`). Raises InputError."""
    require_regular(path, "initial.from")
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a path"
        raise InputError(f"initial.from: {path}: cannot be read: {reason}; `statics` or the JSON of a run") from None
    if len(content) > LARGEST:
        raise InputError(f"initial.from: {path}: larger than the {LARGEST} bytes that are read")
    try:
        data = json.loads(content)
    except (ValueError, RecursionError):
        raise InputError(f"initial.from: {path}: not the JSON of a run") from None
    if isinstance(data, dict) and data.get("status", "ok") != "ok":
        raise InputError(f"initial.from: {path}: its run ended with {str(data['status'])[:40]!r}; only `ok` has an end")
    if not isinstance(data, dict) or not isinstance(data.get("end"), dict):
        raise InputError(f"initial.from: {path}: no `end`; `shoal simulate SCENE --out FILE.json` writes one")
    return data["end"]


def with_end(data: Any, folder: Path, source: str) -> Any:
    """The fields of a scene with the end of a run in place of the file that `initial.from` names. Raises InputError."""
    initial = data.get("initial") if isinstance(data, dict) else None
    if not isinstance(initial, dict) or not isinstance(origin := initial.get("from"), str) or origin == "statics":
        return data
    try:
        return {**data, "initial": {**initial, "from": read_end(folder / origin)}}
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
