"""One machine in space, the verdict on its run, and what another engine says of that."""

from __future__ import annotations

from dataclasses import dataclass

from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import ComputationError, InputError
from shoal.scene import Rod, Scene
from shoal.trajectory import Trajectory

from shoal_validation.random_space.machines import machine

RIGID_STEP, CABLE_STEP = 5e-4, 1e-4
"""Of Exudyn as a judge [s]."""
FINER = 4
NEWTON = 1e-7
"""Where its iterations stop: round-off of stiff cables reaches no further."""


@dataclass(frozen=True)
class Judged:
    """What was said of a machine, and whether it is so.

    verdict: right, wrong and called right, refused, not met (no answer at all), or not judged; judge: its name
    """

    seed: int
    verdict: str
    judge: str
    told: str

    def __str__(self) -> str:
        return f"{self.seed:4d} {self.verdict:22s} {self.judge:12s} {self.told}"


def judged(seed: int) -> Judged:
    """Run and judge the machine of a seed."""
    scene = machine(seed)
    try:
        run = verified(get_engine("gauss"), scene)
    except (InputError, ComputationError) as error:
        return Judged(seed, "not met", "", str(error))
    if not run.ok:
        return Judged(seed, "refused", "", f"{run.status[0]}: {run.message}")
    name, judge = _judge(scene)
    if isinstance(judge, str) or not judge.ok:
        why = judge if isinstance(judge, str) else f"{judge.status[0]}: {judge.message}"
        return Judged(seed, "not judged", name, why)
    told = run.model["verification"]
    if told["time_error"] is None:
        return Judged(seed, "not met", name, f"not estimated: {told['note']}")
    away = run.distance(judge)
    allowed = 3 * (told["time_error"] + (told["mesh_error"] or 0.0) * (name == "finer")) + 2e-3 * told["scale"]
    verdict = "right" if away <= allowed else "wrong and called right"
    return Judged(seed, verdict, name, f"{away:.2g} m away, allowed {allowed:.2g} m")


def _judge(scene: Scene) -> tuple[str, Trajectory | str]:
    """The name of a judge and its run of a scene, or why there is none."""
    rods = {name: body for name, body in scene.bodies.items() if isinstance(body, Rod) and body.element != "rigid"}
    finer = any(body.element == "ancf-quintic" for body in rods.values())
    values: dict[str, object] = {"solver.step": CABLE_STEP if rods else RIGID_STEP, "solver.newton_tolerance": NEWTON}
    if finer:
        for rod, body in rods.items():
            values |= {f"bodies.{rod}.element": "ancf-cable", f"bodies.{rod}.elements": FINER * body.elements}
    try:
        return "tree", get_engine("tree").simulate(scene)
    except InputError:
        name = "finer" if finer else "exudyn"
    try:
        return name, get_engine("exudyn").simulate(scene.with_values(values))
    except (InputError, ComputationError) as error:
        return name, str(error)
