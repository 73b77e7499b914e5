"""What Prefect's pages offer can be run, says what it is, and offers every choice there is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml
from shoal.engines import ENGINES
from shoal.identification.methods import METHODS
from shoal.scene.load import scene_library, scene_names

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
    assert validate({**defaults, **stated.get("parameters", {})}, schema) == []


def test_forms_offer_every_scene_engine_and_method(flows: Any) -> None:
    forward = schema_of(flows["forward"]).properties
    identify = schema_of(flows["identify"]).properties
    own, listed = forward["scene"]["anyOf"]
    assert listed["enum"] == scene_names()
    assert own == {"type": "string", "title": "name, YAML, path or address"}
    assert forward["engine"]["enum"] == list(ENGINES)
    assert identify["methods"]["items"]["enum"] == list(METHODS)


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("simulate", {"scene": "bodies:\n  OA: 1"}, {"scene": 1}),
        ("tolerance", {"scene": "arm.yaml", "tolerance": 0.01}, {"tolerance": 0}),
        ("statics", {"time": 1.5, "tolerance": 1e-3, "set": {"gravity": [0, 0]}}, {"time": -1}),
        ("export", {"to": ["mjcf", "fmu", "nc"], "parameter": ["gravity.1"], "verify": False}, {"to": ["step"]}),
        ("identify", {"problem": "a: 1\nb: 2", "data": "http://gauss:8001/v1/library/recordings/run"}, {"seeds": []}),
        ("uncertain", {"study": "uncertain: {}", "set": {"gravity": [0, 0]}}, {"study": 1}),
        ("design", {"about": "start", "noise": 1e-3, "parameter": "theta1", "rate": None}, {"about": "noon"}),
        ("design", {"data": "run", "duration": 2}, {"noise": -1}),
        ("compare", {"engines": ["gauss", "casadi"]}, {"engines": ["gauss"]}),
        ("sweep", {"vary": [{"path": "gravity", "low": 0, "high": 1, "count": 2}]}, {"vary": []}),
        ("night", {"only": "library/arm", "quick": True}, {"quick": "perhaps"}),
    ],
)
def test_forms_take_what_is_right_and_no_more(
    name: str, right: dict[str, Any], wrong: dict[str, Any], flows: Any
) -> None:
    from prefect.utilities.schema_tools import validate

    stated = DEPLOYMENTS[name]
    schema = schema_of(flows[stated["entrypoint"].rpartition(":")[2]]).model_dump_for_openapi()
    defaults = {key: field["default"] for key, field in schema["properties"].items()}
    assert validate({**defaults, **right}, schema) == []
    assert validate({**defaults, **wrong}, schema) != []


def test_every_flow_has_a_deployment(flows: Any) -> None:
    """But for the demo, which is a command of its own."""
    assert {stated["entrypoint"].rpartition(":")[2] for stated in DEPLOYMENTS.values()} == {*flows} - {"demo"}


def test_what_the_form_does_not_offer_is_for_the_flow_to_refuse() -> None:
    """An entry of the library that is younger than the deployment, YAML, a recording's path."""
    strict = {name for name, stated in DEPLOYMENTS.items() if stated.get("enforce_parameter_schema", True)}
    assert strict == {"night"}


@pytest.mark.slow
def test_forms_offer_the_names_of_the_library(tmp_path: Path) -> None:
    """As they are when the deployments are stated, which `make up` does at its start."""
    scene = (scene_library() / "single-pendulum.yaml").read_text()
    (tmp_path / "arm.yaml").write_text(scene)
    program = (
        "from shoal import library; library.add('arm.yaml')\n"
        "from shoal_flows.flows import FLOWS\n"
        "from prefect.utilities.callables import parameter_schema\n"
        "print('arm' in parameter_schema(FLOWS['forward']).properties['scene']['anyOf'][1]['enum'])\n"
    )
    environment = {**os.environ, "SHOAL_LIBRARY": str(tmp_path / "library")}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


def test_nights_do_not_pile_up(flows: Any) -> None:
    night = DEPLOYMENTS["night"]
    assert night["concurrency_limit"] == {"limit": 1, "collision_strategy": "CANCEL_NEW"}
    assert [schedule["cron"] for schedule in night["schedules"]] == ["0 2 * * *"]
    flow = flows["nightly"]
    assert flow.retries == 1
    assert flow.timeout_seconds == 3600
    queues = {one["work_pool"]["work_queue_name"] for name, one in DEPLOYMENTS.items() if name != "night"}
    assert night["work_pool"]["work_queue_name"] not in queues


def test_saved_parameters_of_the_release_before_are_renamed(flows: Any) -> None:
    """Of deployments and of their schedules; those of today and of foreign flows stay."""
    from shoal_flows.deployment.deploy import rename_parameters

    old, new = {"scene": "arm", "values": {"a": 1}}, {"scene": "arm", "set": {"a": 1}}
    schedules = [SimpleNamespace(id=7, parameters=old), SimpleNamespace(id=8, parameters=None)]
    saved = [
        SimpleNamespace(id=1, flow_id="forward", parameters=old, schedules=schedules),
        SimpleNamespace(id=2, flow_id="forward", parameters=new, schedules=[]),
        SimpleNamespace(id=3, flow_id="foreign", parameters=old, schedules=[]),
    ]
    found: dict[Any, Any] = {}
    client: Any = SimpleNamespace(
        read_deployments=lambda: saved,
        read_flow=lambda name: SimpleNamespace(name=name),
        update_deployment=lambda one, update: found.update({one: update.parameters}),
        update_deployment_schedule=lambda one, schedule, parameters: found.update({(one, schedule): parameters}),
    )
    rename_parameters(client)
    assert found == {1: new, (1, 7): new}
