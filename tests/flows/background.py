"""What Prefect's background services do to a deployment, seen from outside."""

from __future__ import annotations

import re
import sqlite3
import time
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

from deployed import PATIENCE, artifacts_of, call, token

OFTEN = {
    "PREFECT_SERVER_SERVICES_SCHEDULER_LOOP_SECONDS": "5",
    "PREFECT_SERVER_SERVICES_DB_VACUUM_LOOP_SECONDS": "5",
    "PREFECT_SERVER_CONCURRENCY_INITIAL_DEPLOYMENT_LEASE_DURATION": "120",
}
"""Loops of a minute and of an hour, and five minutes after which who holds a slot and is silent loses it.

Two minutes, not half a one: a night has to have started by then, on a busy machine too.
"""


def until(true: Callable[[], Any], what: str) -> Any:
    """What a question answers as soon as that is true; a server that is away for a while is asked again."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with suppress(OSError):
            if found := true():
                return found
        time.sleep(0.3)
    raise AssertionError(f"not within {PATIENCE:g} s: {what}")


def nights(prefect: str) -> list[dict[str, Any]]:
    """The nights that are scheduled, in the order of their times, as soon as there are any."""
    night = call(f"{prefect}/api/deployments/name/nightly/night")["id"]
    wanted = {
        "deployments": {"id": {"any_": [night]}},
        "flow_runs": {"state": {"type": {"any_": ["SCHEDULED"]}}},
        "sort": "EXPECTED_START_TIME_ASC",
    }
    return list(until(lambda: call(f"{prefect}/api/flow_runs/filter", wanted), "a night is scheduled"))


def comes_by_itself(prefect: str, name: str, parameters: Mapping[str, object]) -> dict[str, Any]:
    """The first run that a schedule makes of a deployment, some ten seconds ahead, when a worker has begun it.

    The schedule and the runs to come are gone then.
    """
    schedules = f"{prefect}/api/deployments/{call(f'{prefect}/api/deployments/name/{name}')['id']}/schedules"
    first = datetime.now(UTC) + timedelta(seconds=10)
    # A minute later another one: a scheduler that is late passes over what is past.
    rule = {"interval": 60, "anchor_date": first.isoformat()}
    (schedule,) = call(schedules, [{"schedule": rule, "active": True, "parameters": parameters}])

    def begun() -> list[dict[str, Any]]:
        wanted = {"flow_runs": {"start_time": {"is_null_": False}}, "sort": "EXPECTED_START_TIME_ASC"}
        runs = call(f"{prefect}/api/flow_runs/filter", wanted)
        # The next one is cancelled where the first takes more than a minute to start and only one may run.
        ours = [run for run in runs if run["auto_scheduled"] and run["created_by"]["id"] == schedule["id"]]
        return [run for run in ours if run["state_type"] != "CANCELLED"]

    run = until(begun, "a run of the schedule")[0]
    delete = Request(f"{schedules}/{schedule['id']}", headers=token(schedules), method="DELETE")
    until(lambda: urlopen(delete, timeout=30).close() is None, "the schedule is gone")
    return dict(run)


def comes_late(prefect: str, run: dict[str, Any]) -> None:
    """A run that no worker takes is said to be late; cancelled, it is no more waited for."""
    where = f"{prefect}/api/flow_runs/{run['id']}"
    until(lambda: call(where)["state_name"] == "Late", "a run is late")
    call(f"{where}/set_state", {"state": {"type": "CANCELLED"}, "force": True})


def automate(prefect: str, name: str, after: str) -> None:
    """State an automation that pauses one deployment when a run of another has ended well."""
    paused, watched = (call(f"{prefect}/api/deployments/name/{one}")["id"] for one in (name, after))
    trigger = {
        "type": "event",
        "posture": "Reactive",
        "expect": ["prefect.flow-run.Completed"],
        "match_related": {"prefect.resource.id": f"prefect.deployment.{watched}"},
        "threshold": 1,
        "within": 0,
    }
    action = {"type": "pause-deployment", "source": "selected", "deployment_id": paused}
    call(f"{prefect}/api/automations/", {"name": f"after {after}", "trigger": trigger, "actions": [action]})


def goes_after_90_days(at: Mapping[str, str], home: Path, old: dict[str, Any], young: dict[str, Any]) -> None:
    """A run that ended 91 days ago is removed with what it showed; one that ended 89 days ago stays."""
    runs = f"{at['PREFECT']}/api/flow_runs"
    for run, days in ((young, 89), (old, 91)):
        _end(at, home, run["id"], datetime.now(UTC) - timedelta(days=days))
    wanted = {"flow_runs": {"id": {"any_": [old["id"], young["id"]]}}}
    until(lambda: [run["id"] for run in call(f"{runs}/filter", wanted)] == [young["id"]], "the old run is gone")
    until(lambda: artifacts_of(at["PREFECT"], old) == {}, "and what it showed")
    assert artifacts_of(at["PREFECT"], young)


def _end(at: Mapping[str, str], home: Path, run: str, when: datetime) -> None:
    """Let a run have ended then, in the database itself: Prefect's interface sets its own time."""
    text = when.strftime("%Y-%m-%d %H:%M:%S.%f")
    if (file := home / "prefect" / "prefect.db").exists():
        with closing(sqlite3.connect(file, timeout=60)) as database, database:
            assert database.execute("UPDATE flow_run SET end_time = ? WHERE id = ?", (text, run)).rowcount == 1
        return
    import psycopg2

    password, port = (home / "postgres" / "password").read_text().strip(), urlsplit(at["POSTGRES"]).port
    with (
        closing(psycopg2.connect(host="127.0.0.1", port=port, user="shoal", password=password, dbname="prefect")) as it,
        it,
        it.cursor() as cursor,
    ):
        cursor.execute("UPDATE flow_run SET end_time = %s WHERE id = %s", (f"{text}+00", run))
        assert cursor.rowcount == 1


def fails_aloud(home: Path) -> None:
    """A scheduler that cannot read its schedules says so in the output of `make up`. Nothing is scheduled any more."""
    with closing(sqlite3.connect(home / "prefect" / "prefect.db", timeout=60)) as database, database:
        database.execute("ALTER TABLE deployment_schedule RENAME TO deployment_schedule_away")
    line = re.compile(r"ERROR.* schedule_deployments\(\)")
    until(lambda: line.search((home / "up.log").read_text(errors="replace")), "the scheduler's failure is told")


def slots_taken(prefect: str) -> int:
    """How many nights run, as far as Prefect knows."""
    limit = call(f"{prefect}/api/deployments/name/nightly/night")["global_concurrency_limit"]
    return int(call(f"{prefect}/api/v2/concurrency_limits/{limit['id']}")["active_slots"])
