"""Scenes, problems and recordings out of requests. No path, no address and no other format of a client is ever opened.

A name is a built-in one, or that of an entry in this installation's library. What else is to be found in a file is
written into the worker's own folder first, from data that have been checked.
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
from shoal.identification.problem import built_in_problems
from shoal.identification.recording.source import EngineSource, FileSource
from shoal.scene import Scene, load_scene, scene_names
from shoal.scene.load import built_in_scenes, some, unknown
from shoal.scene.parametric import parametric
from shoal.shelf import shelf

_MACHINE = "machine.yaml"
"""The inline scene of a problem, relative to the worker's folder."""


def scene_of(given: str | dict[str, Any], values: Mapping[str, Any] | None = None) -> Scene:
    """The scene of a request. Raises InputError."""
    if isinstance(given, dict):
        scene = Scene.parse(given, "scene")
    elif (entry := shelf().find("scenes", given)) is not None and not _is_built_in(given):
        scene = _of_entry(f"{entry.name}@{entry.version}")
    else:
        scene = _loaded(given)
    return scene.with_values(values) if values else scene


@lru_cache(maxsize=64)
def _loaded(name: str) -> Scene:
    """The built-in scene of that name; looking it up takes longer than a short run. Raises InputError."""
    return load_scene(_known(name))


@lru_cache(maxsize=64)
def _of_entry(version: str) -> Scene:
    """A version of a scene in the library. Raises InputError."""
    return load_scene(version)


def _is_built_in(name: str) -> bool:
    return name in built_in_scenes() or (len(name) <= 20 and parametric(name) is not None)


def _known(name: str) -> str:
    """The name, if it is that of a scene. Raises InputError."""
    if not _is_built_in(name) and shelf().find("scenes", name) is None:
        raise InputError(f"scene: {unknown(name, 'scene', scene_names())}; there are {some(scene_names())}")
    return name


def problem_of(given: str | dict[str, Any], settings: Settings, values: Mapping[str, Any] | None = None) -> Problem:
    """The problem of a request, with its scene in the working folder if it was sent along. Raises InputError."""
    if isinstance(given, str):
        if given not in built_in_problems() and shelf().find("problems", given) is None:
            raise InputError(
                f"problem: {unknown(given, 'problem', problem_names())}; there are {some(problem_names())}"
            )
        problem = load_problem(given)
    else:
        problem = Problem.parse({**given, "scene": _scene_name(given.get("scene"))}, "problem")
    for name, source in problem.sources.items():
        _check_source(name, source, settings, isinstance(given, str))
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
        raise InputError("problem: scene: a name or an object is needed")
    return _known(given)


def _check_source(name: str, source: EngineSource | FileSource, settings: Settings, ours: bool) -> None:
    """A recording comes with the request or is in the library; data are computed by an engine of this installation.

    ours: whether the problem itself is in the library, where entries name nothing but what is in them
    """
    if isinstance(source, FileSource):
        if source.path is not None and not ours and shelf().find("recordings", source.path) is None:
            raise InputError(
                f"problem: recordings.{name}.path: no file is read here; send the numbers in `data`, or name a "
                "recording of the library"
            )
        return
    if source.engine not in ENGINES:
        raise InputError(
            f"problem: recordings.{name}.engine: no engine {source.engine!r}; there are {', '.join(ENGINES)}"
        )
    if source.count > settings.max_values:
        raise TooMuch(f"problem: recordings.{name}.count: this service takes {settings.max_values}")


def written(recordings: Mapping[str, Table | str]) -> dict[str, str]:
    """The recordings as files of the working folder, or of the library, by name. Raises InputError."""
    files = {}
    for name, table in recordings.items():
        if isinstance(table, str):
            known = [entry.name for entry in shelf().entries("recordings")]
            if (entry := shelf().find("recordings", table)) is None:
                raise InputError(f"data.{name}: {unknown(table, 'recording of the library', known)}")
            files[name] = str(entry.document)
            continue
        lengths = {len(column) for column in table.columns.values()}
        if len(lengths) > 1:
            raise InputError(f"data.{name}.columns: all need the same length, found {sorted(lengths)}")
        files[name] = f"{name}.csv"
        with Path(files[name]).open("w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(table.columns)
            rows.writerows(zip(*table.columns.values(), strict=True))
    return files
