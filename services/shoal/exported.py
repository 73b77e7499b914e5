"""Scenes as files of other tools, with which one goes on from there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from shoal.atomic_write import atomic_write, file_name
from shoal.engines import get_engine
from shoal.engines.contract import sampling_times
from shoal.errors import ComputationError, InputError
from shoal.scene import Scene
from shoal.trajectory import Trajectory


@dataclass(frozen=True)
class Tool:
    """ending: of its files; text: a scene as the content of one; run: the motion that the tool makes of the scene."""

    ending: str
    text: Callable[[Scene], str]
    run: Callable[[Scene], Trajectory]


@dataclass(frozen=True)
class Exported:
    """A scene as the content of another tool's file, with the name that the file would have.

    distance: how far the tool's motion is from the native one at most [m], if that was asked for
    """

    to: str
    name: str
    text: str
    distance: float | None

    def to_json(self) -> dict[str, Any]:
        """The object that a service answers."""
        return {"status": "ok", **asdict(self)}

    def save(self, file: Path) -> None:
        """Write the file, whole or not at all. Raises ComputationError."""
        with atomic_write(file) as part:
            part.write_text(self.text, encoding="utf-8")


def export(scene: Scene, to: str, *, verify: bool = True) -> Exported:
    """A scene for another tool, one of `TOOLS`; verify: run it there and here, and compare.

    Raises InputError that names what the tool has not, ComputationError where a run fails.
    """
    tool = TOOLS[checked(to)]
    text = tool.text(scene)
    return Exported(to, f"{file_name(scene.name)}{tool.ending}", text, _compared(tool, scene) if verify else None)


def checked(to: str, file: Path | None = None) -> str:
    """The tool, if there is one that has files of such a name. Raises InputError."""
    if to not in TOOLS:
        raise InputError(f"to: no tool {to!r}; there are {', '.join(TOOLS)}")
    ending = TOOLS[to].ending
    if file is not None and file.suffix != ending:
        raise InputError(f"out: {file} ends in {file.suffix or 'nothing'}; {to} has {ending}")
    return to


def _compared(tool: Tool, scene: Scene) -> float:
    theirs = tool.run(scene)
    ours = get_engine("gauss").simulate(scene)
    for motion in (theirs, ours):
        if not motion.ok:
            raise ComputationError(f"{scene.name}: {motion.explanation}; --no-verify writes the file all the same")
    return ours.distance(theirs)


def _script(scene: Scene) -> str:
    from shoal.engines.exudyn.script import script

    return script(scene)


def _mjcf(scene: Scene) -> str:
    from shoal.engines.mujoco.engine import stepped

    return stepped(scene).text


def _in_mujoco(scene: Scene) -> Trajectory:
    from shoal.engines.mujoco.engine import MujocoEngine, stepped

    return MujocoEngine().run(stepped(scene), sampling_times(scene, None))


TOOLS = {
    "exudyn": Tool(".py", _script, lambda scene: get_engine("exudyn").simulate(scene)),
    "mjcf": Tool(".xml", _mjcf, _in_mujoco),
}
"""What scenes are exported to, by name."""
