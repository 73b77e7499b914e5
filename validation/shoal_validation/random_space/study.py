"""One machine in space, the verdict on its run, and what another program says of that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from shoal.engines import get_engine
from shoal.engines.contract import sampling_times
from shoal.engines.verification import verified
from shoal.errors import ComputationError, InputError
from shoal.scene import Scene
from shoal.selection import select
from shoal.trajectory import Trajectory

from shoal_validation.random_space import linkages
from shoal_validation.random_space.machines import bent, frame, machine, with_directors
from shoal_validation.random_space.newton_euler import NewtonEuler

KINDS = ("chains", "linkages", "directors", "bent", "frames")
BEAMS = ("bent", "frames")
"""Kinds that geometrically exact beams judge."""
RIGID_STEP, CABLE_STEP, BEAM_STEP = 5e-4, 1e-4, 5e-4
"""Of Exudyn as a judge [s]."""
FINER = 4
ATTEMPTS = (1.0, 1e-7), (1.0, 1e-6), (0.2, 1e-6)
"""Parts of these steps, and where its iterations stop: round-off of stiff cables may reach no further."""
MESHES = 16, 32
"""Elements of every rod of the judge of a tolerance: of two runs, which say how well it knows."""


@dataclass(frozen=True)
class Judged:
    """Verdict on a machine, and whether it is right.

    verdict: right, wrong and called right, refused, not met (no answer at all), or not judged; judge: its name
    """

    seed: int
    verdict: str
    judge: str
    told: str

    def __str__(self) -> str:
        return f"{self.seed:4d} {self.verdict:22s} {self.judge:12s} {self.told}"


@dataclass(frozen=True)
class _Opinion:
    """Answer of a reference: its motion or why it has none, and its own error, as a part of the scale and in m."""

    judge: str
    motion: Trajectory | Mapping[str, Any] | str
    share: float = 2e-3
    known: float = 0.0

    @property
    def silence(self) -> str:
        """Reason for a missing motion; empty if there is one."""
        if isinstance(self.motion, str):
            return self.motion
        bad = isinstance(self.motion, Trajectory) and not self.motion.ok
        return f"{self.motion.status[0]}: {self.motion.message}" if bad and isinstance(self.motion, Trajectory) else ""

    def away(self, run: Trajectory) -> float:
        """The largest distance of a marker at an instant [m]."""
        if isinstance(self.motion, Trajectory):
            return run.distance(self.motion)
        assert not isinstance(self.motion, str)
        return max(float(np.max(np.abs(run.marker(name) - places))) for name, places in self.motion.items())


def judged(seed: int, kind: str = "chains") -> Judged:
    """Run and judge the machine of a seed, see KINDS."""
    name, scene = drawn(seed, kind)
    try:
        run = verified(get_engine("gauss"), scene)
    except (InputError, ComputationError) as error:
        return Judged(seed, "not met", "", f"{name}{error}")
    if not run.ok:
        return Judged(seed, "refused", "", f"{name}{run.status[0]}: {run.message}")
    opinion = (
        _by_newton_and_euler(seed) if kind == "linkages" else _by_beams(scene) if kind in BEAMS else _by_engines(scene)
    )
    if opinion.silence:
        return Judged(seed, "not judged", opinion.judge, name + opinion.silence)
    told = run.model["verification"]
    if told["time_error"] is None:
        return Judged(seed, "not met", opinion.judge, f"{name}not estimated: {told['note']}")
    away = opinion.away(run)
    meshed = opinion.judge in ("finer", "beams")
    allowed = (
        3 * (told["time_error"] + (told["mesh_error"] or 0.0) * meshed) + opinion.share * told["scale"] + opinion.known
    )
    verdict = "right" if away <= allowed else "wrong and called right"
    return Judged(seed, verdict, opinion.judge, f"{name}{away:.2g} m away, allowed {allowed:.2g} m")


def drawn(seed: int, kind: str) -> tuple[str, Scene]:
    """Name of a machine where it has one, and the machine."""
    if kind == "linkages":
        name, data = linkages.drawn(seed)
        return f"{name}: ", Scene.parse(data)
    scene = {"bent": bent, "frames": frame}.get(kind, machine)(seed)
    return "", with_directors(scene) if kind == "directors" else scene


def met(seed: int, tolerance: float, kind: str = "chains") -> Judged:
    """Ask for the machine of a seed, which has flexible rods, within a tolerance [m], and judge by Exudyn's rods."""
    _, scene = drawn(seed, kind)
    times = sampling_times(scene, None)
    try:
        found = select(scene, tolerance, times)
    except (InputError, ComputationError) as error:
        return Judged(seed, "not met", "", str(error))
    if not found.met:
        return Judged(seed, "refused" if not found.trajectory.ok else "not met", "", found.reason)
    opinion = _by_beams(_divided(scene, MESHES[0])) if kind in BEAMS else _by_cables(scene)
    if opinion.silence:
        return Judged(seed, "not judged", opinion.judge, opinion.silence)
    known, away = opinion.known, opinion.away(found.trajectory)
    if known > tolerance / 2:
        return Judged(seed, "not judged", opinion.judge, f"it knows the motion to {known:.2g} m only")
    verdict = "right" if away <= tolerance + known else "wrong and called right"
    return Judged(seed, verdict, opinion.judge, f"{found.chosen.name}: {away:.2g} m away, known to {known:.2g} m")


