"""Flow: one scene on several engines."""

from __future__ import annotations

from prefect import flow
from shoal.errors import InputError
from shoal.requests.compare import Compare

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import form
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import run_engines
from shoal_flows.inputs import title
from shoal_flows.results import Compared


@flow(name="compare", flow_run_name=named("compare", "scene"))
@form("compare", scene="flexible-double-pendulum")
def compare(asked: Compare) -> Compared:
    """Simulate a scene on several engines and log how far apart they come out."""
    if asked.engines is not None and len(set(asked.engines)) < 2:
        raise InputError(f"engines: give two different ones or more, found {', '.join(asked.engines)}")
    name = title(str(asked.scene))
    with progress(1, f"{name} on {', '.join(asked.engines or ['several engines'])}"):
        result = Compared(*run_engines(asked))
    show_result(f"{name}: engines", tables.of_comparison(result.answer), result)
    return ended(result)
