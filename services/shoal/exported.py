"""Scenes as files of other tools, with which one goes on from there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from shoal.engines import get_engine
from shoal.engines.contract import sampling_times
from shoal.errors import ComputationError, InputError
from shoal.scene import Scene
from shoal.trajectory import Trajectory
from shoal.whole import whole


@dataclass(frozen=True)
class Tool:
    """ending: of its files; text: a scene as the content of one; run: the motion that the tool makes of the scene."""

    ending: str
    text: Callable[[Scene], str]
    run: Callable[[Scene], Trajectory]


@dataclass(frozen=True)
class Exported:
    """A file, and how far the tool's motion is from the native one at most [m], if that was asked for."""

    file: Path
    distance: float | None


def export(scene: Scene, to: str, out: Path | None = None, *, verify: bool = True) -> Exported:
    """Write a scene as a file of another tool, one of `TOOLS`.

    out: the file, else the scene's name in the working folder; verify: run it there and here, and compare.
    Raises InputError that names what the tool has not, ComputationError where a run fails or the file is not written.
    """
    if to not in TOOLS:
        raise InputError(f"to: no tool {to!r}; there are {', '.join(TOOLS)}")
    tool = TOOLS[to]
    target = out or Path(f"{scene.name}{tool.ending}")
    if target.suffix != tool.ending:
        raise InputError(f"out: {target} ends in {target.suffix or 'nothing'}; {to} has {tool.ending}")
    text = tool.text(scene)
    distance = _compared(tool, scene) if verify else None
    with whole(target) as part:
        part.write_text(text, encoding="utf-8")
    return Exported(target, distance)


def _compared(tool: Tool, scene: Scene) -> float:
    theirs = tool.run(scene)
    ours = get_engine("gauss").simulate(scene)
    for motion in (theirs, ours):
        if not motion.ok:
            raise ComputationError(f"{scene.name}: {motion.message}; --no-verify writes the file all the same")
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
