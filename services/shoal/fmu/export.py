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

import numpy as np

from shoal.atomic_write import atomic_write
from shoal.engines import get_engine
from shoal.engines.capabilities import is_moved_by_swarm
from shoal.errors import ComputationError, InputError
from shoal.fmu.inputs import require_input
from shoal.fmu.running import CONTENT, Running, identifier
from shoal.scene import Scene
from shoal.scene.ended import End
from shoal.scene.function import Function

SAME_PLACE = 1e-9
"""A unit and `simulate` run the same solver; so far apart [m] they are not the same machine."""


def export(
    scene: Scene, paths: Sequence[str] = (), out: Path | None = None, *, inputs: Sequence[str] = (), fmi: str = "2"
) -> Path:
    """Write a unit; returns its file. Raises InputError, and ComputationError if it cannot be written or does not move.

    paths: fields of the scene that are its parameters, by default gravity and the stated initial angles; out: by
    default the scene's name in the working folder; inputs: loads' scales or torques and drives that a host may change
    in the run; fmi: version, 2 or 3
    """
    if is_moved_by_swarm(scene):
        raise InputError(f"solver.acceleration: {scene.solver.acceleration!r} is for studies; a unit needs a solver")
    chosen = list(dict.fromkeys(paths)) or _usual(scene)
    for path in inputs:
        if path in chosen:
            raise InputError(f"input: {path} is a parameter as well; it can be one of them")
        require_input(scene, path)
    content = {
        "scene": scene.model_dump(mode="json", exclude_unset=True),
        "parameters": {path: number(scene, path) for path in chosen},
        "inputs": {path: number(scene, path) for path in dict.fromkeys(inputs)},
    }
    target = out or Path(f"{identifier(scene)}.fmu")
    with tempfile.TemporaryDirectory() as folder, _paths_as_they_were(), atomic_write(target) as unit:
        builder, name = _builder(fmi)
        script, data = Path(folder) / name, Path(folder) / CONTENT
        shutil.copy(str(Path(__file__).with_name(name)), script)
        data.write_text(json.dumps(content), encoding="utf-8")
        _require_same(Running(folder), scene)
        made = builder.build_FMU(script, unit if fmi == "2" else folder, [data])
        if fmi == "3":
            shutil.copy(made, unit)
    return target


def _builder(fmi: str) -> tuple[Any, str]:
    """Return the builder of units of a version of FMI, and the script inside."""
    if fmi == "2":
        from pythonfmu.builder import FmuBuilder

        return FmuBuilder, "machine.py"
    if fmi == "3":
        from pythonfmu3.builder import FmuBuilder as FmuBuilder3

        return FmuBuilder3, "machine3.py"
    raise InputError(f"fmi: there are versions 2 and 3, found {fmi}")


def _require_same(unit: Running, scene: Scene) -> None:
    """Raises ComputationError for a unit that does not stand and go on as `simulate` says of the scene."""
    _, _, step = unit.experiment
    outputs = [one.getter for one in unit.variables() if one.causality == "output" and one.unit == "m"]
    unit.begin(step)
    places = [[where() for where in outputs]]
    unit.go_on(0.0, step)
    places.append([where() for where in outputs])
    right = get_engine("gauss").simulate(scene, [0.0, step])
    expected = np.concatenate([right.marker(name) for name in scene.markers], axis=1) if outputs else np.zeros((2, 0))
    apart = float(np.abs(np.array(places) - expected).max(initial=0.0))
    if not apart <= SAME_PLACE:
        raise ComputationError(f"{scene.name}: the unit would be off by {apart:.2g} m from `shoal simulate`")


def _usual(scene: Scene) -> list[str]:
    """Gravity and the initial angles that are stated: what else a body has is said by the joints."""
    goes_on = isinstance(scene.initial_from, End)
    turned = [name for name, start in scene.initial.items() if not goes_on and start.stated("angle")]
    return [*(f"gravity.{k}" for k in range(len(scene.gravity))), *(f"initial.{name}.angle" for name in turned)]


def number(scene: Scene, path: str) -> float:
    """The real number at a path of a scene. Raises InputError."""
    value = scene.value(path)
    if isinstance(value, Function):
        value = value.number
    if not isinstance(value, float):
        raise InputError(f"{path} is not a real number that stands in the scene")
    head, *rest = path.split(".")
    if head == "initial" and len(rest) > 1 and getattr(scene.initial.get(rest[0]), rest[1], None) is None:
        raise InputError(
            f"{path}: the scene does not state it, so that the joints decide; set it as well to some value"
        )
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
