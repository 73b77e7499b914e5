"""Motions of a scene: one, over a grid of values, on several engines."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from shoal.commands import options
from shoal.commands.command import command
from shoal.commands.options import Out
from shoal.errors import check_trusted

if TYPE_CHECKING:
    from shoal.requests.compare import Compare
    from shoal.requests.simulate import Simulate
    from shoal.requests.sweep import Sweep


@command("simulate")
@options.as_json
@options.out(".html", ".gif", ".png", ".csv", ".parquet", ".nc", ".json")
@options.emphasis
def simulate(asked: Simulate, as_json: bool, out: Out, magnify: float | None, stress: bool) -> None:
    """Say where the markers of SCENE go, and how far to trust it."""
    from shoal.engines.theory import rigid_runs
    from shoal.notebook import machine, motion
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    scene = machine(asked, options.note)
    emphasis = options.emphasised(scene, out, magnify, stress)
    what = f"simulating {scene.name} with {asked.engine}"
    what = what if asked.tolerance is None else f"{scene.name}: looking for the cheapest model"
    with screen.working(what) as tell:
        if asked.tolerance is None:
            screen.compile_for(asked.engine, [1], scene, *(rigid_runs(scene) if asked.verify else ()))
        trajectory, scene, selection = motion(asked, scene, lambda said: tell(f"{scene.name}: {said}"))
    if out is not None:
        files.trajectory(trajectory, scene, out, selection, **emphasis)
    report = trajectory.to_json() | ({} if selection is None else {"selection": selection.to_json()})
    screen.show(report, as_json, lambda: tables.trajectory_table(trajectory, scene, selection))
    check_trusted(trajectory.ok, trajectory.message)


@command("sweep")
@options.as_json
@options.out(".csv", ".parquet", ".nc", ".json", ".png")
def sweep(asked: Sweep, as_json: bool, out: Out) -> None:
    """Marker positions of SCENE over a grid of values. At one instant; the paper's Figure 4, for example."""
    from shoal.notebook import machine, sweep
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    scene = machine(asked, options.note)
    with screen.working(f"sweeping {scene.name}"):
        screen.compile_for(asked.engine, [1, 2], scene)
        result = sweep.answer(asked.of(scene))
    options.finish(result, as_json, out, files.sweep, tables.sweep_table, result.complaint)


@command("compare")
@options.as_json
@options.out(".json", ".png")
def compare(asked: Compare, as_json: bool, out: Out) -> None:
    """Run SCENE on several engines and show how far apart they are."""
    from shoal.engines.compare import compared
    from shoal.notebook import compare, machine
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    scene = machine(asked, options.note)
    names = list(compared(scene) if asked.engines is None else asked.engines)
    with screen.working(f"running {scene.name} on {', '.join(names)}"):
        for name in names:
            screen.compile_for(name, [1], scene)
        comparison = compare.answer(replace(asked.of(scene), engines=names))
    options.finish(comparison, as_json, out, files.comparison, tables.comparison_table, comparison.complaint)
