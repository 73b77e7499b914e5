"""Flow: identify one problem by several methods and seeds."""

from __future__ import annotations

from itertools import product
from typing import Any

from prefect import flow
from shoal.identification import load_problem
from shoal.identification.methods import get_method

from shoal_flows.flows.runner import side_by_side
from shoal_flows.flows.study import open_running
from shoal_flows.flows.tasks import measure
from shoal_flows.jobs import Cell
from shoal_flows.pictures import draw_convergence, draw_residuals
from shoal_flows.results import Study


@flow(name="identify", flow_run_name="identify {problem}", task_runner=side_by_side())
def identify(
    problem: str = "paper-case-1",
    methods: list[str] = ["auto"],  # noqa: B006 - Prefect shows the default in its form; nothing changes it
    seeds: list[int] = [0],  # noqa: B006
    data: str | None = None,
    engine: str = "gauss",
    values: dict[str, Any] = {},  # noqa: B006
) -> Study:
    """Find the parameters of a problem from measured motion, by every method with every seed.

    Args:
        problem: Built-in problem, or the path of a YAML file.
        methods: Methods to use, such as least-squares, afsa, iafsa, iafsa-printed, casadi.
        seeds: Seeds of the random numbers; each method runs once with each.
        data: CSV recording, for problems that do not bring their own data.
        engine: Engine that simulates the model.
        values: Fields of the scene to set, as {path: value}, such as {"bodies.OA.elements": 8}.
    """
    for method in methods:
        get_method(method)
    load_problem(problem).load_scene(values)
    cells = [Cell(problem, method, seed, engine, values) for method, seed in product(methods, seeds)]
    measurement = measure(problem, data)
    with open_running(f"{problem} · identify", cells, measurement) as study:
        for cell in cells:
            study.submit(cell)
        return study.finish(problem, {"convergence": draw_convergence, "residuals": draw_residuals})
