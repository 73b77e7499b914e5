"""What Prefect's pages offer can be run, says what it is, and offers every choice there is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from shoal.engines import ENGINES
from shoal.identification.methods import METHODS
from shoal.scene.load import scene_names

DEPLOYMENTS: dict[str, dict[str, Any]] = {
    one["name"]: one for one in yaml.safe_load((Path(__file__).parents[2] / "prefect.yaml").read_text())["deployments"]
}


@pytest.fixture(scope="module")
def flows() -> Any:
    """By name. Imported within a test: Prefect and MLflow then look for their state where the tests keep it."""
    from shoal_flows.flows import FLOWS

    return FLOWS


def schema_of(flow: Any) -> Any:
    from prefect.utilities.callables import parameter_schema

    return parameter_schema(flow)


@pytest.mark.parametrize("name", DEPLOYMENTS)
def test_deployment_names_a_flow_and_its_form_explains_itself(name: str, flows: Any) -> None:
    from prefect.utilities.importtools import import_object
    from prefect.utilities.schema_tools import validate

    stated = DEPLOYMENTS[name]
    flow = import_object(stated["entrypoint"])
    assert flows[flow.name] is flow
    assert stated["description"]
    schema = schema_of(flow).model_dump_for_openapi()
    assert all(field.get("description") for field in schema["properties"].values())
    defaults = {key: field["default"] for key, field in schema["properties"].items()}
    validate({**defaults, **stated.get("parameters", {})}, schema)


def test_forms_offer_every_scene_engine_and_method(flows: Any) -> None:
    forward = schema_of(flows["forward"]).properties
    identify = schema_of(flows["identify"]).properties
    assert forward["scene"]["enum"] == scene_names()
    assert forward["engine"]["enum"] == list(ENGINES)
    assert identify["methods"]["items"]["enum"] == list(METHODS)


def test_nights_do_not_pile_up(flows: Any) -> None:
    night = DEPLOYMENTS["validation"]
    assert night["concurrency_limit"] == {"limit": 1, "collision_strategy": "CANCEL_NEW"}
    assert [schedule["cron"] for schedule in night["schedules"]] == ["0 2 * * *"]
    flow = flows["nightly"]
    assert flow.retries == 1
    assert flow.timeout_seconds == 3600
    queues = {one["work_pool"]["work_queue_name"] for name, one in DEPLOYMENTS.items() if name != "validation"}
    assert night["work_pool"]["work_queue_name"] not in queues
