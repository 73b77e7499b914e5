"""kill -9 of `shoal run` at several instants: repeated, it computes what is missing and says the same, bit for bit."""

from __future__ import annotations

import json
import os
import pickle
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from deployed import of_home
from shoal_flows import jobs
from shoal_flows.jobs import Cell

METHODS = ("least-squares", "iafsa")
COMMAND = [sys.executable, "-c", "from shoal.cli import main; main()", "run", "identify", "--json"]
COMMAND += ["--param", "problem=paper-case-1", "--param", f"methods=[{', '.join(METHODS)}]", "--param", "seeds=[0]"]


def environment(home: Path) -> dict[str, str]:
    ours = {name: value for name, value in os.environ.items() if not name.startswith(("PREFECT_", "MLFLOW_"))}
    return {**ours, "SHOAL_HOME": str(home)}


def kept(home: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in home.glob("results/*") if not path.name.startswith(".")}


def figures(estimate: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in estimate.items() if name != "wall_s"}


def wait_until_all_have_gone(home: Path) -> None:
    deadline = time.monotonic() + 300
    while left := of_home(home):
        assert time.monotonic() < deadline, f"still there: {left}"
        time.sleep(0.1)


@pytest.mark.slow
def test_told_to_end_by_a_service_manager(tmp_path: Path) -> None:
    """SIGTERM is what Ctrl-C is: one line, and nobody is left behind."""
    with subprocess.Popen(COMMAND, env=environment(tmp_path), stderr=subprocess.PIPE, text=True) as study:
        assert study.stderr is not None
        assert any(told.startswith("done: kernels") for told in study.stderr)
        study.terminate()
        rest = study.stderr.read()
    assert study.returncode == 130
    assert rest.endswith("shoal: stopped\n")
    assert "resource_tracker" not in rest
    wait_until_all_have_gone(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "group"),
    [
        pytest.param("done: kernels", True, id="early"),
        pytest.param("done: paper-case-1, least-squares", True, id="in the middle"),
        pytest.param("done: paper-case-1, least-squares", False, id="the first process alone"),
        pytest.param("done: paper-case-1, iafsa", True, id="late"),
    ],
)
def test_killed_and_repeated(line: str, group: bool, tmp_path: Path) -> None:
    with subprocess.Popen(
        COMMAND, env=environment(tmp_path), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True
    ) as study:
        assert study.stderr is not None
        assert any(told.startswith(line.encode()) for told in study.stderr)
        (os.killpg if group else os.kill)(study.pid, signal.SIGKILL)
    wait_until_all_have_gone(tmp_path)
    before = kept(tmp_path)
    assert all(pickle.loads(content) for content in before.values())

    again = subprocess.run(COMMAND, env=environment(tmp_path), capture_output=True, text=True, check=True)
    reused = re.search(r"^(\d+) results were computed before", again.stderr, re.MULTILINE)
    assert (int(reused[1]) if reused else 0) == len(before)
    after = kept(tmp_path)
    assert len(after) == len(METHODS)
    assert before.items() <= after.items()
    assert [path.name for path in (tmp_path / "outbox").iterdir() if path.is_dir()] == []

    measurement = jobs.measured("paper-case-1")
    for method, found in zip(METHODS, json.loads(again.stdout)["estimates"], strict=True):
        undisturbed = jobs.fit(Cell("paper-case-1", method), measurement).estimate.to_json()
        assert figures(found) == figures(json.loads(json.dumps(undisturbed)))
