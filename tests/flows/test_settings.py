from __future__ import annotations

import os
import socket
import tempfile
from pathlib import Path

import pytest
from shoal.errors import InputError
from shoal_flows import events, settings
from shoal_flows import ui as of_ui
from shoal_flows.terminal import following
from shoal_flows.ui import ui


def test_state_lies_below_the_home_and_the_user_wins(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(os, "environ", {"SHOAL_HOME": str(tmp_path), "PREFECT_HOME": "elsewhere"})
    settings.apply()
    assert os.environ["PREFECT_HOME"] == "elsewhere"
    assert os.environ["MLFLOW_TRACKING_URI"] == f"sqlite:///{tmp_path}/mlflow.db"
    assert os.environ["MLFLOW_DISABLE_TELEMETRY"] == os.environ["DO_NOT_TRACK"] == "true"
    assert settings.tracking_server() is None


def test_the_tests_leave_the_users_runs_alone() -> None:
    settings.apply()
    place = os.environ["SHOAL_HOME"]
    assert place.startswith(tempfile.gettempdir())
    assert os.environ["MLFLOW_TRACKING_URI"] == f"sqlite:///{place}/mlflow.db"
    assert os.environ["PREFECT_HOME"].startswith(place)


def test_ui_refuses_a_port_in_use_in_one_line() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match=r"^port: cannot listen on 127.0.0.1:\d+: .*--port$"):
            ui("127.0.0.1", taken.getsockname()[1], browser=False)


def test_ui_names_the_server_that_has_the_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://tracking:5000")
    with pytest.raises(InputError, match="the runs are on http://tracking:5000"):
        ui("127.0.0.1", 5000, browser=False)


def test_pages_of_an_address_are_reached_under_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_ALLOWED_HOSTS", "shoal.example.org")
    assert of_ui.with_host("192.0.2.7")["SHOAL_ALLOWED_HOSTS"] == "shoal.example.org,192.0.2.7"
    assert of_ui.with_host("0.0.0.0")["SHOAL_ALLOWED_HOSTS"] == "shoal.example.org"


def test_work_is_announced_with_its_end() -> None:
    heard: list[tuple[str, str]] = []
    with events.listening(lambda name, state: heard.append((name, state))):
        with events.work("one"):
            pass
        with pytest.raises(ValueError, match="no"), events.work("two"):
            raise ValueError("no")
    with events.work("unheard"):
        pass
    assert heard == [("one", "started"), ("one", "done"), ("two", "started"), ("two", "failed")]


def test_a_log_file_has_a_line_from_the_first_second(capsys: pytest.CaptureFixture[str]) -> None:
    """Also while kernels are compiled: the lines of the compilation are passed on as they come."""
    with following("flow nightly") as listener, events.listening(listener):
        assert capsys.readouterr().err == "flow nightly: starting\n"
        with events.work("kernels"):
            events.note("compiling [2] kernels")
            assert capsys.readouterr().err == "compiling [2] kernels\n"
    assert capsys.readouterr().err == "done: kernels\n"
