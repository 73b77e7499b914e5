"""Flow: the cheapest model of one scene that meets a tolerance."""

from __future__ import annotations

from prefect import flow

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import SceneName, Tolerance, Values
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import select as task
from shoal_flows.inputs import held, title
from shoal_flows.results import Selected


@flow(name="select", flow_run_name=named("select", "scene"))
def select(
    scene: SceneName = "flexible-double-pendulum",
    tolerance: Tolerance = 1e-3,
    values: Values = {},  # noqa: B006 - Prefect shows the default in its form; nothing changes it
) -> Selected:
    """Find the cheapest model of a scene whose estimated error at the markers is below a tolerance, and log its motion.

    Args:
        scene: The machine to simulate: a name (see `shoal scenes`), or its YAML.
        tolerance: Error that the markers may have [m].
        values: Fields of the scene to set, as {path: value}, such as {"solver.duration": 0.5}.
    """
    scene = held("scene", "scenes", scene)
    name = title(scene)
    with progress(1, f"{name} within {tolerance:g} m"):
        result = Selected(*task(scene, tolerance, values))
    show_result(f"{name} within {tolerance:g} m", tables.of_selection(result.selection), result)
    return ended(result)
