"""A night of validation in MLflow: one run, so that every line is a curve over the nights."""

from __future__ import annotations

from shoal.json_values import json_text
from shoal_validation.nightly.result import Night

from shoal_flows.tracking.store import open_run


def log_night(night: Night, page: str) -> str:
    """Error and time of every line, counts of the verdicts, the page and the lines; returns the id of the run."""
    kind = "quick" if night.quick else "full"
    tags = {"kind": "night", "night": kind}
    with open_run("Validation", f"night {night.started}", tags=tags) as run:
        wrong = [line.complaint for line in night.lines if not line.verdict.fine]
        run.judge("not as it should be" if wrong else "passed", wrong)
        run.params({"started": night.started, "machine": night.machine, "night": kind, "only": night.only or "all"})
        run.metric("final/wall_s", night.wall_s)
        for verdict, count in night.counts.items():
            run.metric(f"lines/{verdict}", count)
        for line in night.lines:
            # MLflow knows no commas in names.
            name = "/".join(line.key).replace(",", "")
            if line.error is not None:
                run.metric(f"error/{name}", line.error)
            if line.seconds is not None:
                run.metric(f"seconds/{name}", line.seconds)
        if night.changes:
            run.text("".join(f"{change}\n" for change in night.changes), "changes.txt")
        run.text(page, "index.html")
        run.text(json_text(night.to_json(), indent=1), "night.json")
        return run.run_id
