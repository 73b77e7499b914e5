"""What a service refuses, each with little work and without computing anything."""

from __future__ import annotations

import time
from typing import Any

import httpx
import pytest

Machine = dict[str, Any]
JSON = {"content-type": "application/json"}
PROCESSOR_SECONDS = 3.0
"""The service runs in this process. A hundredth of it is used, but for what an engine loads."""


def refused(client: httpx.Client, path: str, **request: Any) -> tuple[int, str, str]:
    """Status, kind and detail of a problem document that cost little processor time, the client's included."""
    begin = time.process_time()
    answer = client.post(path, **request)
    assert time.process_time() - begin < PROCESSOR_SECONDS
    assert answer.headers["content-type"] == "application/problem+json"
    document = answer.json()
    assert document["status"] == answer.status_code
    return answer.status_code, document["type"].removeprefix("urn:shoal:"), document["detail"]


@pytest.mark.parametrize(
    ("body", "kind"),
    [
        (b"[" * 100_000 + b"]" * 100_000, "malformed"),
        (b'{"scene": ' + b"[" * 40 + b"]" * 40 + b"}", "malformed"),
        (b'{"scene": "single-pendulum", "at": [NaN]}', "malformed"),
        (b'{"scene": "single-pendulum", "at": [1e999]}', "malformed"),
        (b'{"scene": "single-pendulum", "at": [-Infinity]}', "malformed"),
        (b'{"scene": "single-pendulum", "set": {"solver.step": 0.1, "solver.step": 0.001}}', "malformed"),
        (b"\xff\xfe", "malformed"),
        (b"", "input"),
        (b"null", "input"),
        (b'{"scene": "single-pendulum", "surprise": 1}', "input"),
        (b'{"scene": "\\u0000"}', "input"),
        (b'{"scene": "single-pendulum", "at": [true]}', "input"),
        (b'{"scene": "single-pendulum", "set": {"gravity": [0, true]}}', "input"),
    ],
)
def test_body(gauss: httpx.Client, body: bytes, kind: str) -> None:
    assert refused(gauss, "/v1/simulate", content=body, headers=JSON)[1] == kind


def test_yaml_is_not_read(gauss: httpx.Client) -> None:
    text = b"scene: !!python/object/apply:os.system [id]"
    assert refused(gauss, "/v1/simulate", content=text, headers={"content-type": "text/yaml"})[:2] == (422, "input")


@pytest.mark.parametrize(
    ("stated", "found"),
    [({}, "missing"), ({"content-type": "application/x-www-form-urlencoded"}, "application/x-www-form-urlencoded")],
)
def test_json_that_is_not_called_json(gauss: httpx.Client, stated: dict[str, str], found: str) -> None:
    """As `curl --data` sends it without a header: the answer names the header."""
    detail = refused(gauss, "/v1/simulate", content=b'{"scene": "single-pendulum"}', headers=stated)[2]
    assert detail.startswith("Content-Type: ")
    assert found in detail
    assert detail.endswith("Content-Type: application/json")


def test_large_body(gauss: httpx.Client) -> None:
    """By what it says of itself, and by what arrives when it says nothing."""
    body = b'{"scene": "' + b"x" * 10_000_000 + b'"}'
    assert refused(gauss, "/v1/simulate", content=body, headers=JSON)[0] == 413
    chunks = (body[k : k + 2**20] for k in range(0, len(body), 2**20))
    assert refused(gauss, "/v1/simulate", content=chunks, headers=JSON)[0] == 413


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "/etc/passwd", "x.yaml", "file:///etc/passwd", "n-four-bar-" + "9" * 60, "http://x/"]
)
def test_names_are_no_paths(gauss: httpx.Client, name: str) -> None:
    assert "no such scene" in refused(gauss, "/v1/simulate", json={"scene": name})[2]
    assert "no such problem" in refused(gauss, "/v1/identifications", json={"problem": name})[2]


