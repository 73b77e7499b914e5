"""Flow: the motion of one scene."""

from __future__ import annotations

from prefect import flow
from shoal.requests.simulate import Simulate

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import form
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import simulate
from shoal_flows.inputs import title
from shoal_flows.results import Simulated


@flow(name="forward", flow_run_name=named("forward", "scene"))
@form("simulate", scene="flexible-double-pendulum")
def forward(asked: Simulate) -> Simulated:
    """Simulate a scene on one engine and log its motion."""
    name = title(str(asked.scene))
    with progress(1, f"{name} on {asked.engine}"):
        result = Simulated(*simulate(asked))
    show_result(f"{name} on {asked.engine}", tables.of_motion(result.answer), result)
    return ended(result)
