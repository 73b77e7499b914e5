"""`shoal rerun`: repeat a study from its run in MLflow alone, and say whether the figures agree."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from shoal.errors import ComputationError, InputError

from shoal_flows import provenance, remembered, run, settings
from shoal_flows.terminal import notice
from shoal_flows.tracking import origin, outbox
from shoal_flows.tracking.record import LOCAL

AGREEMENT = 1e-6
"""Relative difference below which two figures are the same: what another processor may do to a converged answer."""
_TIMES = ("wall_s", "seconds")


@dataclass(frozen=True)
class Repeated:
    """Figures of two runs: name -> (before, now), both with those of their parts; versions that differ, likewise.

    verdicts: before and now; doubts: every reason not to trust the answer that is there now
    """

    before: str
    now: str
    figures: dict[str, tuple[float, float]]
    versions: dict[str, tuple[str, str]]
    verdicts: tuple[str, str] = ("", "")
    doubts: tuple[str, ...] = ()

    @property
    def agree(self) -> bool:
        """Return whether there are figures and all of them agree."""
        return bool(self.figures) and not self.different

    @property
    def complaint(self) -> str:
        """Return why the repetition does not confirm a trusted answer; empty if it does."""
        if self.doubts:
            told = f"the figures {'agree, but are' if self.agree else 'are'} not to be trusted"
            return f"{told}: {'; '.join(self.doubts)}"
        return "" if self.agree else "the figures do not agree"

    @property
    def different(self) -> dict[str, tuple[float, float]]:
        """Figures that do not agree; one that only one of the runs has is NaN in the other."""
        return {
            name: (old, new)
            for name, (old, new) in self.figures.items()
            if not math.isclose(old, new, rel_tol=AGREEMENT, abs_tol=1e-15)
        }

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal rerun --json` prints."""
        return {
            "status": "failed" if self.complaint else "ok",
            "message": self.complaint,
            "verdicts": self.verdicts,
            "before": self.before,
            "now": self.now,
            "figures": len(self.figures),
            "different": self.different,
            "versions": self.versions,
        }


def rerun(run_id: str) -> Repeated:
    """Repeat the flow of a run with what it was given. Raises InputError, ComputationError."""
    settings.apply()
    from shoal_flows.tracking.store import answering, connect

    client, known = connect(), outbox.address(run_id)
    with TemporaryDirectory() as folder:
        with answering():
            flow, parameters = _origin(client, known, Path(folder))
        with remembered.recomputed():
            # A text in quotes: `run_flow` reads texts as YAML.
            texts = {name: json.dumps(value) for name, value in parameters.items() if isinstance(value, str)}
            answer = run.run_flow(flow, {**parameters, **texts})
    now = str(answer.run_id)
    if now.startswith(LOCAL):
        notice()
        raise ComputationError("rerun: MLflow stopped answering, so that the figures cannot be compared yet")
    with answering():
        old, new = dict(_figures(client, known)), dict(_figures(client, now))
        tags = [client.get_run(one).data.tags for one in (known, now)]
    figures = {name: (old.get(name, math.nan), new.get(name, math.nan)) for name in {**old, **new}}
    names = (*(f"version.{package}" for package in provenance.PACKAGES), "source.revision", "platform")
    versions = {n: (tags[0].get(n, "?"), tags[1].get(n, "?")) for n in names if tags[0].get(n) != tags[1].get(n)}
    verdicts = tags[0].get("verdict", ""), tags[1].get("verdict", "")
    doubts = () if answer.trusted else tuple(answer.doubts())
    return Repeated(known, now, figures, versions, verdicts, doubts)


def main(run_id: str, as_json: bool) -> str:
    """Print what `rerun` found; returns its complaint."""
    from rich.console import Console
    from shoal.json_values import json_text

    repeated = rerun(run_id)
    if as_json:
        print(json_text(repeated.to_json()))  # noqa: T201 - this is the output
        return repeated.complaint
    console = Console(highlight=False)
    console.print(f"run {repeated.now} repeats {repeated.before}", soft_wrap=True)
    old, new = repeated.verdicts
    console.print(f"  verdict: {new}" if new == old else f"  verdict: {old or 'not kept'}, now {new}", soft_wrap=True)
    for name, (old, new) in repeated.versions.items():
        console.print(f"  {name}: {old}, now {new}", soft_wrap=True)
    for name, (before, after) in repeated.different.items():
        console.print(f"  {name}: {before:.9g}, now {after:.9g}", soft_wrap=True)
    agree = len(repeated.figures) - len(repeated.different)
    console.print(f"{agree} of {len(repeated.figures)} figures agree within {AGREEMENT:g}")
    return repeated.complaint


def _origin(client: Any, run_id: str, folder: Path) -> tuple[str, dict[str, Any]]:
    from shoal_flows.tracking.store import found_run

    run = found_run(client, run_id)
    if run is None:
        raise InputError(f"run: MLflow knows no run {run_id!r}; `shoal ui` shows those it knows")
    if parent := run.data.tags.get("mlflow.parentRunId"):
        raise InputError(f"run: {run_id} is part of a study; repeat the study: {parent}")
    there = {item.path for item in client.list_artifacts(run_id)}
    if origin.CALL not in there:
        raise InputError(f"run: {run_id} does not say what it was asked for; it was not made by a flow")
    for path in there & {origin.CALL, origin.INPUTS}:
        client.download_artifacts(run_id, path, str(folder))
    flow, parameters = origin.restored(folder)
    if flow == "demo":
        raise InputError(f"run: {run_id} is part of the demo, which is repeated as a whole: shoal demo")
    return flow, parameters


def _figures(client: Any, run_id: str) -> Iterator[tuple[str, float]]:
    """The results of a study and of its parts that a repetition should give again, which times are not."""
    whole = client.get_run(run_id)
    parts = client.search_runs([whole.info.experiment_id], f"tags.`mlflow.parentRunId` = '{run_id}'")
    for one in (whole, *parts):
        prefix = "" if one is whole else f"{one.info.run_name}: "
        for name, value in one.data.metrics.items():
            head, _, tail = name.partition("/")
            timed = head in _TIMES or tail in _TIMES
            if head in ("final", "error", "difference", "interval", "study") and not timed:
                yield prefix + name, value
