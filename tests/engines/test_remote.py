"""The remote engine: the same bits, the same refusals, and one clear line when the service is not to be had."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from running import serving
from shoal.api.settings import Settings
from shoal.client import Client
from shoal.engines import get_engine
from shoal.engines.gauss import GaussEngine
from shoal.engines.remote import RemoteEngine
from shoal.engines.verification import verified
from shoal.errors import ComputationError, InputError
from shoal.scene import Scene, load_scene


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    """A service of the native engine."""
    with serving("gauss", Settings(workers=1, max_work=10_000_000)) as address:
        yield address


def test_bit_for_bit(url: str) -> None:
    """A trajectory from afar is the one computed here."""
    scene, times = load_scene("flexible-double-pendulum"), np.array([0.1, 0.1 + 0.2])
    far, near = (get_engine(name).simulate(scene, times) for name in (url, "gauss"))
    for name in ("times", "points", "angles", "velocities", "rates", "energy_drift", "constraint_drift"):
        assert getattr(far, name).tobytes() == getattr(near, name).tobytes()
    assert (far.engine, far.markers, far.status, far.steps, far.model) == (
        near.engine, near.markers, near.status, near.steps, near.model,
    )  # fmt: skip


def test_lanes_bit_for_bit(url: str) -> None:
    scene, angles = load_scene("rigid-double-pendulum"), {"initial.OA.angle": np.linspace(0.1, 0.3, 5)}
    far, near = (get_engine(name).simulate_many(scene, angles, [0.2]) for name in (url, "gauss"))
    assert far.points.tobytes() == near.points.tobytes()
    assert far.lanes == 5


def test_lanes_from_afar_tell_why_they_fail_and_where_they_start(url: str) -> None:
    """A bar of 1 m along x that a rod to a place at 2 m holds: 1 m lets it lie so, 1.4 turn it, 4 are too long."""
    bar = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "named_points": {"end": [1.0, 0.0]}}
    scene = Scene.parse({
        "name": "held", "bodies": {"a": bar}, "markers": {"e": {"body": "a", "point": "end"}},
        "joints": {
            "O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "a"}},
            "d": {"kind": "distance", "first": {"body": "ground", "point": [2.0, 0.0]},
                  "second": {"body": "a", "point": "end"}, "length": 1.0},
        },
        "initial": {"a": {"angle": 0.0}},
    })  # fmt: skip
    far, near = (get_engine(name).simulate_many(scene, {"joints.d.length": np.array([1.0, 1.4, 4.0])}, [0.0])
                 for name in (url, "gauss"))  # fmt: skip
    assert [far.changed(lane) for lane in range(3)] == [near.changed(lane) for lane in range(3)]
    assert abs(far.changed(1)["a"]["angle"]["used"]) == pytest.approx(np.arccos((5 - 1.4**2) / 4))
    assert [far.reason(lane) for lane in range(3)] == [near.reason(lane) for lane in range(3)]
    assert [bool(far.reason(lane)) for lane in range(3)] == [False, False, True]


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("rigid-double-pendulum", {}),
        ("flexible-double-pendulum", {"solver.duration": 0.2}),
        ("rigid-double-pendulum", {"solver.integrator": "energy-momentum", "solver.step": 0.1}),
    ],
)
def test_a_remote_run_is_verified_like_a_local_one(
    url: str, name: str, values: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same verdict from the same numbers, a wrong run's too; every run is the service's, none is made here."""
    scene = load_scene(name).with_values(values)
    near = verified(get_engine("gauss"), scene)
    monkeypatch.delattr(GaussEngine, "simulate")
    far = verified(get_engine(url), scene)
    assert (far.status, far.message, far.model) == (near.status, near.message, near.model)
    assert far.points.tobytes() == near.points.tobytes()
    assert far.model["verification"]["time_error"] > 0


def test_a_service_without_a_second_run_leaves_the_first(url: str) -> None:
    """What a service refuses of the second run is said; the first one is not lost."""
    asked = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        if len(asked) > 1:
            return httpx.Response(504, json={"type": "urn:shoal:timeout", "detail": "ended after 60 s"})
        return httpx.post(url + request.url.path, content=request.content, headers=request.headers, timeout=300)

    run = verified(RemoteEngine(url, httpx.MockTransport(answer)), load_scene("single-pendulum"))
    assert run.ok
    assert run.model["verification"]["time_error"] is None
    assert "time error not estimated: engine: " in run.model["verification"]["note"]


def test_capabilities(url: str) -> None:
    assert get_engine(url).capabilities == get_engine("gauss").capabilities


