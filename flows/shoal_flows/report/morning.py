"""The morning page: what ran in the last day, whether it is fine, what changed, and where to look."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from jinja2 import PackageLoader
from shoal.atomic_write import atomic_write
from shoal.home import home
from shoal.pictures.pages import environment, software
from shoal_validation.nightly import history
from shoal_validation.nightly.page import headline
from shoal_validation.nightly.result import Night

from shoal_flows import settings
from shoal_flows.report.drifts import DAY, drift_of, machines, words
from shoal_flows.tracking.store import answering, connect

_SERVER = "http://127.0.0.1:5000"
"""Where `shoal ui` and `make up` serve MLflow by default."""


@dataclass(frozen=True)
class PastRun:
    """A run of MLflow without those that are parts of it. begun [s]; doubts: why it is not to be trusted."""

    name: str
    experiment: str
    begun: float
    verdict: str
    doubts: str
    address: str


def refresh() -> Path:
    """Write the page into the home; return where it lies. Raises InputError, ComputationError."""
    page = home() / "index.html"
    text = morning(time.time())
    with atomic_write(page) as part:
        part.write_text(text, encoding="utf-8")
    return page


def morning(now: float) -> str:
    """Return the page of a day that ends at a time [s], without a reference to anything off the machine.

    Raises ComputationError.
    """
    runs, night, drifts = _runs_since(now - DAY), _last_night(), list(_drifts())
    doubted = [run for run in runs if run.doubts]
    wrong = [] if night is None else [line.complaint for line in night.lines if not line.verdict.fine]
    parts = [
        f"{len(runs)} runs in the last 24 hours" + (f", {len(doubted)} not to be trusted" if doubted else ""),
        "no nightly validation yet" if night is None else f"nightly validation: {headline(night).rstrip('.')}",
        f"{len(drifts)} parameters drift" if drifts else "no parameter is known to drift",
    ]
    return (
        environment(PackageLoader("shoal_flows", "report"))
        .get_template("morning.html.j2")
        .render(
            title="This morning",
            trusted=not (doubted or wrong or drifts),
            lead="; ".join(parts) + ".",
            wrong=wrong,
            doubted=doubted,
            drifts=drifts,
            night=night,
            runs=[[_when(run.begun), run.experiment, (run.name, run.address), run.verdict] for run in runs],
            provenance=[("made", f"{_when(now)} UTC"), ("versions", software())],
        )
    )


@answering()
def _runs_since(begin: float) -> list[PastRun]:
    """Return the runs that began after a time [s], newest first."""
    client = connect()
    known = {one.experiment_id: one.name for one in client.search_experiments()}
    server = os.environ.get("SHOAL_MLFLOW_URL") or settings.tracking_server() or _SERVER
    after, found, token = f"attributes.start_time > {int(1000 * begin)}", list[PastRun](), None
    while True:
        page = client.search_runs([*known], after, max_results=1000, order_by=["start_time DESC"], page_token=token)
        found += [_past(run, known, server) for run in page if "mlflow.parentRunId" not in run.data.tags]
        token = page.token
        if not token:
            return found


def _past(run: Any, known: dict[str, str], server: str) -> PastRun:
    place, tags = run.info.experiment_id, run.data.tags
    running = run.info.status == "RUNNING"
    return PastRun(
        run.info.run_name,
        known[place],
        run.info.start_time / 1e3,
        "running" if running else tags.get("verdict", run.info.status.lower()),
        tags.get("doubts", "") or ("it was killed" if run.info.status == "KILLED" else ""),
        f"{server.rstrip('/')}/#/experiments/{place}/runs/{run.info.run_id}",
    )


def _last_night() -> Night | None:
    """Return the latest night that can be read."""
    for file in sorted(history.folder().glob("night-*.json"), reverse=True):
        try:
            return Night.from_json(json.loads(file.read_text(encoding="utf-8")))
        except ValueError:
            continue
    return None


def _drifts() -> Iterator[str]:
    """Yield a sentence for each identified parameter whose drift is significant."""
    for machine, studies in machines().items():
        for name in dict.fromkeys(name for study in studies for name in study.values):
            good, line = drift_of(name, studies)
            if line is not None and line.real:
                yield f"{machine}: {words(name, line, len(good))}"


def _when(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M")