@pytest.mark.parametrize(
    "changes",
    [
        {"lanes": {"initial.OA.angle": [0.0] * 200_000}, "at": [100.0]},
        {"lanes": {"solver.step": [1e-3, 1e-12]}},
        {"set": {"solver.samples": 10_000_000}, "at": None},
        {"set": {"solver.step": 1e-12}},
        {"set": {"solver.acceleration": "afsa", "solver.swarm_iterations": 1_000_000}},
        {"scene": "n-four-bar-40", "at": [36000.0]},
        {"scene": "flexible-double-pendulum", "set": {"bodies.OA.elements": 10_000}},
    ],
)
def test_too_much_work(gauss: httpx.Client, machine: Machine, changes: dict[str, Any]) -> None:
    request = {"scene": machine, "at": [0.5], **changes}
    assert refused(gauss, "/v1/simulate", json=request)[:2] == (422, "too-much")


@pytest.mark.parametrize(
    "text",
    [
        "9**9**9**9**9",
        "(" * 300 + "t" + ")" * 300,
        "+".join("t" * 2000),
        "__import__('os').system('id')",
        "t.__class__",
    ],
)
def test_expressions(gauss: httpx.Client, machine: Machine, text: str) -> None:
    """A tower of powers is a float without a value; what is not arithmetic is refused."""
    machine = machine | {"loads": {"m": {"kind": "torque", "body": "OA", "torque": text}}}
    assert refused(gauss, "/v1/simulate", json={"scene": machine, "at": [0.1]})[:2] == (422, "input")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"source": {"kind": "file", "path": "/etc/passwd"}}, "no file is read"),
        ({"source": {"kind": "file", "path": "recording.yaml"}}, "no file is read"),
        ({"recordings": {"a": {"kind": "file", "path": "../a.csv"}}, "source": None}, "no file is read"),
        ({"source": {"kind": "engine", "engine": "http://127.0.0.1:1/", "stop": 1, "count": 5}}, "no engine"),
        ({"source": {"kind": "engine", "engine": "gauss", "stop": 1, "count": 10**12}}, "takes"),
        ({"source": {"kind": "engine", "engine": "gauss", "stop": 1e9, "count": 5}}, "computes"),
        ({"scene": "machine.yaml"}, "no such scene"),
        ({"scene": ["single-pendulum"]}, "scene"),
        ({"ties": {"bodies.OA.mass": "theta.__class__"}}, "ties"),
        ({"ties": {"bodies.OA.mass": "theta" + "*1" * 400}}, "longer than"),
        ({"set": {"bodies.OA.mass": "/etc/passwd"}}, "mass"),
        ({"method": "../x"}, "no method"),
        ({}, "'recording' is missing"),
    ],
)
def test_problems_open_nothing(gauss: httpx.Client, problem: Machine, changes: dict[str, Any], said: str) -> None:
    """No path, no address: neither in the problem, nor in its sources, nor in its scene."""
    status, _, detail = refused(gauss, "/v1/identifications", json={"problem": {**problem, **changes}})
    assert status == 422
    assert said in detail


@pytest.mark.parametrize("name", ["../a", "/tmp/a", "a/b", ""])
def test_names_of_recordings(gauss: httpx.Client, problem: Machine, name: str) -> None:
    request = {"problem": problem, "data": {name: {"columns": {"t": [0.0]}}}}
    assert refused(gauss, "/v1/identifications", json=request)[0] == 422


def test_joints_of_many_places(gauss: httpx.Client, machine: Machine) -> None:
    """What a joint of n places joins is found in a time that grows with n, not with its square."""
    body = machine["bodies"]["OA"]
    bodies = {f"b{k}": body for k in range(4000)}
    terms = [{"at": {"body": name}, "axis": "x"} for name in bodies]
    joints = {f"c{k}": {"kind": "coupling", "terms": terms} for k in range(3)}
    scene = machine | {"bodies": bodies, "joints": joints, "markers": {"A": {"body": "b0", "point": "end"}}}
    assert "no chain of joints connects it to the ground" in refused(gauss, "/v1/simulate", json={"scene": scene})[2]
