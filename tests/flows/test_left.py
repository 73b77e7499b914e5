"""Runs whose process was stopped or killed are ended, those that somebody runs are not."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from typing import Any
from uuid import UUID

import pytest
from shoal.home import home
from shoal_flows import alive
from shoal_flows.left import UNSTARTED, WHY, Unstarted, end_left
from shoal_flows.tracking import store

OPEN = "from shoal_flows.tracking import store\nwith store.open_run('Forward', 'name') as run:\n"
RUN = OPEN + "    print(run.run_id, flush=True)\n    input()\n"


@pytest.fixture(scope="module")
def client() -> Any:
    return store.connect()


@contextmanager
def another(program: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A process that runs a program, and the first line that it prints."""
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


def status(client: Any, run_id: str) -> str:
    return str(client.get_run(run_id).info.status)


@pytest.mark.slow
def test_a_run_whose_process_was_killed_is_ended_and_one_that_lives_is_not(client: Any) -> None:
    with ExitStack() as stack:
        (killed, left), (living, run_id) = (stack.enter_context(another(RUN)) for _ in range(2))
        assert status(client, left) == status(client, run_id) == "RUNNING"
        assert end_left() == 0
        killed.kill()
        killed.wait()
        assert end_left() == 1
        assert status(client, left) == "KILLED"
        assert client.get_run(left).data.tags["broken_off"] == WHY
        assert status(client, run_id) == "RUNNING"
        assert end_left() == 0
        assert living.stdin is not None
        living.communicate("\n", timeout=120)
        assert status(client, run_id) == "FINISHED"
        assert "broken_off" not in client.get_run(run_id).data.tags
    assert end_left() == 0


@pytest.mark.slow
def test_what_another_mlflow_knows_is_left_to_whoever_uses_that(
    client: Any, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    with another(RUN) as (process, run_id):
        process.kill()
        process.wait()
        with monkeypatch.context() as settings:
            settings.setenv("MLFLOW_TRACKING_URI", f"sqlite:///{tmp_path / 'other.db'}")
            assert end_left() == 0
            settings.setenv("MLFLOW_TRACKING_URI", "http://127.0.0.1:9")
            assert end_left() == 0
        assert end_left() == 1
        assert status(client, run_id) == "KILLED"


@pytest.mark.slow
def test_a_run_that_is_interrupted_is_killed_and_not_failed(client: Any) -> None:
    with pytest.raises(KeyboardInterrupt), store.open_run("Forward", "stopped") as run:
        raise KeyboardInterrupt
    assert status(client, run.run_id) == "KILLED"


def test_a_run_is_held_once_and_seen_by_its_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(alive.WORKER, "one")
    let_go = alive.hold(alive.MLFLOW, "run", "")
    alive.hold(alive.MLFLOW, "run", "")()  # a second time changes nothing
    (mark,) = alive.of_worker("one")
    assert (mark.run_id, mark.pid) == ("run", os.getpid())
    assert alive.of_worker("two") == []
    assert alive.settle(lambda _: True) == 0
    let_go()
    assert alive.of_worker("one") == []


@pytest.fixture(scope="module")
def prefect() -> Iterator[Any]:
    """A client of a Prefect server of its own."""
    from shoal_flows import server

    server.start()
    server.wait()
    from prefect.client.orchestration import get_client
    from prefect.context import get_settings_context, use_profile

    try:
        # Another test of this process may have let Prefect read its settings before.
        profile = use_profile(get_settings_context().profile, include_current_context=False)
        with profile, get_client(sync_client=True) as client:
            yield client
    finally:
        server.stop()


@pytest.mark.slow
def test_a_flow_whose_process_was_killed_is_crashed(prefect: Any) -> None:
    from prefect import flow
    from prefect.states import Running

    @flow
    def some() -> None:
        pass

    run, scheduled = (prefect.create_flow_run(some, state=state) for state in (Running(), None))
    hold = "import sys\nfrom shoal_flows import alive\nfor one in sys.argv[1:]: alive.hold('prefect', one, '')\n"
    subprocess.run([sys.executable, "-c", hold, str(run.id), str(scheduled.id), str(UUID(int=1))], check=True)
    assert end_left() == 3
    ended = prefect.read_flow_run(run.id).state
    assert ended.is_crashed()
    assert ended.message == WHY
    assert not prefect.read_flow_run(scheduled.id).state.is_final()


@pytest.mark.slow
def test_a_run_that_no_process_begins_is_crashed(prefect: Any) -> None:
    """Of this pool alone, after two looks at the same state; not one that a process holds, nor one that waits."""
    from prefect import flow
    from prefect.client.schemas.actions import WorkPoolCreate
    from prefect.states import Pending, Running

    @flow
    def some() -> None:
        pass

    for pool in ("ours", "theirs"):
        prefect.create_work_pool(WorkPoolCreate(name=pool, type="process"))

    def made(state: Any, pool: str = "ours") -> Any:
        deployment = prefect.create_deployment(prefect.create_flow(some), f"of {pool}", work_pool_name=pool)
        return prefect.create_flow_run_from_deployment(deployment, state=state).id

    left, held, moved = (made(Pending(name="Submitting")) for _ in range(3))
    others = [made(None), made(Running()), made(Pending(), "theirs"), held, moved]
    let_go = alive.hold(alive.PREFECT, str(held), "")
    unstarted = Unstarted("ours")
    assert unstarted.end(1e-9) == 0
    prefect.set_flow_run_state(moved, Pending(), force=True)
    assert unstarted.end(1e-9) == 1
    let_go()
    assert prefect.read_flow_run(left).state.is_crashed()
    assert prefect.read_flow_run(left).state.message == UNSTARTED
    assert not any(prefect.read_flow_run(run).state.is_final() for run in others)


@pytest.mark.slow
@pytest.mark.usefixtures("prefect")
def test_a_flow_holds_its_run_until_it_has_ended() -> None:
    from prefect import flow
    from shoal_flows.flows.marked import marked

    seen = []

    @flow
    def some() -> None:
        seen.extend(path.name for path in alive._marks())

    left = alive.Mark(alive.PREFECT, str(UUID(int=2)), "", pid=1, worker="")
    (home() / "running" / "left").write_text(json.dumps(asdict(left)))
    marked(some)
    some()
    assert len(seen) == 1
    assert seen[0].startswith("prefect-")
    assert alive._marks() == []
