"""Flow: what to measure to know the parameters of one problem."""

from __future__ import annotations

from prefect import flow
from shoal.identification import load_problem
from shoal.requests.design import Design

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import form
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import plan
from shoal_flows.inputs import title
from shoal_flows.results import Designed


@flow(name="design", flow_run_name=named("design", "problem"))
@form("design", problem="paper-case-1")
def design(asked: Design) -> Designed:
    """Rank possible measurements by the information that they give about the parameters of a problem."""
    load_problem(str(asked.problem)).load_scene(asked.set)
    name = title(str(asked.problem))
    with progress(1, f"a measurement for {name}"):
        result = Designed(*plan(asked))
    show_result(f"{name}: what to measure", tables.of_design(result.answer), result)
    return ended(result)
