"""Flow: where one scene comes to rest."""

from __future__ import annotations

from prefect import flow
from shoal.requests.statics import Statics

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import form
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import at_rest
from shoal_flows.inputs import title
from shoal_flows.results import AtRest


@flow(name="statics", flow_run_name=named("statics", "scene"))
@form("statics", scene="flexible-double-pendulum")
def statics(asked: Statics) -> AtRest:
    """Find where a scene comes to rest, and whether it is stable there."""
    name = title(str(asked.scene))
    with progress(1, f"{name} at rest"):
        result = AtRest(*at_rest(asked))
    show_result(f"{name} at rest", tables.of_equilibrium(result.answer), result)
    return ended(result)
