"""Many nights in a row, by a clock of their own: every trend is whole, and nothing grows but what is kept."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from shoal_validation.nightly.hold import hold
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.measure import Measured

FIRST = datetime(2026, 12, 20, 2, tzinfo=UTC)
"""Over the end of a year."""
METHODS = ("one", "two")
PER_NIGHT = 40_000
"""Bytes that a night of two lines may leave, in files or in one database: what it found, and the page of that day."""


def plan(night: int) -> list[Line]:
    """Two lines, whose errors tell which night it is."""
    measured = partial(Measured, "ok", 1e-9 * (100 + night), 0.1)
    return [Line("pendulum", "gauss", method, 1e-6, "made up", measured) for method in METHODS]


def clock(night: int) -> datetime:
    return FIRST + timedelta(days=night)


def sizes(folder: Path) -> dict[str, int]:
    return {path.relative_to(folder).as_posix(): path.stat().st_size for path in folder.rglob("*") if path.is_file()}


def check_page(page: str, nights: int) -> None:
    """Both lines of the plan as a curve of their error and one of their time, and a way to every night."""
    for quantity in ("error", "time"):
        assert len(re.findall(rf'aria-label="{quantity} over {nights} nights: [^"]*"', page)) == len(METHODS)
    assert "without" not in re.findall(r'aria-label="([^"]*)"', page)
    for night in range(nights):
        assert f"night-{clock(night):%Y-%m-%dT%H%M}" in page


@pytest.mark.slow
def test_nights_in_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    nights = 4
    for night in range(nights):
        held = hold(plan(night), quick=True, now=clock(night))
        assert held.night.passed
        assert held.night.started == f"{clock(night):%Y-%m-%dT%H:%M:%S}.000"
        assert held.night.lines[0].error == 1e-9 * (100 + night)
    check_page(held.page.read_text(), nights)
    assert len(sizes(tmp_path)) == nights + 1
    assert sum(sizes(tmp_path).values()) < nights * PER_NIGHT


NIGHTS = 30
PROGRAM = f"""
import json, sys
from importlib import import_module
sys.path.insert(0, {str(Path(__file__).parent)!r})
from functools import partial
from pathlib import Path
from test_nights import clock, plan, sizes
from shoal.home import home
from shoal_flows import run
from shoal_validation.nightly.hold import hold

module = import_module("shoal_flows.flows.nightly")
for night in range({NIGHTS}):
    module.plan = lambda *_: plan(night)
    module.hold = partial(hold, now=clock(night))
    assert run.run_flow("nightly", {{"quick": True}}).trusted
    print(json.dumps(sizes(home())), flush=True)
"""


@pytest.fixture
def temporary() -> Iterator[Path]:
    """A folder of few letters: the path of a socket may have 107."""
    with TemporaryDirectory(prefix="night-") as folder:
        yield Path(folder)


@pytest.mark.slow
def test_thirty_nights_through_prefect_and_mlflow(tmp_path: Path, temporary: Path) -> None:
    """Files of the state keep their number; databases grow by a bounded amount; MLflow has every night."""
    home = tmp_path / "home"
    ours = {name: value for name, value in os.environ.items() if not name.startswith(("PREFECT_", "MLFLOW_"))}
    environment = {**ours, "SHOAL_HOME": str(home), "TMPDIR": str(temporary)}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    after = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(after) == NIGHTS

    kept = re.compile(r"validation/night-|artifacts/|results/")
    others = [{name for name in one if not kept.match(name)} for one in after]
    assert others[-1] == others[2]
    assert not list(temporary.iterdir())
    grown = {name: after[-1][name] - after[2].get(name, 0) for name in others[-1]}
    files = sum(size for name, size in after[-1].items() if kept.match(name))
    figures = {"files per night": files / NIGHTS, **{name: size / (NIGHTS - 3) for name, size in grown.items()}}
    sys.stdout.write(f"{figures}\n")  # shown with -rP
    assert files < NIGHTS * PER_NIGHT
    assert all(size < NIGHTS * PER_NIGHT for size in grown.values())

    check_page((home / "validation" / "index.html").read_text(), NIGHTS)
    from mlflow import MlflowClient

    client = MlflowClient(f"sqlite:///{home / 'mlflow.db'}")
    runs = client.search_runs([client.get_experiment_by_name("Validation").experiment_id])
    found = {one.info.run_name: one.data.metrics for one in runs}
    assert set(found) == {f"night {clock(night):%Y-%m-%dT%H:%M:%S}.000" for night in range(NIGHTS)}
    for night in range(NIGHTS):
        metrics = found[f"night {clock(night):%Y-%m-%dT%H:%M:%S}.000"]
        assert [metrics[f"error/pendulum/gauss/{method}"] for method in METHODS] == [1e-9 * (100 + night)] * 2
