"""One scene through several engines, and how far apart they come out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from shoal.arguments import brief
from shoal.engines import get_engine
from shoal.engines.capabilities import able
from shoal.engines.gauss import GaussEngine
from shoal.engines.penalty import PenaltyStudy, study
from shoal.engines.verification import verify as errors_of
from shoal.engines.verification import with_errors
from shoal.error_budget import ErrorBudget
from shoal.errors import InputError
from shoal.json_values import plain
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

COMPARED = ("gauss", "exudyn", "casadi", "tree")
"""Four derivations of the same equations. The first three that can run a scene are compared unless others are named."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Trajectories by engine; engines that cannot run the scene are in `refused` with their reason.

    verified: the engine whose run was verified, ours where it ran; empty where none was; penalties: runs of engines
    whose contacts give way, with stiffer ones
    """

    scene: Scene
    trajectories: dict[str, Trajectory]
    refused: dict[str, str]
    verified: str = ""
    penalties: dict[str, PenaltyStudy] = field(default_factory=dict)

    @property
    def errors(self) -> ErrorBudget:
        """Known errors of the markers [m] of the run that was verified: engines share the mesh and the theory."""
        return self.trajectories[self.verified].errors if self.verified else ErrorBudget()

    @property
    def ok(self) -> bool:
        """Return whether at least two engines ran and every run may be believed."""
        return len(self.trajectories) >= 2 and not self.refused and all(t.ok for t in self.trajectories.values())

    @property
    def complaint(self) -> str:
        """Return why `ok` is false, every reason in one line; empty if it is true."""
        wrong = {name: motion.explanation for name, motion in self.trajectories.items() if not motion.ok}
        said = [f"{name} refuses the scene: {reason}" for name, reason in self.refused.items()]
        said += [f"{name}: {reason}" for name, reason in wrong.items()]
        if len(self.trajectories) < 2 and not self.refused:
            (only,) = self.trajectories
            others = " or ".join(name for name in able(self.scene) if name != only)
            said.append(
                f"only {only} ran: " + (f"name {others} too" if others else "no other engine can run this scene")
            )
        return "; ".join(said)

    def differences(self) -> list[dict[str, Any]]:
        """Per pair of engines and marker: largest distance over all samples and distance at the end [m]."""
        rows = []
        for (one, a), (other, b) in combinations(self.trajectories.items(), 2):
            for marker in self.scene.markers:
                distance = np.linalg.norm(a.marker(marker) - b.marker(marker), axis=1)
                rows.append(
                    {
                        "engines": [one, other],
                        "marker": marker,
                        "largest": plain(float(np.max(distance))),
                        "final": plain(float(distance[-1])),
                    }
                )
        return rows

    def compliance(self) -> dict[str, dict[str, Any]]:
        """Return by engine whose contacts give way how far from the verified run it ends, see `PenaltyStudy.row`."""
        return {name: one.row(self.trajectories[self.verified]) for name, one in self.penalties.items()}

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal compare --json` prints."""
        return {
            "status": "ok" if self.ok else "failed",
            "scene": self.scene.name,
            "engines": {name: trajectory.to_json() for name, trajectory in self.trajectories.items()},
            "refused": self.refused,
            "error": plain(self.errors.total),
            "errors": self.errors.to_json(),
            "differences": self.differences(),
        } | ({"compliance": self.compliance()} if self.penalties else {})


def compared(scene: Scene) -> list[str]:
    """Return the default engines of a comparison: the native solver and at most two that meet the requirements."""
    return able(scene, COMPARED)[:3]


def compare(
    scene: Scene,
    engines: Sequence[str] | None = None,
    times: Sequence[float] | Array | None = None,
    verify: bool = True,
) -> Comparison:
    """Run a scene on those engines, or on those of `compared`.

    verify: estimate the errors of one run, as engines that agree may be wrong together: of one mesh, of one theory.
    Raises InputError for an unknown engine, or if the scene suits none.
    """
    if engines is not None and (isinstance(engines, str) or not engines):
        raise InputError(f"engines: needs a list of one or more names, found {brief(engines)}")
    chosen = {name: get_engine(name) for name in (compared(scene) if engines is None else engines)}
    trajectories: dict[str, Trajectory] = {}
    refused: dict[str, str] = {}
    for name, engine in chosen.items():
        try:
            trajectories[name] = engine.simulate(scene, times)
        except InputError as error:
            refused[name] = str(error)
    if not trajectories:
        raise InputError(next(iter(refused.values())))
    good = [name for name, motion in trajectories.items() if motion.ok]
    if not verify or not good:
        return Comparison(scene, trajectories, refused)
    native = GaussEngine().name
    looked_at = native if native in good else good[0]
    motion = trajectories[looked_at]
    trajectories[looked_at] = with_errors(
        motion, errors_of(motion, scene, chosen[looked_at] if looked_at == native else None)
    )
    studies = {name: study(chosen[name], scene, trajectories[name]) for name in good if name != looked_at}
    penalties = {name: one for name, one in studies.items() if one is not None}
    return Comparison(scene, trajectories, refused, looked_at, penalties)