def test_refusals_are_the_engines(url: str) -> None:
    """Bad input reads the same from afar; so does a limit of the service."""
    scene, lines = load_scene("single-pendulum"), []
    for name in (url, "gauss"):
        with pytest.raises(InputError) as caught:
            get_engine(name).simulate(scene, [0.2, 0.1])
        lines.append(str(caught.value))
    assert lines[0] == lines[1]
    with pytest.raises(InputError, match=r"solver\.step: .* this service computes"):
        get_engine(url).simulate(scene.with_values({"solver.step": 1e-9}))


def test_nobody_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.engines.remote.RETRIES", 1)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"http://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(ComputationError, match=f"engine: {address} does not answer"):
            get_engine(address).simulate(load_scene("single-pendulum"))


@pytest.mark.parametrize("first", [429, 502, 503, None])
def test_comes_again(url: str, first: int | None) -> None:
    """A full queue, a proxy without its service, a broken connection: the second attempt counts."""
    asked = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        if len(asked) > 1:
            return httpx.post(
                f"{url}{request.url.path}", content=request.content, headers={"Content-Type": "application/json"}
            )
        if first is None:
            raise httpx.ReadError("reset")
        return httpx.Response(first, headers={"Retry-After": "0"})

    engine = RemoteEngine(url, httpx.MockTransport(answer))
    assert engine.simulate(load_scene("single-pendulum"), [0.1]).ok
    assert len(asked) == 2
    # By which the service knows that it is the same request.
    assert asked[0].headers["Idempotency-Key"] == asked[1].headers["Idempotency-Key"]


@pytest.mark.parametrize(
    ("status", "document", "error", "line"),
    [
        (401, {"type": "urn:shoal:unauthorized", "detail": "no"}, InputError, "SHOAL_API_KEY"),
        (500, {"type": "urn:shoal:crashed", "detail": "the worker died"}, ComputationError, "the worker died"),
        (504, {"type": "urn:shoal:timeout", "detail": "ended after 60 s"}, ComputationError, "ended after 60 s"),
        (404, {"detail": "Not Found"}, InputError, "is not a service of Shoal"),
        (200, None, InputError, "is not a service of Shoal"),
        (200, {"status": "ok"}, InputError, "is not a service of Shoal"),
        (200, ["status", "ok"], InputError, "is not a service of Shoal"),
        (200, "ok", InputError, "is not a service of Shoal"),
    ],
)
def test_other_answers(status: int, document: object, error: type[Exception], line: str) -> None:
    def answer(request: httpx.Request) -> httpx.Response:
        return httpx.Response(status, text="<html>") if document is None else httpx.Response(status, json=document)

    engine = RemoteEngine("http://127.0.0.1:9", httpx.MockTransport(answer))
    with pytest.raises(error, match=line):
        engine.simulate(load_scene("single-pendulum"))


@pytest.mark.parametrize("document", [{"status": "ok"}, ["ok"], 1])
def test_another_program_that_answers_json_is_no_service(document: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is asked of it: such an answer is refused by name, and never returned as a result."""
    transport = httpx.MockTransport(lambda _: httpx.Response(200, json=document))
    engine, client = RemoteEngine("http://127.0.0.1:9", transport), Client("http://127.0.0.1:9")
    monkeypatch.setattr(client, "_service", engine)
    asks: list[Callable[[], object]] = [
        lambda: engine.capabilities,
        lambda: engine.get_entry("scene", "mine"),
        lambda: client.simulate("single-pendulum"),
        lambda: client.simulate("single-pendulum", engine="gauss"),
        lambda: client.identify("paper-case-1"),
        lambda: client.status("job"),
    ]
    for ask in asks:
        with pytest.raises(InputError, match="is not a service of Shoal"):
            ask()


def test_the_key_goes_along(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def answer(request: httpx.Request) -> httpx.Response:
        seen.append(request.headers["X-API-Key"])
        return httpx.Response(404)

    monkeypatch.setenv("SHOAL_API_KEY", "secret")
    with pytest.raises(InputError):
        RemoteEngine("http://127.0.0.1:9", httpx.MockTransport(answer)).simulate(load_scene("single-pendulum"))
    assert seen == ["secret"]


@pytest.mark.parametrize("url", ["http://", "http://[::1", "http://127.0.0.1:99999999/"])
def test_not_an_address(url: str) -> None:
    with pytest.raises(InputError, match="engine: "):
        get_engine(url).simulate(load_scene("single-pendulum"))
