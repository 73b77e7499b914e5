"""Whatever a service computes: the library's answers, its signatures, its refusals; at once and as a job."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from inspect import signature
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import orjson
import pandas as pd
import pytest
import shoal
import yaml
from running import eventually, serving
from scipy import stats
from shoal.api.operations import OPERATIONS
from shoal.api.settings import Settings
from shoal.api.tasks import reported
from shoal.client import Client
from shoal.engines.sweep import Sweep
from shoal.errors import ComputationError, InputError
from shoal.json_values import json_text, plain
from shoal.scene import Scene

JSON = {"Content-Type": "application/json"}
SCENE = "rigid-double-pendulum"
ANGLES = np.linspace(0.1, 0.5, 3)
CALLS: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {
    "simulate": ((SCENE, [0.1, 0.2]), {"set": {"initial.OA.angle": 0.3}}),
    "select": (("flexible-double-pendulum", 1e-3), {"at": [0.1], "set": {"solver.duration": 0.1}}),
    "sweep": ((SCENE, {"initial.OA.angle": ANGLES}), {"at": 0.2}),
    "uncertain": ((SCENE, {"initial.OA.angle": (0.3, 0.4)}, [0.1, 0.2]), {"runs": 200, "seed": 3, "limit": ["B.y>0"]}),
    "statics": (("flexible-double-pendulum",), {"set": {"gravity": [0.5, -1.62]}}),
    "modes": (("flexible-double-pendulum",), {"count": 3, "about": "equilibrium"}),
    "linearize": (("andrews-squeezer", ["motor"]), {"about": "start"}),
    "reactions": ((SCENE, np.array([0.0, 0.1])), {}),
    "export": (("single-pendulum", "exudyn"), {"set": {"solver.duration": 0.1}}),
    "identify": (("paper-case-1",), {"method": "least-squares", "seed": 1}),
    "design": (("paper-case-1",), {"about": "start", "noise": 1e-3}),
}
ERRORS: dict[str, tuple[str, ...]] = {
    "simulate": ("errors", "total"),
    "select": ("selection", "errors", "total"),
    "sweep": ("error",),
    "uncertain": ("error",),
    "statics": ("error",),
    "modes": ("modes", "0", "error"),
    "linearize": ("error",),
    "reactions": ("reactions", "0", "unbalanced"),
    "export": ("distance",),
    "identify": ("parameters", "theta1", "std"),
    "design": ("doubt",),
}
"""Where an answer says how far it may be off."""


@pytest.fixture(scope="module")
def client(gauss: httpx.Client) -> Client:
    return Client(str(gauss.base_url))


def known(found: Any) -> Any:
    """An answer without what differs from run to run."""
    if isinstance(found, dict):
        return {key: known(one) for key, one in found.items() if key not in ("wall_s", "seconds")}
    return [known(one) for one in found] if isinstance(found, list | tuple) else found


def differ(one: Any, other: Any, place: str = "") -> Iterator[str]:
    """Where two results differ in kind or in a bit, but for how long they took, and might have."""
    if isinstance(one, Scene) and isinstance(other, Scene):
        one, other = (scene.with_values({"solver.max_steps": 1}) for scene in (one, other))
    if isinstance(one, Mapping) and isinstance(other, Mapping):  # one may be worked out when it is asked for
        one, other = dict(one), dict(other)
    if type(one) is not type(other):
        yield f"{place}: {type(one)}, {type(other)}"
    elif place.endswith((".wall_s", ".seconds")):
        return
    elif isinstance(one, np.ndarray):
        if (one.dtype, one.shape, one.tobytes()) != (other.dtype, other.shape, other.tobytes()):
            yield place
    elif is_dataclass(one):
        for name in (field.name for field in fields(one)):
            yield from differ(getattr(one, name), getattr(other, name), f"{place}.{name}")
    elif isinstance(one, dict):
        if list(one) != list(other):
            yield f"{place}: {list(one)}, {list(other)}"
        for key in one.keys() & other.keys():
            yield from differ(one[key], other[key], f"{place}.{key}")
    elif isinstance(one, list | tuple):
        if len(one) != len(other):
            yield f"{place}: {len(one)}, {len(other)}"
        for number, pair in enumerate(zip(one, other, strict=False)):
            yield from differ(*pair, f"{place}.{number}")
    elif one != other and not (one != one and other != other):
        yield f"{place}: {one!r}, {other!r}"


def test_every_operation_is_a_method_with_the_signature_of_its_function() -> None:
    assert set(CALLS) == set(OPERATIONS)
    for name in OPERATIONS:
        of_library, of_client = (signature(getattr(place, name)) for place in (shoal, Client))
        assert list(of_client.parameters.values())[1:] == list(of_library.parameters.values())
        assert of_client.return_annotation == of_library.return_annotation
        assert getattr(Client, name).__doc__ == getattr(shoal, name).__doc__


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.by_day(2)
def test_the_answer_is_the_librarys(client: Client, name: str) -> None:
    arguments, options = CALLS[name]
    far, near = (getattr(place, name)(*arguments, **options) for place in (client, shoal))
    assert not list(differ(near, far))
    place = plain(reported(far)) if name != "simulate" else far.model
    for key in ERRORS[name]:
        place = place[int(key)] if key.isdigit() else place[key]
    assert place is not None


@pytest.mark.parametrize("name", ["select", "sweep", "statics", "modes", "linearize", "reactions"])
@pytest.mark.by_day(2)
def test_without_the_client_it_is_what_the_command_prints(gauss: httpx.Client, name: str) -> None:
    arguments, options = CALLS[name]
    asked = {**signature(getattr(shoal, name)).bind(*arguments, **options).arguments}
    answer = gauss.post(f"/v1/{name}", content=orjson.dumps(asked, option=orjson.OPT_SERIALIZE_NUMPY), headers=JSON)
    assert known(answer.json()) == known(plain(reported(getattr(shoal, name)(*arguments, **options))))


def test_what_is_uncertain_is_said_in_every_way_of_the_library(client: Client) -> None:
    paths, few = ["initial.OA.angle", "initial.AB.angle"], {"runs": 60, "verify": False, "at": [0.1]}
    normal = dict.fromkeys(paths, "normal(0.3,0.01)")
    for vary, more in [
        (["initial.OA.angle=0.3:0.4"], {}),
        ({"bodies.OA.length": ("-2%", "2%")}, {}),
        (normal, {"correlate": {(paths[0], paths[1]): 0.5}}),
    ]:
        far, near = (place.uncertain(SCENE, vary, **few, **more) for place in (client, shoal))
        assert not list(differ(near, far))
    with pytest.raises(InputError, match=r"vary: initial.OA.angle: needs \(low, high\) or a text"):
        client.uncertain(SCENE, {"initial.OA.angle": stats.norm(0.3, 0.01)})


def test_an_estimate_is_taken_on(client: Client, tmp_path: Path) -> None:
    found = shoal.identify("paper-case-1", method="least-squares")
    written = tmp_path / "found.json"
    written.write_text(json_text(found.to_json()))
    scene = "flexible-double-pendulum"
    assert "Verdict" in client.identify("paper-case-1", method="least-squares")._repr_html_()  # type: ignore[attr-defined]
    near = shoal.simulate(scene, [0.1], values=found, verify=False)
    for values in (found, written):
        assert client.simulate(scene, [0.1], values=values, verify=False).points.tobytes() == near.points.tobytes()
    again = {"method": "least-squares", "hold_out": [(0.2, 0.3)]}
    far, near = (place.identify("paper-case-1", values=found, **again) for place in (client, shoal))
    assert far.prediction
    assert far.parameters == near.parameters
    assert far.evaluations == near.evaluations


def test_an_export_is_written_where_the_caller_says(client: Client, tmp_path: Path) -> None:
    near, far = tmp_path / "near.py", tmp_path / "far.py"
    shoal.export("single-pendulum", to="exudyn", file=near, verify=False)
    answer = client.export("single-pendulum", to="exudyn", file=far, verify=False)
    assert far.read_text() == near.read_text() == answer.text
    assert (answer.name, answer.distance) == ("single-pendulum.py", None)
    with pytest.raises(InputError, match=r"out: x\.xml ends in \.xml; exudyn has \.py"):
        shoal.export("single-pendulum", to="exudyn", file="x.xml")


def test_jobs_are_submitted_followed_and_cancelled(client: Client) -> None:
    job = client.submit("sweep", SCENE, {"initial.OA.angle": ANGLES}, verify=False)
    eventually(lambda: client.status(job)["status"] == "done")
    assert client.status(job)["operation"] == "sweep"
    assert isinstance(found := client.result(job), Sweep)
    assert len(found.rows()) == 3
    told: list[Any] = []
    estimate = client.identify("paper-case-1", method="iafsa", progress=lambda *row: told.append(row))
    assert estimate.status == "ok"
    assert all(len(row) == 4 for row in told)
    job = client.submit("identify", "paper-case-1", method="iafsa", bootstrap=10_000)
    client.cancel(job)
    assert client.status(job)["status"] == "cancelled"
    with pytest.raises(ComputationError, match="the job is cancelled"):
        client.result(job)
    with pytest.raises(InputError, match="no operation 'guess'"):
        client.submit("guess")


def test_a_callers_own_scene_problem_and_recording(client: Client, problem: dict[str, Any], tmp_path: Path) -> None:
    """Objects, files and tables are sent along; nothing of them is on the service."""
    machine = shoal.Scene.parse(problem["scene"]).with_values({"initial.OA.angle": 0.3})
    motion = client.simulate(machine, np.linspace(0.0, 1.0, 21))
    x, y = motion.marker("A").T
    table = pd.DataFrame({"t": motion.times, "x": x, "y": y})
    table.to_csv(tmp_path / "run.csv", index=False)
    (tmp_path / "run.yaml").write_text("path: run.csv\nduration: 0.5\n")
    (tmp_path / "machine.yaml").write_text(yaml.safe_dump(problem["scene"]))
    stated = {**problem, "scene": "machine.yaml"}
    (tmp_path / "start.yaml").write_text(yaml.safe_dump(stated))
    (tmp_path / "whole.yaml").write_text(yaml.safe_dump({**stated, "source": {"kind": "file", "path": "run.csv"}}))
    start, counts = str(tmp_path / "start.yaml"), []
    for asked in [
        (start, table), (start, str(tmp_path / "run.csv")), (start, tmp_path / "run.yaml"),
        (str(tmp_path / "whole.yaml"), None), (shoal.load_problem(start), {"recording": str(tmp_path / "run.csv")}),
    ]:  # fmt: skip
        found = client.identify(*asked)
        assert found.parameters["theta"].value == pytest.approx(0.3, abs=1e-6)
        counts.append(found.data.rpartition(", ")[2])
    assert counts == ["21 samples", "21 samples", "11 samples", "21 samples", "21 samples"]


@pytest.mark.parametrize(
    ("path", "body", "detail"),
    [
        ("simulate", {"tolerance": 1e-3, "lanes": {"initial.OA.angle": [0.1]}}, "tolerance: a model is chosen for one"),
        ("sweep", {"vary": {"initial.XY.angle": [0.1]}}, "initial.XY"),
        ("uncertain", {"vary": {"gravity.1": "empirical(f.csv)"}}, "vary.gravity.1: 'empirical(f.csv)' is no dist"),
        (
            "sweep",
            {"vary": {"initial.OA.angle": [0.1]}, "set": {"initial.OA.angle": 0.3}},
            "is set to 0.3 and varied",
        ),
        ("simulate", {"lanes": {"initial.OA.angle": [0.1]}, "set": {"initial.OA.angle": 0.3}}, "is set to 0.3"),
        ("sweep", {"vary": {"initial.OA.angle": []}}, "vary.initial.OA.angle: "),
        ("sweep", {"vary": {f"initial.OA.angle{k}": [0.0] * 1000 for k in range(9)}}, "times: "),
        ("sweep", {"vary": {"solver.step": [1e-3, 1e-12]}}, "solver.step: "),
        ("statics", {"time": -1}, "time: "),
        ("modes", {"count": 0}, "count: "),
        ("modes", {"about": "noon"}, "about: "),
        ("reactions", {"at": []}, "at: "),
        ("reactions", {}, "at: "),
        ("select", {"tolerance": 0}, "tolerance: "),
        ("select", {"tolerance": 1, "engine": "exudyn"}, "engine: "),
    ],
)
def test_what_is_wrong_is_one_line_that_names_the_field(
    gauss: httpx.Client, path: str, body: dict[str, Any], detail: str
) -> None:
    """The same at once and as a job, which is not even begun."""
    for place in (f"/v1/{path}", f"/v1/jobs/{path}"):
        answer = gauss.post(place, json={"scene": SCENE, **body})
        assert answer.status_code == 422, answer.text
        assert detail in answer.json()["detail"]
        assert "\n" not in answer.json()["detail"]


def test_wrong_calls_are_refused(client: Client) -> None:
    with pytest.raises(InputError, match=r"engine: the service at .* runs gauss, found 'exudyn'"):
        client.simulate(SCENE, engine="exudyn")
    assert client.simulate(SCENE, [0.1], engine="gauss").ok
    with pytest.raises(InputError, match="no such scene"):
        client.simulate("single-pendolum")
    with pytest.raises(TypeError, match="measurement"):
        client.identify("paper-case-1", measurement=1)
    with pytest.raises(TypeError, match="colour"):
        client.simulate(SCENE, colour="red")


def test_lanes_are_looked_at(gauss: httpx.Client) -> None:
    """A few of them, as of a sweep: the largest of the errors."""
    lanes = {"initial.OA.angle": ANGLES.tolist()}
    body = {"scene": SCENE, "at": [0.2], "lanes": lanes}
    found, bare = (gauss.post("/v1/simulate", json={**body, **more}).json() for more in ({}, {"verify": False}))
    assert found["points"] == bare["points"]
    checked = found["model"]["verification"]
    assert (checked["looked_at"], checked["points"]) == (3, 3)
    assert checked["time_error"] == shoal.sweep(SCENE, lanes, 0.2).errors.estimates["time"]
    assert "verification" not in bare["model"]


def test_a_tolerance_chooses_the_model(gauss: httpx.Client) -> None:
    body = {"scene": "flexible-double-pendulum", "at": [0.1], "tolerance": 1e-3}
    found = gauss.post("/v1/simulate", json=body).json()
    assert found["status"] == ["ok"]
    assert found["selection"]["estimated_error"] <= 1e-3
    near = shoal.simulate("flexible-double-pendulum", [0.1], tolerance=1e-3)
    assert np.array(found["points"]).tobytes() == near.points.tobytes()


@pytest.fixture(scope="module")
def casadi() -> Iterator[httpx.Client]:
    with serving("casadi", Settings(workers=1)) as url, httpx.Client(base_url=url, timeout=300) as client:
        yield client


def test_another_engine_is_verified_by_the_native_solver(casadi: httpx.Client) -> None:
    far = Client(str(casadi.base_url)).simulate("single-pendulum", [0.1])
    near = shoal.simulate("single-pendulum", [0.1], engine="casadi")
    assert far.engine == near.engine == "casadi"
    assert far.model["verification"] == near.model["verification"]
    answer = casadi.post("/v1/select", json={"scene": "single-pendulum", "tolerance": 1e-3})
    assert answer.json()["detail"] == "tolerance: models are chosen for engine gauss only, found engine 'casadi'"


def test_where_jobs_were_they_still_are(gauss: httpx.Client) -> None:
    made = gauss.post("/v1/identifications", json={"problem": "paper-case-1", "method": "least-squares"})
    assert made.status_code == 202
    place = f"/v1/identifications/{made.json()['id']}"
    deadline = time.monotonic() + 300
    while gauss.get(place).json()["status"] in ("queued", "running"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert gauss.get(f"{place}/result").json()["status"] == "ok"
