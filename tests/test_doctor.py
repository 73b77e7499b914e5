"""`shoal doctor` finds what is wrong and says what to do."""

from __future__ import annotations

import socket

import pytest
from shoal import doctor


def test_a_server_that_does_not_answer_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        # Bound but not listening: nobody answers, and nobody else can take the port.
        monkeypatch.setenv("PREFECT_API_URL", f"http://127.0.0.1:{probe.getsockname()[1]}/api")
        check = doctor._server("Prefect", "PREFECT_API_URL", "")
    assert not check.ok
    assert "unset PREFECT_API_URL" in check.advice


def test_a_missing_package_names_its_extra() -> None:
    check = doctor._package("no-such-package", "services")
    assert not check.ok
    assert "'services'" in check.advice


def test_an_engine_that_is_wrong_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_CLOSE", 0.0)
    check = doctor._engine("casadi")
    assert not check.ok
    assert "off a pendulum" in check.found


def test_a_port_in_use_by_another_program_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_PATIENCE", 0.2)
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        other.settimeout(5)
        found = doctor._port(other.getsockname()[1], "MLflow").found
    assert "another program" in found
