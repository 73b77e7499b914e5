"""Flow: where one scene comes to rest."""

from __future__ import annotations

from prefect import flow

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import SceneName, Size, Time, Values
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import at_rest
from shoal_flows.inputs import held, title
from shoal_flows.results import AtRest


@flow(name="statics", flow_run_name=named("statics", "scene"))
def statics(
    scene: SceneName = "flexible-double-pendulum",
    time: Time = 0.0,
    tolerance: Size = None,
    values: Values = {},  # noqa: B006 - Prefect shows the default in its form; nothing changes it
) -> AtRest:
    """Find where a scene comes to rest, and whether it is stable there.

    Args:
        scene: The machine: a name (see `shoal scenes`), or its YAML.
        time: What is applied stands as it is at this instant [s].
        tolerance: Refine the mesh until its error stays below [m]; the scene's own mesh without one.
        values: Fields of the scene to set, as {path: value}, such as {"bodies.OA.elements": 8}.
    """
    scene = held("scene", "scenes", scene)
    name = title(scene)
    with progress(1, f"{name} at rest"):
        result = AtRest(*at_rest(scene, time, tolerance, values))
    show_result(f"{name} at rest", tables.of_equilibrium(result.answer), result)
    return ended(result)
