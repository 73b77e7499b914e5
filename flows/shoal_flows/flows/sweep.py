"""Flow: one scene over a grid of values."""

from __future__ import annotations

from prefect import flow

from shoal_flows.flows.tasks import run_grid
from shoal_flows.results import Swept


@flow(name="sweep", flow_run_name="sweep {scene}")
def sweep(
    scene: str = "flexible-double-pendulum",
    vary: dict[str, tuple[float, float, int]] = {"initial.OA.angle": (0.0, 1.5, 61)},  # noqa: B006 - shown in a form
    engine: str = "gauss",
    time: float | None = None,
) -> Swept:
    """Simulate a scene over the full grid of some of its values and log where its markers have moved.

    Args:
        scene: Built-in scene, or the path of a YAML file.
        vary: What to vary, as {path: [low, high, count]}.
        engine: Engine that simulates it.
        time: Instant [s] at which to look; the end of the scene's duration if left out.
    """
    return Swept(*run_grid(scene, vary, engine, time))
