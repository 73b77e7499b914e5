"""Flow: one scene on several engines."""

from __future__ import annotations

from typing import Any

from prefect import flow

from shoal_flows.flows.tasks import run_engines
from shoal_flows.results import Compared


@flow(name="compare", flow_run_name="compare {scene}")
def compare(
    scene: str = "flexible-double-pendulum",
    engines: list[str] = ["gauss", "exudyn", "casadi"],  # noqa: B006 - Prefect shows the default in its form
    values: dict[str, Any] = {},  # noqa: B006
) -> Compared:
    """Simulate a scene on several engines and log how far apart they come out.

    Args:
        scene: Built-in scene, or the path of a YAML file.
        engines: Engines to run it on.
        values: Fields of the scene to set, as {path: value}.
    """
    comparison, picture, run_id = run_engines(scene, engines, values)
    return Compared(comparison, run_id, picture)
