"""Flow: the cheapest model of one scene that meets a tolerance."""

from __future__ import annotations

from prefect import flow
from shoal.requests.select import Select

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import form
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import select as task
from shoal_flows.inputs import title
from shoal_flows.results import Selected


@flow(name="select", flow_run_name=named("select", "scene"))
@form("select", scene="flexible-double-pendulum", tolerance=1e-3)
def select(asked: Select) -> Selected:
    """Find the cheapest model whose estimated error at the markers is below a tolerance, and log its motion."""
    what = f"{title(str(asked.scene))} within {asked.tolerance:g} m"
    with progress(1, what):
        result = Selected(*task(asked))
    show_result(what, tables.of_selection(result.answer), result)
    return ended(result)
