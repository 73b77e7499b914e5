"""Ways to solve Gauss's principle side by side: the compiled ones, and the paper's swarms at every time step.

Two tables. The first, on the double pendulum, has no singular position: cost and accuracy of every solver with the
same time step of semi-implicit Euler (`python -m shoal_validation.ablation` takes the swarms apart). The second drives
a linkage of two four-bars through its singular positions, with and without removal of drift, against the closed form:
coupled cranks are one pendulum whose angle from the upright obeys phi'' = kappa sin phi, phi = 2 am(t/2 | -4 kappa).
The compiled solvers go by rk4 for 10 s, ten passages. The swarms go by the paper's time step, whose own error grows to
a metre within 3 s at any step that a swarm can afford; so they go for 1.5 s, two passages, and are held against
projection by the same step.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp
from shoal.engines import swarm_motion
from shoal.engines.capabilities import is_moved_by_swarm
from shoal.engines.swarm_motion import SwarmSettings, Switches
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array, Status, Trajectory

COMPILED = ("projection", "kkt", "augmented-lagrangian", "proximal", "baumgarte")
SWARMS = ("afsa", "iafsa", "iafsa-printed")
EULER = "semi-implicit-euler"
UNSEEDED = {"seed_traditional": False, "seed_previous": False}
ABLATIONS: dict[str, dict[str, bool]] = {"": {}, "no seeds": UNSEEDED}
FORGETFUL = {"iafsa-printed": {"P_g of step 3-7": {"keep_best": False}}}

LOOPS = 2
GRAVITY = 9.81
KAPPA = GRAVITY * ((LOOPS + 1) / 2 + LOOPS) / ((LOOPS + 1) / 3 + LOOPS)
"""1/s^2; LOOPS + 1 cranks and LOOPS couplers, uniform bars of 1 kg and 1 m."""

COMPILED_STEP, COMPILED_DURATION = 1e-3, 10.0
SWARM_STEP, SWARM_DURATION = 2e-3, 1.5
"""s; a swarm needs 10 ms and more for each step."""

LONGER = 20
"""Steps over which compiled solvers are timed, in terms of those of a swarm."""
TURNED = 0.1
"""A coupler that has turned so far [rad] has left the branch on which it only translates."""
DRIFTED = 1e-6
"""Constraints violated by more have drifted."""
OFF = 1e-3
"""A crank that ends farther from where projection leads it by the same time step [m] is wrong."""


@dataclass(frozen=True)
class CostRow:
    """One solver on one machine, all with the same time step.

    seconds: per time step; evaluations: of the acceleration, or by a swarm of Gauss's function, per time step
    error: mean relative error of the acceleration in the mass metric, nan where it is not sought by a swarm
    path: largest distance of a marker from where projection leads [m]
    """

    name: str
    seconds: float
    evaluations: float
    error: float
    path: float
    status: Status


@dataclass(frozen=True)
class PassageRow:
    """One solver through the singular positions.

    error, off: distance at the end [m] to the closed form, and to projection by the same step with removal of drift
    """

    name: str
    integrator: str
    step: float
    project: bool
    error: float
    off: float
    energy_drift: float
    constraint_drift: float
    status: Status
    verdict: str


def measure_cost(scene_name: str, step: float, steps: int, solvers: tuple[str, ...] = COMPILED) -> Iterator[CostRow]:
    """Compiled solvers and swarms, seeded and not, on one scene; a row as soon as it is known."""
    # Released from rest: semi-implicit Euler is off by percents of the little energy that the first steps bring.
    settings = {"solver.integrator": EULER, "solver.step": step, "solver.duration": steps * step}
    settings |= {"solver.energy_tolerance": 0.1}
    scene = load_scene(scene_name).with_values(settings)
    times = np.linspace(0.0, steps * step, 11)[1:]
    true = simulate(scene, times)
    for solver in solvers:
        yield cost(solver, with_solver(scene, solver), times, true, None)
    for solver in SWARMS:
        parts = {"": {}} if solver == "afsa" else {**ABLATIONS, **FORGETFUL.get(solver, {})}
        for name, switches in parts.items():
            search = SwarmSettings(switches=Switches(**switches))
            yield cost(", ".join(filter(None, (solver, name))), with_solver(scene, solver), times, true, search)


def cost(name: str, scene: Scene, times: Array, true: Trajectory, search: SwarmSettings | None) -> CostRow:
    """One row; the time of compiled solvers is taken over more steps, after the call that compiles them."""
    run = simulate(scene, times) if search is None else swarm_motion.simulate(scene, times, search)
    seconds = run.wall_s / run.steps
    if search is None:
        longer = simulate(scene, LONGER * times)
        seconds = longer.wall_s / longer.steps
    swarm = run.model.get("swarm", {"evaluations": run.model["evaluations"], "error": np.nan})
    path = run.distance(true)
    return CostRow(name, seconds, swarm["evaluations"] / run.steps, swarm["error"], path, run.status[0])


def measure_passage() -> Iterator[PassageRow]:
    """Every solver with and without removal of drift; a row as soon as it is known."""
    euler = (EULER, SWARM_STEP, SWARM_DURATION)
    for project in (True, False):
        for solver in COMPILED:
            yield passage(solver, "rk4", COMPILED_STEP, COMPILED_DURATION, project)
        for solver in ("projection", "kkt", "baumgarte", *SWARMS):
            yield passage(solver, *euler, project)
        for solver in SWARMS[1:]:
            yield passage(solver, *euler, project, "no seeds")


def passage(
    solver: str, integrator: str, step: float, duration: float, project: bool, ablation: str = ""
) -> PassageRow:
    """One solver through the singular positions of the linkage."""
    end = np.linspace(0.0, duration, 101)[1:]
    scene = _moving(integrator, step, duration).with_values({"solver.project": project, "solver.acceleration": solver})
    if is_moved_by_swarm(scene):
        run = swarm_motion.simulate(scene, end, SwarmSettings(switches=Switches(**ABLATIONS[ablation])))
    else:
        run = simulate(scene, end)
    place = run.marker("B0")[-1]
    off = float(np.linalg.norm(place - _projected(integrator, step, duration)))
    return PassageRow(
        ", ".join(filter(None, (solver, ablation))), integrator, step, project,
        float(np.linalg.norm(place - crank_end(end)[-1])), off,
        float(run.energy_drift[0]), float(run.constraint_drift[0]), run.status[0], verdict(run, off),
    )  # fmt: skip


def verdict(run: Trajectory, off: float) -> str:
    """Class of a passage by its distance [m] at the end from that of projection."""
    if not np.all(np.isfinite(run.points)):
        return "diverged"
    if max(np.max(np.abs(np.sin(run.angle(f"coupler{k}")))) for k in range(1, LOOPS + 1)) > TURNED:
        return "wrong branch"
    if run.constraint_drift[0] > DRIFTED:
        return "drifted"
    if off > OFF:
        return "silently wrong" if run.ok else "wrong, and said so"
    return "ok" if run.ok else "as projection"


def _moving(integrator: str, step: float, duration: float) -> Scene:
    settings = {"solver.integrator": integrator, "solver.step": step, "solver.duration": duration}
    return linkage().with_values(settings)


@cache
def _projected(integrator: str, step: float, duration: float) -> Array:
    """End of the crank by projection with removal of drift [m], (2,)."""
    end: Array = simulate(_moving(integrator, step, duration), np.array([duration])).marker("B0")[-1]
    return end


@cache
def linkage() -> Scene:
    """The N-four-bar with markers that show whether its couplers turn."""
    scene = load_scene(f"n-four-bar-{LOOPS}")
    watched = {f"coupler{k}": {"body": f"coupler{k}", "point": "end"} for k in range(1, LOOPS + 1)}
    data = scene.model_dump(mode="json")
    return Scene.parse({**data, "markers": {**data["markers"], **watched}})


def crank_end(times: Array) -> Array:
    """B0 = (sin phi, cos phi) [m], (samples, 2); phi [rad] by scipy to 13 digits."""

    def rate(_time: float, y: Array) -> Array:
        return np.array([y[1], KAPPA * np.sin(y[0])])

    run = solve_ivp(rate, (0.0, float(times[-1])), [0.0, 1.0], "DOP853", times, rtol=1e-13, atol=1e-13)
    return np.stack([np.sin(run.y[0]), np.cos(run.y[0])], axis=1)


def with_solver(scene: Scene, solver: str) -> Scene:
    """The scene with another way to the acceleration."""
    return scene.with_values({"solver.acceleration": solver})


def print_cost(console: Console, title: str, rows: Iterator[CostRow]) -> None:
    """The first table."""
    table = Table(title, "ms a step", "evaluations a step", "error of a", "off path, m", "status", box=box.SIMPLE_HEAD)
    for row in rows:
        error = "" if np.isnan(row.error) else f"{row.error:.1e}"
        table.add_row(
            row.name, f"{row.seconds * 1e3:.4f}", f"{row.evaluations:.0f}", error, f"{row.path:.1e}", str(row.status)
        )
    console.print(table)


def print_passage(console: Console, rows: Iterator[PassageRow]) -> None:
    """The second table."""
    heads: tuple[str, ...] = ("singular passage", "step", "drift removed", "error, m", "off projection, m")
    heads += ("energy", "constraints", "status", "verdict")
    table = Table(*heads, box=box.SIMPLE_HEAD)
    for row in rows:
        numbers = (f"{row.error:.1e}", f"{row.off:.1e}", f"{row.energy_drift:.1e}", f"{row.constraint_drift:.1e}")
        how = f"{row.integrator} {row.step:g} s"
        table.add_row(row.name, how, "yes" if row.project else "no", *numbers, str(row.status), row.verdict)
    console.print(table)


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    console = Console(highlight=False, width=160)
    print_cost(console, "rigid double pendulum, 1e-3 s", measure_cost("rigid-double-pendulum", 1e-3, 100))
    print_cost(
        console, "flexible double pendulum, 5e-4 s", measure_cost("flexible-double-pendulum", 5e-4, 100, COMPILED[:1])
    )
    print_passage(console, measure_passage())


if __name__ == "__main__":
    main()
