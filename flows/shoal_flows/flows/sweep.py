"""Flow: one scene over a grid of values."""

from __future__ import annotations

from prefect import flow

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import Axes, Axis, EngineName, Instant, SceneName
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import run_grid
from shoal_flows.inputs import held, title
from shoal_flows.results import Swept


@flow(name="sweep", flow_run_name=named("sweep", "scene"))
def sweep(
    scene: SceneName = "flexible-double-pendulum",
    vary: Axes = [Axis(path="initial.OA.angle", low=0.0, high=1.5, count=61)],  # noqa: B006, B008 - shown in a form
    engine: EngineName = "gauss",
    time: Instant = None,
) -> Swept:
    """Simulate a scene over the full grid of some of its values and log where its markers have moved.

    Args:
        scene: The machine to simulate: a name (see `shoal scenes`), or its YAML.
        vary: Values of which every combination is simulated, each evenly from one number to another.
        engine: Who simulates; gauss is Shoal's own solver.
        time: Instant [s] at which to look; none means the end of the scene's duration.
    """
    scene = held("scene", "scenes", scene)
    name = title(scene)
    with progress(1, f"{name} over {', '.join(axis.path for axis in vary)}"):
        result = Swept(*run_grid(scene, {axis.path: axis.values() for axis in vary}, engine, time))
    show_result(f"{name}: sweep", tables.of_sweep(result.answer), result)
    return ended(result)
