"""A run's model in MLflow's registry: a version, and the alias `champion` where nothing speaks against it."""

from __future__ import annotations

from typing import Any

from shoal_flows.tracking.record import MODEL, Run

CHAMPION = "champion"


def enter(client: Any, run: Run) -> None:
    """Register the model of a run that MLflow has in full; what is registered already is not registered again."""
    stated = run.registration
    if stated is None:
        return
    from mlflow.exceptions import MlflowException
    from mlflow.store.artifact.runs_artifact_repo import RunsArtifactRepository

    try:
        client.create_registered_model(stated.name, tags={"project": "shoal"}, description=stated.about)
    except MlflowException as error:
        if error.error_code != "RESOURCE_ALREADY_EXISTS":
            raise
    doubts = [*stated.doubts, *_later(client, stated.name, run)]
    known = client.search_model_versions(f"name = '{stated.name}' and run_id = '{run.run_id}'")
    if not known:
        tags = {**stated.tags, "study": run.name, CHAMPION: "; ".join(["stayed", *doubts]) if doubts else "passed"}
        source = RunsArtifactRepository.get_underlying_uri(f"runs:/{run.run_id}/{MODEL}")
        cut = {name: value[:5000] for name, value in tags.items()}
        known = [client.create_model_version(stated.name, source, run.run_id, cut, description=stated.description)]
    if not doubts:
        client.set_registered_model_alias(stated.name, CHAMPION, known[0].version)


def _later(client: Any, name: str, run: Run) -> list[str]:
    """A study that began after this one, and came to MLflow before it, keeps the alias."""
    found = client.get_registered_model(name).aliases.get(CHAMPION)
    if found is None:
        return []
    holder = client.get_model_version(name, found).run_id
    if holder == run.run_id or client.get_run(holder).info.start_time <= run.started:
        return []
    return [f"version {found} is of a later study"]
