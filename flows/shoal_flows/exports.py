"""A scene as files of other tools: what `shoal export`, `shoal export-fmu` and `shoal simulate --out` write."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from shoal.atomic_write import file_name
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.exported import TOOLS, export
from shoal.fmu.export import export as export_unit
from shoal.fmu.running import identifier
from shoal.json_values import plain
from shoal.pictures import files
from shoal.requests.fmu import Fmu
from shoal.scene import Scene
from shoal.trajectory import Trajectory

FMU = "fmu"
MOTIONS = ("csv", "parquet", "nc")
FORMS = (*TOOLS, FMU, *MOTIONS)
"""What a scene can be written as: for a tool, as a unit, or its motion as a table."""


@dataclass(frozen=True)
class Exports:
    """Files of a scene by name. distances: how far a tool's motion is from the native one at most [m], by tool.

    motion: where its table was asked for
    """

    scene: Scene
    files: dict[str, bytes]
    distances: dict[str, float]
    motion: Trajectory | None = None

    @property
    def ok(self) -> bool:
        """Return whether the motion, if there is one, may be believed."""
        return self.motion is None or self.motion.ok

    @property
    def message(self) -> str:
        """Return why it may not be used."""
        return "" if self.motion is None else self.motion.message

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal run export --json` prints; the files themselves are in MLflow."""
        told = {"status": "ok" if self.ok else "failed", "message": self.message, "scene": self.scene.name}
        return plain({**told, "files": list(self.files), "distances": self.distances})  # type: ignore[no-any-return]


def exported(asked: Fmu, to: Sequence[str], verify: bool = True) -> Exports:
    """Every file that is asked for.

    Raises InputError that names what a tool has not, ComputationError where a run fails.
    """
    for form in to:
        if form not in FORMS:
            raise InputError(f"to: no form {form!r}; there are {', '.join(FORMS)}")
    if FMU not in to and (asked.parameter or asked.input):
        raise InputError("parameter, input: are those of a unit; `to` has no fmu")
    wanted = asked.machine()
    distances, motion = dict[str, float](), None
    with TemporaryDirectory() as name:
        folder = Path(name)
        for form in to:
            if form in TOOLS:
                done = export(wanted, form, verify=verify)
                done.save(folder / done.name)
                distances |= {} if done.distance is None else {form: done.distance}
            elif form == FMU:
                export_unit(wanted, asked.parameter, folder / f"{identifier(wanted)}.fmu", inputs=asked.input)
            else:
                engine = get_engine("gauss")
                motion = motion or (verified(engine, wanted) if verify else engine.simulate(wanted))
                files.trajectory(motion, wanted, folder / f"{file_name(wanted.name)}.{form}")
        return Exports(wanted, {one.name: one.read_bytes() for one in sorted(folder.iterdir())}, distances, motion)
