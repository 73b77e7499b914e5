"""`shoal ui`: MLflow's pages over the runs, until Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import webbrowser
from collections.abc import Mapping
from contextlib import suppress
from urllib.error import URLError
from urllib.request import urlopen

from rich.console import Console
from shoal.api.guard import SETTING, is_wildcard
from shoal.errors import ComputationError, InputError
from shoal.ports import check_free

from shoal_flows import settings
from shoal_flows.report import morning
from shoal_flows.tracking.addresses import latest_study

_PATIENCE = 600.0
"""In s, as of `make up`: on a busy machine MLflow's server takes minutes; one that dies is noticed at once."""


def ui(host: str, port: int, *, browser: bool) -> None:
    """Serve MLflow, and write the morning page. browser: open the page in it. Raises InputError, ComputationError."""
    settings.apply()
    if address := settings.tracking_server():
        raise InputError(f"MLFLOW_TRACKING_URI: the runs are on {address}; browse them there")
    console = Console(stderr=True, highlight=False)
    check_free(host, port)
    # A service manager asks with SIGTERM for what a person does with Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    process = _start(_mlflow(host, port), "mlflow-ui.log", with_host(host))
    try:
        _wait(process, host, port)
        console.print(f"MLflow:  http://{host}:{port}  (Ctrl-C stops it)", soft_wrap=True)
        page = morning.refresh().as_uri()
        console.print(f"this morning:      {page}", soft_wrap=True)
        if browser:
            webbrowser.open(page)
        if is_wildcard(host) and not os.environ.get(SETTING):
            text = f"{SETTING} is empty: other machines are refused; list the names by which they reach this one"
            console.print(text, soft_wrap=True)
        latest = latest_study(f"http://{host}:{port}")
        if latest is not None:
            console.print(f"the latest study:  {latest[0]}", soft_wrap=True)
            console.print(f"all studies:       {latest[1]}", soft_wrap=True)
        where = f"PREFECT_HOME={os.environ['PREFECT_HOME']} {sys.executable} -m shoal_flows.prefect_server"
        console.print(f"Prefect's flow runs: {where}", soft_wrap=True)
        while process.poll() is None:
            time.sleep(0.3)
        raise ComputationError(f"a server ended by itself; see {settings.log_folder()}")
    except KeyboardInterrupt:
        console.print("stopped")
    finally:
        _stop(process)


def _mlflow(host: str, port: int) -> list[str]:
    store = ["--backend-store-uri", os.environ["MLFLOW_TRACKING_URI"]]
    store += ["--artifacts-destination", settings.artifact_folder().as_uri()]
    address = ["--host", host, "--port", str(port), "--workers", "1"]
    return [sys.executable, "-m", "mlflow", "server", "--app-name", "shoal", *address, *store]


def with_host(host: str) -> dict[str, str]:
    """Return the environment of a server that answers to the address that it listens on."""
    names = [os.environ.get(SETTING, ""), "" if is_wildcard(host) else host]
    return {**os.environ, SETTING: ",".join(filter(None, names))}


def _start(command: list[str], log: str, environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
    with (settings.log_folder() / log).open("wb") as out:
        # Its own session: Ctrl-C reaches this process only, which then stops the server and its workers together.
        return subprocess.Popen(
            command,
            env=dict(environment),
            stdout=out,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )


def _stop(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGTERM)
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)


def _wait(process: subprocess.Popen[bytes], host: str, port: int) -> None:
    deadline = time.monotonic() + _PATIENCE
    reachable = "127.0.0.1" if host == "0.0.0.0" else host
    while True:
        with suppress(URLError, OSError), urlopen(f"http://{reachable}:{port}/health", timeout=5):
            return
        if process.poll() is not None or time.monotonic() > deadline:
            raise ComputationError(f"the MLflow server did not start; see {settings.log_folder() / 'mlflow-ui.log'}")
        time.sleep(0.2)
