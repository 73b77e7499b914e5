"""Flow: one scene as files of other tools."""

from __future__ import annotations

from prefect import flow

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import Forms, Paths, SceneName, Values
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import write
from shoal_flows.inputs import held, title
from shoal_flows.results import Exported


@flow(name="export", flow_run_name=named("export", "scene"))
def export(
    scene: SceneName = "flexible-double-pendulum",
    to: Forms = ["exudyn"],  # noqa: B006 - as `values`
    verify: bool = True,
    parameters: Paths = [],  # noqa: B006 - as `values`
    inputs: Paths = [],  # noqa: B006 - as `values`
    values: Values = {},  # noqa: B006 - Prefect shows the default in its form; nothing changes it
) -> Exported:
    """Write a scene as files of other tools; they are artifacts of the run in MLflow, in its folder `export`.

    Args:
        scene: The machine: a name (see `shoal scenes`), or its YAML.
        to: A script for Exudyn, MuJoCo's mjcf, a unit of FMI 2.0 (fmu), or the motion as a table (csv, parquet, nc).
        verify: Whether another tool's motion is compared with Shoal's, and the errors of a motion are estimated.
        parameters: Of a unit: numbers of the scene that a host may set; else gravity and the initial angles.
        inputs: Of a unit: loads and drives that a host may change during the run.
        values: Fields of the scene to set, as {path: value}, such as {"solver.duration": 0.5}.
    """
    scene = held("scene", "scenes", scene)
    name = title(scene)
    with progress(1, f"{name} for {', '.join(to)}"):
        result = Exported(*write(scene, to, values, {"verify": verify, "parameters": parameters, "inputs": inputs}))
    show_result(f"{name} for {', '.join(to)}", tables.of_exports(result.answer), result)
    return ended(result)
