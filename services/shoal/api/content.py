"""Scenes, problems and recordings out of requests. No path, no address and no other format of a client is ever opened.

What is to be found in a file is written into the worker's own folder first, from data that have been checked.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from shoal.api.limits import TooMuch, check_scene
from shoal.api.schemas import Table
from shoal.api.settings import Settings
from shoal.engines import ENGINES
from shoal.errors import InputError
from shoal.identification import Problem, load_problem, problem_names
from shoal.identification.recording.source import EngineSource, FileSource
from shoal.scene import Scene, load_scene, scene_names
from shoal.scene.parametric import parametric

_MACHINE = "machine.yaml"
"""The inline scene of a problem, relative to the worker's folder."""


def scene_of(given: str | dict[str, Any], values: Mapping[str, Any] | None = None) -> Scene:
    """The scene of a request. Raises InputError."""
    scene = Scene.parse(given, "scene") if isinstance(given, dict) else _loaded(given)
    return scene.with_values(values) if values else scene


@lru_cache(maxsize=64)
def _loaded(name: str) -> Scene:
    """The built-in scene of that name; looking it up takes longer than a short run. Raises InputError."""
    return load_scene(_built_in(name))


def _built_in(name: str) -> str:
    """The name, if it is that of a built-in scene. Raises InputError."""
    if name not in scene_names() and (len(name) > 20 or parametric(name) is None):
        raise InputError(f"scene: no built-in scene {name!r}; there are {', '.join(scene_names())}")
    return name


def problem_of(given: str | dict[str, Any], settings: Settings, values: Mapping[str, Any] | None = None) -> Problem:
    """The problem of a request, with its scene in the working folder if it was sent along. Raises InputError."""
    if isinstance(given, str):
        if given not in problem_names():
            raise InputError(f"problem: no built-in problem {given!r}; there are {', '.join(problem_names())}")
        problem = load_problem(given)
    else:
        problem = Problem.parse({**given, "scene": _scene_name(given.get("scene"))}, "problem")
    for name, source in problem.sources.items():
        _check_source(name, source, settings)
    scene = problem.load_scene(values)
    for source in problem.sources.values():
        if isinstance(source, EngineSource):
            end = source.stop / source.clock + source.delay
            truth = problem.load_scene().with_values({**source.known, **source.values})
            for one in (truth, scene):
                check_scene(one, settings, [end] * source.count, 1 + len(problem.parameters))
        elif source.known:
            check_scene(scene.with_values(source.known), settings)
    check_scene(scene, settings)
    return problem


def _scene_name(given: Any) -> str:
    if isinstance(given, dict):
        data = scene_of(given).model_dump(mode="json")
        Path(_MACHINE).write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
        return _MACHINE
    if not isinstance(given, str):
        raise InputError("problem: scene: a built-in name or an object is needed")
    return _built_in(given)


def _check_source(name: str, source: EngineSource | FileSource, settings: Settings) -> None:
    """A recording comes with the request; data are computed by an engine of this installation."""
    if isinstance(source, FileSource):
        if source.path is not None:
            raise InputError(f"problem: recordings.{name}.path: no file is read here; send the numbers in `recordings`")
        return
    if source.engine not in ENGINES:
        raise InputError(
            f"problem: recordings.{name}.engine: no engine {source.engine!r}; there are {', '.join(ENGINES)}"
        )
    if source.count > settings.max_values:
        raise TooMuch(f"problem: recordings.{name}.count: this service takes {settings.max_values}")


def written(recordings: Mapping[str, Table]) -> dict[str, str]:
    """The recordings as files of the working folder, by name. Raises InputError."""
    files = {}
    for name, table in recordings.items():
        lengths = {len(column) for column in table.columns.values()}
        if len(lengths) > 1:
            raise InputError(f"recordings.{name}.columns: all need the same length, found {sorted(lengths)}")
        files[name] = f"{name}.csv"
        with Path(files[name]).open("w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(table.columns)
            rows.writerows(zip(*table.columns.values(), strict=True))
    return files
