"""Flow: the motion of one scene."""

from __future__ import annotations

from typing import Any

from prefect import flow

from shoal_flows.flows.tasks import simulate
from shoal_flows.results import Simulated


@flow(name="forward", flow_run_name="forward {scene}")
def forward(
    scene: str = "flexible-double-pendulum",
    engine: str = "gauss",
    values: dict[str, Any] = {},  # noqa: B006 - Prefect shows the default in its form; nothing changes it
) -> Simulated:
    """Simulate a scene on one engine and log its motion.

    Args:
        scene: Built-in scene, or the path of a YAML file.
        engine: Engine that simulates it.
        values: Fields of the scene to set, as {path: value}, such as {"initial.OA.angle": 0.7}.
    """
    return Simulated(*simulate(scene, engine, values))
