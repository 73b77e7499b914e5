"""The access log of a service: who asked for what, and no secret."""

from __future__ import annotations

import asyncio
import json
import logging
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from shoal.api.program import create_program
from shoal.api.serve import configured
from shoal.api.settings import Settings
from shoal.errors import InputError

SECRET = "c9a1f0secret"


@pytest.fixture
def program(tmp_path: Path) -> FastAPI:
    """Without its lifespan it starts no worker."""
    keys = tmp_path / "keys"
    keys.write_text(f"anna {SECRET}\n\n{SECRET}2\n")
    return create_program("gauss", Settings(keys_file=keys))


def logged(
    program: FastAPI, caplog: pytest.LogCaptureFixture, method: str, path: str, **request: Any
) -> dict[str, Any]:
    """The one line of a request."""

    async def ask() -> None:
        transport = httpx.ASGITransport(program, raise_app_exceptions=False, client=("192.0.2.1", 1))
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            await client.request(method, path, **request)

    caplog.clear()
    caplog.set_level(logging.INFO, "shoal.api.access")
    asyncio.run(ask())
    (record,) = [one for one in caplog.records if one.name == "shoal.api.access"]
    assert "\n" not in record.message
    assert SECRET not in caplog.text
    line: dict[str, Any] = json.loads(record.message)
    assert set(line) == {"time", "client", "key", "operation", "entry", "status", "seconds"}
    assert line["client"] == "192.0.2.1"
    assert line["seconds"] >= 0
    return line


def test_who_deletes_an_entry_is_seen(program: FastAPI, caplog: pytest.LogCaptureFixture) -> None:
    path = f"/v1/library/scenes/arm?token={SECRET}"
    for key, name in ((SECRET, "anna"), (f"{SECRET}2", "key 3")):
        line = logged(program, caplog, "DELETE", path, headers={"X-API-Key": key})
        assert (line["key"], line["entry"]) == (name, "scenes/arm")
        assert line["operation"] == "DELETE /v1/library/{kind}/{name}"
        assert line["status"] == 500  # its workers have not been started


@pytest.mark.parametrize(
    ("method", "path", "request_", "operation", "status"),
    [
        ("GET", "/health", {}, "GET /health", 200),
        ("GET", f"/{SECRET}", {}, None, 404),
        ("GET", f"/v1/jobs/{SECRET[:6]}%0a", {"headers": {"X-API-Key": f"{SECRET}x"}}, "GET /v1/jobs/{id}", 401),
        ("POST", "/v1/simulate", {"content": SECRET * 1000}, "POST /v1/simulate", 401),
        ("POST", "/Evaluate", {"content": SECRET}, "POST /Evaluate", 401),
        ("GET", "/health", {"headers": {"Host": "evil.example"}}, None, 400),
        ("GET", "/health", {"headers": {"Origin": f"http://{SECRET}.example"}}, None, 403),
    ],
)
def test_every_request_has_its_line(
    method: str,
    path: str,
    request_: dict[str, Any],
    operation: str | None,
    status: int,
    program: FastAPI,
    caplog: pytest.LogCaptureFixture,
) -> None:
    line = logged(program, caplog, method, path, **request_)
    assert (line["operation"], line["status"], line["key"]) == (operation, status, None)


def test_probes_are_logged_when_their_status_changes(program: FastAPI, caplog: pytest.LogCaptureFixture) -> None:
    """`make up` asks five times a second."""
    states = [False] * 5 + [True] * 3 + [False] * 2
    caplog.set_level(logging.INFO, "shoal.api.access")

    async def ask() -> None:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(program), base_url="http://127.0.0.1") as client:
            for state in states:
                program.state.calls = program.state.job_pool = SimpleNamespace(ready=state)
                assert (await client.get("/ready")).status_code == (200 if state else 503)

    asyncio.run(ask())
    lines = [json.loads(one.message) for one in caplog.records if one.name == "shoal.api.access"]
    assert [(line["operation"], line["status"]) for line in lines] == [("GET /ready", code) for code in (503, 200, 503)]


def test_nobody_without_a_key_has_a_body_read(program: FastAPI) -> None:
    """The key is looked at before a byte of the body is asked for."""
    said: list[Any] = []

    async def receive() -> Any:
        raise AssertionError("a body was read")

    async def send(message: Any) -> None:
        said.append(message)

    for path in ("/v1/simulate", "/v1/jobs/simulate", "/v1/library/scenes/a", "/v1/identifications", "/Evaluate"):
        method = "PUT" if "library" in path else "POST"
        headers = [(b"host", b"localhost"), (b"content-type", b"application/json"), (b"content-length", b"9")]
        scope = {
            "type": "http",
            "method": method,
            "path": path,
            "headers": headers,
            "query_string": b"",
            "scheme": "http",
        }
        asyncio.run(program(scope, receive, send))
        assert said[0]["status"] == 401, path
        said.clear()


def test_a_line_of_three_words_is_no_key(tmp_path: Path) -> None:
    (tmp_path / "keys").write_text("a b c\n")
    with pytest.raises(InputError, match=r"KEYS_FILE: line 1 .* is not KEY or NAME KEY"):
        Settings(keys_file=tmp_path / "keys").keys()


def test_the_log_goes_to_standard_output_as_it_is(program: FastAPI) -> None:
    stated = configured(program, port=0).log_config
    assert isinstance(stated, dict)
    handler = stated["handlers"][stated["loggers"]["shoal.api.access"]["handlers"][0]]
    assert handler["stream"] == "ext://sys.stdout"
    assert stated["formatters"][handler["formatter"]]["format"] == "%(message)s"
    logging.getLogger("shoal.api.access").propagate = True
