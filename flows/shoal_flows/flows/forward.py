"""Flow: the motion of one scene."""

from __future__ import annotations

from prefect import flow

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import EngineName, SceneName, Values
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import simulate
from shoal_flows.inputs import held, title
from shoal_flows.results import Simulated


@flow(name="forward", flow_run_name=named("forward", "scene"))
def forward(
    scene: SceneName = "flexible-double-pendulum",
    engine: EngineName = "gauss",
    values: Values = {},  # noqa: B006 - Prefect shows the default in its form; nothing changes it
) -> Simulated:
    """Simulate a scene on one engine and log its motion.

    Args:
        scene: The machine to simulate: a name (see `shoal scenes`), or its YAML.
        engine: Who simulates; gauss is Shoal's own solver.
        values: Fields of the scene to set, as {path: value}, such as {"bodies.OA.elements": 8}.
    """
    scene = held("scene", "scenes", scene)
    name = title(scene)
    with progress(1, f"{name} on {engine}"):
        result = Simulated(*simulate(scene, engine, values))
    show_result(f"{name} on {engine}", tables.of_motion(result.motion), result)
    return ended(result)
