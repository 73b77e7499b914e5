"""A scene as a file that hosts of FMI 2.0 or 3.0 load."""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from shoal.engines.swarm_motion import asked_for
from shoal.errors import InputError
from shoal.fmu.inputs import require_input
from shoal.fmu.running import CONTENT, identifier
from shoal.scene import Scene
from shoal.scene.ended import End
from shoal.scene.function import Function
from shoal.whole import whole


def export(
    scene: Scene, paths: Sequence[str] = (), out: Path | None = None, *, inputs: Sequence[str] = (), fmi: str = "2"
) -> Path:
    """Write a unit; returns its file. Raises InputError, and ComputationError if it cannot be written.

    paths: fields of the scene that are its parameters, by default gravity and the initial angles; out: by default the
    scene's name in the working folder; inputs: loads' scales or torques and drives that a host may change in the run;
    fmi: version, 2 or 3
    """
    if asked_for(scene):
        raise InputError(f"solver.acceleration: {scene.solver.acceleration!r} is for studies; a unit needs a solver")
    chosen = list(dict.fromkeys(paths)) or _usual(scene)
    for path in inputs:
        if path in chosen:
            raise InputError(f"input: {path} is a parameter as well; it can be one of them")
        require_input(scene, path)
    content = {
        "scene": scene.model_dump(mode="json"),
        "parameters": {path: number(scene, path) for path in chosen},
        "inputs": {path: number(scene, path) for path in dict.fromkeys(inputs)},
    }
    target = out or Path(f"{identifier(scene)}.fmu")
    with tempfile.TemporaryDirectory() as folder, _paths_as_they_were(), whole(target) as unit:
        builder, name = _builder(fmi)
        script, data = Path(folder) / name, Path(folder) / CONTENT
        shutil.copy(str(Path(__file__).with_name(name)), script)
        data.write_text(json.dumps(content), encoding="utf-8")
        made = builder.build_FMU(script, unit if fmi == "2" else folder, [data])
        if fmi == "3":
            shutil.copy(made, unit)
    return target


def _builder(fmi: str) -> tuple[Any, str]:
    """What builds units of a version of FMI, and the script inside."""
    if fmi == "2":
        from pythonfmu.builder import FmuBuilder

        return FmuBuilder, "machine.py"
    if fmi == "3":
        from pythonfmu3.builder import FmuBuilder as FmuBuilder3

        return FmuBuilder3, "machine3.py"
    raise InputError(f"fmi: there are versions 2 and 3, found {fmi}")


def _usual(scene: Scene) -> list[str]:
    """Gravity and the initial angles; in space those that are stated, as others may be rotations."""
    stated = {name for name, start in scene.initial.items() if start.stated("angle")}
    goes_on = isinstance(scene.initial_from, End)
    turned = [name for name in scene.bodies if not goes_on and (scene.dimensions == 2 or name in stated)]
    return [*(f"gravity.{k}" for k in range(len(scene.gravity))), *(f"initial.{name}.angle" for name in turned)]


def number(scene: Scene, path: str) -> float:
    """The real number at a path of a scene. Raises InputError."""
    value = scene.value(path)
    if isinstance(value, Function):
        value = value.number
    if not isinstance(value, float):
        raise InputError(f"{path} is not a real number that stands in the scene")
    scene.with_values({path: value})
    return value


@contextmanager
def _paths_as_they_were() -> Iterator[None]:
    """Undo what the builder leaves behind of the script it has imported."""
    before, known = list(sys.path), set(sys.modules)
    try:
        yield
    finally:
        sys.path[:] = before
        if "machine" not in known:
            sys.modules.pop("machine", None)
