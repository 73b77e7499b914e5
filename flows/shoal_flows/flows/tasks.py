"""The tasks: each is a line around a plain function, run in a worker process, and the logging of its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any, cast

from prefect import task
from prefect.cache_policies import NO_CACHE
from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep, joined, pieces
from shoal.identification import Measurement
from shoal.identification.design import Design
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.requests.compare import Compare
from shoal.requests.design import Design as DesignRequest
from shoal.requests.fmu import Fmu
from shoal.requests.select import Select
from shoal.requests.simulate import Simulate
from shoal.requests.statics import Statics
from shoal.requests.sweep import Sweep as SweepRequest
from shoal.response import Response
from shoal.scene import Scene
from shoal.selection import Selection
from shoal.trajectory import Trajectory

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
def measure(problem: str, data: str | None, hold_out: Any = None) -> Measurement:
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
def run_engines(asked: Compare) -> tuple[Comparison, str, Picture]:
    """One scene on several engines; with its picture and the id of its run."""
    name = inputs.title(str(asked.scene))
    with events.work(f"{name} on {', '.join(asked.engines or ['several engines'])}"):
        with or_failed("Comparison", f"{name} · compare", {"kind": "study", "scene": name}):
            key = fingerprint.of_simulations("compare", asked.machine(), asked.engines, asked.at, asked.verify)
            comparison = remembered.run(key, jobs.answered, "compare", asked)
        marker = tip(list(comparison.scene.markers))
        picture = workers.run(pictures.draw_engines, comparison, marker)
        return comparison, tracked.log_comparison(comparison, picture[0]), picture


@task(task_run_name="simulate", cache_policy=NO_CACHE)
def simulate(asked: Simulate) -> tuple[Trajectory, str, Scene]:
    """One motion, with the id of its run."""
    name = inputs.title(str(asked.scene))
    with events.work(f"{name} on {asked.engine}"):
        with or_failed("Forward", f"{name} · {asked.engine}", {"kind": "forward", "scene": name}):
            motion, wanted, selection = workers.run(jobs.simulated, asked)
        album = workers.run(pictures.moved, motion, wanted, selection)
        return motion, tracked.log_forward(wanted, motion, album), wanted


@task(task_run_name="statics", cache_policy=NO_CACHE)
def at_rest(asked: Statics) -> tuple[Equilibrium, str]:
    """Return the equilibrium of a scene, with the id of its run."""
    name = inputs.title(str(asked.scene))
    with events.work(f"{name} at rest"):
        with or_failed("Statics", f"{name} · statics", {"kind": "statics", "scene": name}):
            found = workers.run(jobs.answered, "statics", asked)
        return found, analyses.log_statics(found, workers.run(pictures.rested, found))


@task(task_run_name="select", cache_policy=NO_CACHE)
def select(asked: Select) -> tuple[Selection, str]:
    """The cheapest model that meets a tolerance, with the id of its run."""
    name = inputs.title(str(asked.scene))
    with events.work(f"{name} within {asked.tolerance:g} m"):
        with or_failed("Selection", f"{name} · select", {"kind": "selection", "scene": name}):
            found = workers.run(jobs.answered, "select", asked)
        album = workers.run(pictures.moved, found.trajectory, found.chosen.scene, found)
        return found, analyses.log_selection(found, album)


@task(task_run_name="design", cache_policy=NO_CACHE)
def plan(asked: DesignRequest) -> tuple[Design, str]:
    """Return the design of an experiment, with the id of its run."""
    name = inputs.title(str(asked.problem))
    with events.work(f"a measurement for {name}"):
        with or_failed("Design", f"{name} · design", {"kind": "design", "problem": name}):
            found = workers.run(jobs.answered, "design", asked)
        return found, analyses.log_design(found)


@task(task_run_name="uncertain", cache_policy=NO_CACHE)
def respond(study: str, fields: Mapping[str, Any]) -> tuple[Response, str]:
    """Return the response of a machine with uncertain parameters, with the id of its run."""
    name = inputs.title(study)
    with events.work(f"{name}: uncertain response"):
        with or_failed("Uncertain", f"{name} · uncertain", {"kind": "uncertain"}):
            found, album = workers.run(pictures.responded, study, fields)
        return found, responses.log_response(name, found, album)


@task(task_run_name="export", cache_policy=NO_CACHE)
def write(asked: Fmu, to: Sequence[str], verify: bool) -> tuple[Exports, str]:
    """Files of a scene, with the id of the run that keeps them."""
    name = inputs.title(str(asked.scene))
    with events.work(f"{name} for {', '.join(to)}"):
        with or_failed("Export", f"{name} · export", {"kind": "export", "scene": name}):
            found = workers.run(exported, asked, to, verify)
        return found, analyses.log_exports(found)


@task(task_run_name="sweep", cache_policy=NO_CACHE)
def run_grid(asked: SweepRequest) -> tuple[Sweep, str]:
    """One scene over a grid, with the id of its run."""
    name = inputs.title(str(asked.scene))
    with events.work(f"{name} over {', '.join(asked.vary)}"):
        with or_failed("Sweep", f"{name} · sweep", {"kind": "sweep", "scene": name}):
            result = joined([part.result() for part in _parts(asked)])
            if asked.verify:
                result = workers.run(jobs.spot_checked, result, asked.engine)
        return result, tracked.log_sweep(result)


def _parts(asked: SweepRequest) -> Sequence[Future[Sweep]]:
    """The grid in pieces, each a computation of its own, which is found again if the whole is broken off."""
    scene, grids = asked.machine(), pieces(cast(Any, asked.vary), workers.count())
    listed = [{path: values.tolist() for path, values in grid.items()} for grid in grids]
    keys = [fingerprint.of_simulations("sweep", scene, repr(grid), asked.engine, asked.at) for grid in listed]
    with ThreadPoolExecutor(len(grids)) as waiting:
        return [
            waiting.submit(remembered.run, key, jobs.swept, replace(asked, vary=grid))
            for key, grid in zip(keys, grids, strict=True)
        ]
