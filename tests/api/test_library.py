"""The library behind a service: what is put there is checked, listed, taken by name, given back and forgotten."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from running import eventually, serving
from shoal import library
from shoal.api.settings import Settings
from shoal.cli import main

RUN = "t,x,y\n" + "".join(f"{t:.2f},{np.cos(0.5 - t)},{np.sin(0.5 - t)}\n" for t in np.arange(1, 9) / 20)


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    settings = Settings(workers=1, library=tmp_path_factory.mktemp("library"), library_mb=1)
    with serving("gauss", settings) as url, httpx.Client(base_url=url, timeout=300) as client:
        yield client


def files(**texts: str) -> dict[str, Any]:
    return {"files": {name.replace("_", "."): base64.b64encode(text.encode()).decode() for name, text in texts.items()}}


def refused(answer: httpx.Response) -> tuple[int, str]:
    found = answer.json()
    assert found["type"].startswith("urn:shoal:")
    return answer.status_code, found["detail"]


def test_an_entry_is_put_listed_simulated_given_and_forgotten(service: httpx.Client, machine: dict[str, Any]) -> None:
    put = service.put("/v1/library/scenes/arm", json=files(arm_yaml=yaml.safe_dump(machine)))
    assert put.status_code == 200, put.text
    listed = service.get("/v1/library").json()
    assert put.json() in listed["entries"]
    assert "single-pendulum" in listed["scenes"]
    by_name, inline = (
        service.post("/v1/simulate", json={"scene": scene, "at": [0.1]}).json()["points"] for scene in ("arm", machine)
    )
    assert by_name == inline
    lighter = {**machine, "gravity": [0.0, -1.62]}
    service.put("/v1/library/scenes/arm", json=files(arm_yaml=yaml.safe_dump(lighter)))
    found = service.get("/v1/library/scenes/arm").json()
    assert found["versions"][0] == put.json()["version"] != found["version"]
    assert yaml.safe_load(base64.b64decode(found["files"]["arm.yaml"])) == lighter
    versions = [f"arm@{version}" for version in found["versions"]]
    old, new = (service.post("/v1/simulate", json={"scene": one, "at": [0.1]}).json()["points"] for one in versions)
    assert old == by_name != new
    assert service.delete("/v1/library/scenes/arm").status_code == 204
    assert refused(service.get("/v1/library/scenes/arm"))[0] == 404
    assert refused(service.delete("/v1/library/scenes/arm"))[0] == 404
    assert refused(service.post("/v1/simulate", json={"scene": "arm"}))[0] == 422


@pytest.mark.slow
def test_a_problem_and_a_recording_are_taken_by_name(service: httpx.Client, problem: dict[str, Any]) -> None:
    stated = {**problem, "scene": "arm", "source": {"kind": "file", "path": "run"}}
    service.put("/v1/library/scenes/arm", json=files(arm_yaml=yaml.safe_dump(problem["scene"])))
    run = service.put("/v1/library/recordings/run", json=files(run_yaml="path: run.csv", run_csv=RUN))
    assert run.status_code == 200, run.text
    put = service.put("/v1/library/problems/start", json=files(start_yaml=yaml.safe_dump(stated)))
    assert put.status_code == 200, put.text
    asked = [{"problem": "start"}, {"problem": {**problem, "scene": "arm"}, "data": {"recording": "run"}}]
    found = []
    for request in asked:
        made = service.post("/v1/identifications", json=request)
        assert made.status_code == 202, made.text
        place = made.headers["Location"]
        eventually(lambda place=place: service.get(place).json()["status"] not in ("queued", "running"))  # type: ignore[misc]
        result = service.get(f"{place}/result").json()
        found.append((result["parameters"]["theta"]["value"], result["data"]))
    assert found[0] == found[1]
    answer = service.post("/v1/identifications", json={**asked[1], "data": {"recording": "ruin"}})
    assert refused(answer) == (422, "data.recording: ruin: no such recording of the library (did you mean run?)")


@pytest.mark.parametrize(
    ("address", "content", "why"),
    [
        ("machines/arm", files(arm_yaml="x: 1"), "kind: no kind 'machines'"),
        ("scenes/single-pendulum", files(single_pendulum="x: 1"), "built-in scene"),
        ("scenes/a.b", files(a_b="x: 1"), "name: 'a.b'"),
        ("scenes/arm", files(arm_yaml="bodies: 1"), "arm.yaml: "),
        ("scenes/arm", files(arm_yaml="a: &a [*a]"), "stands within"),
        ("scenes/arm", {"files": {"../arm.yaml": "eA=="}}, "arm.yaml is missing"),
        ("scenes/arm", {"files": {"arm.yaml": "eA==", "../b": "eA=="}}, "not a plain path"),
        ("scenes/arm", {"files": {"arm.yaml": "eA=="[:3]}}, "not base64"),
        ("recordings/run", files(run_yaml="path: /etc/passwd"), "leads out"),
        ("recordings/run", files(run_yaml="path: run.csv", run_csv="1" * 1_000_001), "is full"),
    ],
)
def test_what_is_wrong_is_refused(service: httpx.Client, address: str, content: dict[str, Any], why: str) -> None:
    before = service.get("/v1/library").json()
    status, detail = refused(service.put(f"/v1/library/{address}", json=content))
    assert status == 422
    assert why in detail
    assert service.get("/v1/library").json() == before


def test_a_library_is_pushed(
    service: httpx.Client, machine: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHOAL_LIBRARY", str(tmp_path / "library"))
    (tmp_path / "lever.yaml").write_text(yaml.safe_dump(machine))
    made = library.add(tmp_path / "lever.yaml")
    done = CliRunner().invoke(main, ["library", "push", str(service.base_url), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["entries"][0]["version"] == made.version
    assert service.get("/v1/library/scenes/lever").json()["version"] == made.version
    done = CliRunner().invoke(main, ["library", "push", str(service.base_url), "leven"])
    assert done.exit_code == 2
    assert "did you mean lever?" in done.stderr
