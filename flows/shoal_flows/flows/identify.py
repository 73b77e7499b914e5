"""Flow: identify one problem by several methods and seeds."""

from __future__ import annotations

from itertools import product

from prefect import flow
from shoal.identification import load_problem
from shoal.identification.methods import get_method
from shoal.requests.identify import Identify

from shoal_flows.flows.parameters import Methods, Own, Seeds, form
from shoal_flows.flows.runner import side_by_side
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.study import open_running
from shoal_flows.flows.tasks import measure
from shoal_flows.inputs import title
from shoal_flows.jobs import Cell
from shoal_flows.pictures import draw_convergence, draw_residuals, draw_trajectory
from shoal_flows.results import Study
from shoal_flows.tracking.identification import answer, summary

_OWN = {
    "methods": Own(Methods, ["auto"], "Methods of the search; auto chooses by the problem."),
    "seeds": Own(Seeds, [0], "Of the random numbers; every method runs once with each."),
}


@flow(name="identify", flow_run_name=named("identify", "problem"), task_runner=side_by_side())
@form("identify", without=("method", "seed"), own=_OWN, problem="paper-case-1")
def identify(asked: Identify, methods: Methods, seeds: Seeds) -> Study:
    """Find the parameters of a problem from measured motion, by every method with every seed."""
    for method in methods:
        get_method(method)
    problem, data = str(asked.problem), str(asked.data or "") or None
    load_problem(problem).load_scene(asked.set)
    name = title(problem)
    cells = [
        Cell(
            *(problem, *one, asked.engine, dict(asked.set or {})),
            tolerance=asked.tolerance,
            sample=asked.sample,
            profiles=asked.profiles,
            bootstrap=asked.bootstrap,
            time_limit=asked.time_limit,
        )
        for one in product(methods, seeds)
    ]
    measurement = measure(problem, data, asked.hold_out)
    pictures = {"convergence": draw_convergence, "trajectory": draw_trajectory, "residuals": draw_residuals}
    with (
        progress(len(cells), f"{name}: optimisations") as bar,
        open_running(f"{name} · identify", cells, measurement) as study,
    ):
        for cell in cells:
            study.submit(cell)
        found = study.finish(name, pictures, ended=bar.advance)
        study.publish(found)
        show_result(name, summary(found.fits, found.failures), found, answer(found.fits))
        study.check_any()
    return ended(found)
