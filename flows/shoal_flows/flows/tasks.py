"""The tasks: each is a line around a plain function, run in a worker process, and the logging of its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from prefect import task
from prefect.cache_policies import NO_CACHE
from shoal import notebook
from shoal.engines.compare import Comparison
from shoal.engines.pieces import joined, pieces
from shoal.engines.sweep import Sweep
from shoal.identification import Measurement
from shoal.identification.design import Design
from shoal.identification.measure import Windows
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.response import Response
from shoal.scene import Scene
from shoal.selection import Selection
from shoal.trajectory import Array, Trajectory

from shoal_flows import events, fingerprint, inputs, jobs, pictures, remembered, workers
from shoal_flows.exports import Exports, exported
from shoal_flows.jobs import Cell, Fit
from shoal_flows.pictures import Picture
from shoal_flows.tracking import analyses, responses
from shoal_flows.tracking import engines as tracked
from shoal_flows.tracking.identification import log_fit
from shoal_flows.tracking.motion import tip
from shoal_flows.tracking.store import or_failed


@task(task_run_name="measure", cache_policy=NO_CACHE)
def measure(problem: str, data: str | None, hold_out: Windows | None = None) -> Measurement:
    """The motion to fit."""
    with events.work(f"data of {inputs.title(problem)}"):
        return workers.run(jobs.measured, problem, data, hold_out)


@task(task_run_name="{cell.title} {cell.name}", cache_policy=NO_CACHE)
def optimise(cell: Cell, measurement: Measurement, study: str) -> Fit:
    """One optimisation, logged as a child of the run `study`."""
    with events.work(f"{cell.title}, {cell.name}"):
        fit, album = remembered.run(fingerprint.of_cell(cell, measurement), pictures.fitted, cell, measurement)
        log_fit(fit, album, study)
        return fit


@task(task_run_name="compare", cache_policy=NO_CACHE)
def run_engines(
    scene: str, engines: Sequence[str] | None, values: Mapping[str, Any]
) -> tuple[Comparison, Picture, str]:
    """One scene on several engines; with its picture and the id of its run."""
    name = inputs.title(scene)
    with events.work(f"{name} on {', '.join(engines or ['several engines'])}"):
        with or_failed("Comparison", f"{name} · compare", {"kind": "study", "scene": name}):
            key = fingerprint.of_simulations("compare", scene, values, tuple(engines or ()))
            comparison = remembered.run(key, jobs.compared, scene, engines, values)
        marker = tip(list(comparison.scene.markers))
        picture = workers.run(pictures.draw_engines, comparison, marker)
        return comparison, picture, tracked.log_comparison(comparison, picture[0])


@task(task_run_name="simulate", cache_policy=NO_CACHE)
def simulate(scene: str, engine: str, values: Mapping[str, Any]) -> tuple[Scene, Trajectory, str]:
    """One motion, with the id of its run."""
    name = inputs.title(scene)
    with events.work(f"{name} on {engine}"):
        with or_failed("Forward", f"{name} · {engine}", {"kind": "forward", "scene": name}):
            wanted, motion = workers.run(jobs.simulated, scene, engine, values)
        album = workers.run(pictures.moved, motion, wanted)
        return wanted, motion, tracked.log_forward(wanted, motion, album)


@task(task_run_name="statics", cache_policy=NO_CACHE)
def at_rest(scene: str, time: float, tolerance: float | None, values: Mapping[str, Any]) -> tuple[Equilibrium, str]:
    """Return the equilibrium of a scene, with the id of its run."""
    name = inputs.title(scene)
    with events.work(f"{name} at rest"):
        with or_failed("Statics", f"{name} · statics", {"kind": "statics", "scene": name}):
            found = workers.run(notebook.statics, scene, time, values=values, tolerance=tolerance)
        return found, analyses.log_statics(found, workers.run(pictures.rested, found))


@task(task_run_name="select", cache_policy=NO_CACHE)
def select(scene: str, tolerance: float, values: Mapping[str, Any]) -> tuple[Selection, str]:
    """The cheapest model that meets a tolerance, with the id of its run."""
    name = inputs.title(scene)
    with events.work(f"{name} within {tolerance:g} m"):
        with or_failed("Selection", f"{name} · select", {"kind": "selection", "scene": name}):
            found = workers.run(notebook.select, scene, tolerance, values=values)
        album = workers.run(pictures.moved, found.trajectory, found.chosen.scene, found)
        return found, analyses.log_selection(found, album)


@task(task_run_name="design", cache_policy=NO_CACHE)
def plan(problem: str, data: str | None, how: Mapping[str, Any]) -> tuple[Design, str]:
    """Return the design of an experiment, with the id of its run."""
    name = inputs.title(problem)
    with events.work(f"a measurement for {name}"):
        with or_failed("Design", f"{name} · design", {"kind": "design", "problem": name}):
            found = workers.run(notebook.design, problem, data, **how)
        return found, analyses.log_design(found)


@task(task_run_name="uncertain", cache_policy=NO_CACHE)
def respond(study: str, values: Mapping[str, Any]) -> tuple[Response, str]:
    """Return the response of a machine with uncertain parameters, with the id of its run."""
    name = inputs.title(study)
    with events.work(f"{name}: uncertain response"):
        with or_failed("Uncertain", f"{name} · uncertain", {"kind": "uncertain"}):
            found, album = workers.run(pictures.responded, study, values)
        return found, responses.log_response(name, found, album)


@task(task_run_name="export", cache_policy=NO_CACHE)
def write(scene: str, to: Sequence[str], values: Mapping[str, Any], how: Mapping[str, Any]) -> tuple[Exports, str]:
    """Files of a scene, with the id of the run that keeps them."""
    name = inputs.title(scene)
    with events.work(f"{name} for {', '.join(to)}"):
        with or_failed("Export", f"{name} · export", {"kind": "export", "scene": name}):
            found = workers.run(exported, scene, to, values, **how)
        return found, analyses.log_exports(found)


@task(task_run_name="sweep", cache_policy=NO_CACHE)
def run_grid(scene: str, vary: Mapping[str, Array], engine: str, time: float | None) -> tuple[Sweep, str]:
    """One scene over a grid, with the id of its run."""
    name = inputs.title(scene)
    with events.work(f"{name} over {', '.join(vary)}"):
        with or_failed("Sweep", f"{name} · sweep", {"kind": "sweep", "scene": name}):
            whole = joined([part.result() for part in _parts(scene, vary, engine, time)])
            result = workers.run(jobs.spot_checked, whole, engine)
        return result, tracked.log_sweep(result)


def _parts(scene: str, vary: Mapping[str, Array], engine: str, time: float | None) -> Sequence[Future[Sweep]]:
    """The grid in pieces, each a computation of its own, which is found again if the whole is broken off."""
    grids = pieces(vary, workers.count())
    listed = [{path: values.tolist() for path, values in grid.items()} for grid in grids]
    keys = [fingerprint.of_simulations("sweep", scene, {}, repr(grid), engine, time) for grid in listed]
    with ThreadPoolExecutor(len(grids)) as waiting:
        return [
            waiting.submit(remembered.run, key, jobs.swept, scene, grid, engine, time)
            for key, grid in zip(keys, grids, strict=True)
        ]
