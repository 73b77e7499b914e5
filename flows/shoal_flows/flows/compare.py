"""Flow: one scene on several engines."""

from __future__ import annotations

from prefect import flow
from shoal.errors import InputError

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import Engines, SceneName, Values
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import run_engines
from shoal_flows.inputs import held, title
from shoal_flows.results import Compared


@flow(name="compare", flow_run_name=named("compare", "scene"))
def compare(
    scene: SceneName = "flexible-double-pendulum",
    engines: Engines | None = None,
    values: Values = {},  # noqa: B006
) -> Compared:
    """Simulate a scene on several engines and log how far apart they come out.

    Args:
        scene: The machine to simulate: a name (see `shoal scenes`), or its YAML.
        engines: Who simulates, two or more; else Shoal's own solver, gauss, and at most two others that can.
        values: Fields of the scene to set, as {path: value}, such as {"bodies.OA.elements": 8}.
    """
    if engines is not None and len(set(engines)) < 2:
        raise InputError(f"engines: give two different ones or more, found {', '.join(engines)}")
    scene = held("scene", "scenes", scene)
    name = title(scene)
    with progress(1, f"{name} on {', '.join(engines or ['several engines'])}"):
        comparison, picture, run_id = run_engines(scene, engines, values)
    result = Compared(comparison, run_id, picture)
    show_result(f"{name}: engines", tables.of_comparison(comparison), result)
    return ended(result)
