"""Flow: one scene over a grid of values."""

from __future__ import annotations

from prefect import flow
from shoal.requests.sweep import Sweep

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import Axis, form
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import run_grid
from shoal_flows.inputs import title
from shoal_flows.results import Swept

_VARY = [Axis(path="initial.OA.angle", low=0.0, high=1.5, count=61)]


@flow(name="sweep", flow_run_name=named("sweep", "scene"))
@form("sweep", scene="flexible-double-pendulum", vary=_VARY)
def sweep(asked: Sweep) -> Swept:
    """Simulate a scene over the full grid of some of its values and log where its markers have moved."""
    name = title(str(asked.scene))
    with progress(1, f"{name} over {', '.join(asked.vary)}"):
        result = Swept(*run_grid(asked))
    show_result(f"{name}: sweep", tables.of_sweep(result.answer), result)
    return ended(result)
