"""Flow: identify one problem by several methods and seeds."""

from __future__ import annotations

from itertools import product

from prefect import flow
from shoal.identification import load_problem
from shoal.identification.methods import get_method

from shoal_flows.flows.parameters import Count, Data, EngineName, Length, Methods, ProblemName, Seeds, Values, spans
from shoal_flows.flows.runner import side_by_side
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.study import open_running
from shoal_flows.flows.tasks import measure
from shoal_flows.inputs import held, title
from shoal_flows.jobs import Cell
from shoal_flows.pictures import draw_convergence, draw_residuals, draw_trajectory
from shoal_flows.results import Study
from shoal_flows.tracking.identification import answer, summary


@flow(name="identify", flow_run_name=named("identify", "problem"), task_runner=side_by_side())
def identify(
    problem: ProblemName = "paper-case-1",
    methods: Methods = ["auto"],  # noqa: B006 - Prefect shows the default in its form; nothing changes it
    seeds: Seeds = [0],  # noqa: B006
    data: Data = "",
    engine: EngineName = "gauss",
    values: Values = {},  # noqa: B006
    tolerance: Length = 0.0,
    hold_out: str = "",
    sample: Count = 0,
) -> Study:
    """Find the parameters of a problem from measured motion, by every method with every seed.

    Args:
        problem: Measured channels and unknown parameters: a name (see `shoal problems`), or its YAML.
        methods: Methods of the search; auto chooses by the problem.
        seeds: Of the random numbers; every method runs once with each.
        data: A recording: a name of the library, a path where the worker runs, or the address of one in a service's
            library; empty for the data of the problem.
        engine: Engine of the simulations; gauss is Shoal's own solver.
        values: Fields of the scene to set, as {path: value}, such as {"bodies.OA.elements": 8}.
        tolerance: Error in m that the model may have at the markers; elements, integrator and step are chosen for it;
            0 for the scene's own.
        hold_out: Windows in s that are predicted instead of fitted, such as 0.3 to 0.4, 0.7 to 0.8; empty for those of
            the recording.
        sample: Effective sample size of draws from the posterior; 0 for none.
    """
    for method in methods:
        get_method(method)
    problem, data = held("problem", "problems", problem), held("data", "recordings", data)
    load_problem(problem).load_scene(values)
    name = title(problem)
    windows = spans(hold_out)
    each = product(methods, seeds)
    cells = [Cell(problem, *one, engine, values, tolerance=tolerance or None, sample=sample) for one in each]
    measurement = measure(problem, data or None, windows or None)
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