def _by_newton_and_euler(seed: int) -> _Opinion:
    data = linkages.drawn(seed)[1]
    try:
        return _Opinion("newton-euler", NewtonEuler(data).markers(sampling_times(Scene.parse(data), None)), 1e-6)
    except ArithmeticError as error:
        return _Opinion("newton-euler", str(error))


def _by_engines(scene: Scene) -> _Opinion:
    """`tree` where it can, else Exudyn on the same cables, else on finer ones."""
    rods = scene.flexible_rods
    cables = all(rod.element == "ancf-cable" for rod in rods.values())
    finer = {} if cables else {name: FINER * rod.elements for name, rod in rods.items()}
    try:
        return _Opinion("tree", get_engine("tree").simulate(scene))
    except InputError:
        return _Opinion("finer" if finer else "exudyn", _exudyn(scene, finer))


def _divided(scene: Scene, count: int) -> Scene:
    """Scene with a number of elements of every flexible rod."""
    return scene.with_values({f"bodies.{name}.elements": count for name in scene.flexible_rods})


def _by_cables(scene: Scene) -> _Opinion:
    """Exudyn's cables on the finer of two meshes."""
    coarse, fine = (_exudyn(scene, dict.fromkeys(scene.flexible_rods, count)) for count in MESHES)
    for one in (coarse, fine):
        if (opinion := _Opinion("exudyn", one)).silence:
            return opinion
    assert isinstance(coarse, Trajectory)
    assert isinstance(fine, Trajectory)
    return _Opinion("exudyn", fine, known=coarse.distance(fine))


def _by_beams(scene: Scene) -> _Opinion:
    """Exudyn's geometrically exact beams on these elements and on half as long ones, extrapolated (of second order)."""
    runs = []
    for factor in (1, 2):
        finer = {f"bodies.{name}.elements": factor * rod.elements for name, rod in scene.flexible_rods.items()}
        found = _by_exudyn("exudyn-ge", scene.with_values(finer), BEAM_STEP)
        if isinstance(found, str) or not found.ok:
            return _Opinion("beams", found)
        runs.append(found)
    coarse, fine = runs
    limit = {name: (4 * fine.marker(name) - coarse.marker(name)) / 3 for name in fine.markers}
    return _Opinion("beams", limit, known=coarse.distance(fine) / 3)


def _exudyn(scene: Scene, cables: Mapping[str, int]) -> Trajectory | str:
    """Exudyn with a number of cables for these rods, and the others as stated."""
    values: dict[str, object] = {}
    for rod, count in cables.items():
        values |= {f"bodies.{rod}.element": "ancf-cable", f"bodies.{rod}.elements": count}
    return _by_exudyn("exudyn", scene.with_values(values), CABLE_STEP if scene.flexible_rods else RIGID_STEP)


def _by_exudyn(engine: str, scene: Scene, step: float) -> Trajectory | str:
    """The motion by one of its engines, by the first attempt that ends, or why there is none."""
    try:
        for part, newton in ATTEMPTS:
            values = {"solver.step": part * step, "solver.newton_tolerance": newton}
            found = get_engine(engine).simulate(scene.with_values(values))
            if found.ok:
                break
    except (InputError, ComputationError) as error:
        return str(error)
    return found
