"""`shoal doctor` finds what is wrong and says what to do."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

import pytest
from shoal import doctor
from shoal_flows.deployment import processes


def test_a_server_that_does_not_answer_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        # Bound but not listening: nobody answers, and nobody else can take the port.
        monkeypatch.setenv("PREFECT_API_URL", f"http://127.0.0.1:{probe.getsockname()[1]}/api")
        check = doctor.check_server("Prefect", "PREFECT_API_URL", "")
    assert not check.ok
    assert "unset PREFECT_API_URL" in check.advice


def test_a_missing_package_names_its_extra() -> None:
    check = doctor.check_package("no-such-package", "services")
    assert not check.ok
    assert "'services'" in check.advice


def test_an_engine_that_is_wrong_is_found() -> None:
    check = doctor.check_engine("casadi", close=0.0)
    assert not check.ok
    assert "off a pendulum" in check.found


def test_a_port_in_use_by_another_program_is_told() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        other.settimeout(5)
        found = doctor.check_port(other.getsockname()[1], "MLflow", patience=0.2).found
    assert "another program" in found


def test_ports_are_those_that_the_environment_states(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same settings as those of `make up`; what is no port is named with its setting."""
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        free = closed.getsockname()[1]
        for name, port in (("PREFECT", str(free)), ("GAUSS", str(free)), ("MLFLOW", "5000x")):
            monkeypatch.setenv(f"SHOAL_{name}_PORT", port)
        checks = doctor.check_ports()
        assert [check.found for check in checks if check.name == f"port {free}"] == [
            "free for Prefect",
            "free for gauss",
        ]
        assert f"no Prefect server at http://127.0.0.1:{free}/api" in checks[0].found
        assert [check.found for check in checks if not check.ok] == [
            "SHOAL_MLFLOW_PORT: '5000x' is not a port between 1 and 65535"
        ]
        assert processes.port("prefect") == free


NIGHT = {"id": "1", "paused": False, "status": "READY", "schedules": [{"active": True}]}
COMING = [{"expected_start_time": "2026-12-01T02:00:00Z"}]


@contextmanager
def prefect(answers: dict[str, Any]) -> Iterator[str]:
    """A server with Prefect's addresses that gives these answers, and 404 to all else."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.rfile.read(int(self.headers.get("Content-Length") or 0))
            self.send_response(200 if self.path in answers else 404)
            self.end_headers()
            self.wfile.write(json.dumps(answers.get(self.path)).encode())

        do_POST = do_GET

        def log_message(self, *_: object) -> None:
            """Nobody reads it."""

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever).start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/api"
        finally:
            server.shutdown()


@pytest.mark.parametrize(
    ("night", "coming", "ok", "word"),
    [
        (NIGHT, COMING, True, "1 scheduled, the next at 2026-12-01T02:00:00Z"),
        (NIGHT | {"status": "NOT_READY"}, COMING, True, "no worker takes it: make up ARGS='--with nightly'"),
        (NIGHT, [], False, "a schedule and no scheduled night"),
        (NIGHT | {"paused": True}, COMING, False, "is off"),
        (NIGHT | {"schedules": [{"active": False}]}, [], False, "is off"),
        (None, [], False, "has no deployment nightly/night"),
    ],
)
def test_nights_that_never_come_are_found(night: dict[str, Any] | None, coming: list[Any], ok: bool, word: str) -> None:
    answers = {"/api/health": True, "/api/flow_runs/filter": coming}
    if night is not None:
        answers["/api/deployments/name/nightly/night"] = night
    with prefect(answers) as address:
        check = doctor.check_nights(address)
    assert check.ok == ok
    assert word in check.found
    assert bool(check.advice) != ok


def test_without_a_server_no_nights_are_expected() -> None:
    with prefect({"/api/health": True}) as address:
        pass
    assert doctor.check_nights(address).ok
