"""Flow: how a machine may move whose parameters are known as intervals or distributions only."""

from __future__ import annotations

from prefect import flow

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import StudyName, Values
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import respond
from shoal_flows.inputs import held, title
from shoal_flows.results import Responded


@flow(name="uncertain", flow_run_name=named("uncertain", "study"))
def uncertain(
    study: StudyName = "pendulum-tolerances",
    set: Values = {},  # noqa: B006 - Prefect shows the default in its form; nothing changes it
) -> Responded:
    """Find bounds or statistics of a machine with uncertain parameters, and whether its limits hold.

    Args:
        study: A name of the library, or YAML `uncertain` with a scene, what varies and other options
            of `shoal uncertain`. Its files are artifacts of the run in MLflow.
        set: Fields of the scene to set, as {path: value}, such as {"bodies.OA.elements": 8}.
    """
    study = held("study", "studies", study)
    name = title(study)
    with progress(1, f"{name}: uncertain response"):
        result = Responded(*respond(study, set))
    show_result(f"{name}: uncertain response", tables.of_response(result.answer), result)
    return ended(result)
