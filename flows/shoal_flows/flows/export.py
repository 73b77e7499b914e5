"""Flow: one scene as files of other tools."""

from __future__ import annotations

from prefect import flow
from shoal.requests.fmu import Fmu

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import Forms, Own, form
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import write
from shoal_flows.inputs import title
from shoal_flows.results import Exported

_TO = "A script for Exudyn, MuJoCo's mjcf, a unit of FMI 2.0 (fmu), or the motion as a table (csv, parquet, nc)."
_VERIFY = "Whether another tool's motion is compared with Shoal's, and the errors of a motion are estimated."
_OWN = {"to": Own(Forms, ["exudyn"], _TO), "verify": Own(bool, True, _VERIFY)}


@flow(name="export", flow_run_name=named("export", "scene"))
@form("fmu", own=_OWN, scene="flexible-double-pendulum")
def export(asked: Fmu, to: Forms, verify: bool) -> Exported:
    """Write a scene as files of other tools; they are artifacts of the run in MLflow, in its folder `export`."""
    name = title(str(asked.scene))
    with progress(1, f"{name} for {', '.join(to)}"):
        result = Exported(*write(asked, to, verify))
    show_result(f"{name} for {', '.join(to)}", tables.of_exports(result.answer), result)
    return ended(result)
