"""`make up`: everything on this machine, in order, until Ctrl-C; `python -m shoal_flows.deployment.up --help`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

import click
from rich.console import Console
from shoal.errors import ComputationError, ShoalError
from shoal.home import home

from shoal_flows import choices, settings
from shoal_flows.deployment import processes
from shoal_flows.deployment.parts import Line, honcho, look_after
from shoal_flows.deployment.postgres import Postgres


@click.command()
@click.option("--postgres", is_flag=True, help="Keep the state of both servers in a PostgreSQL of its own.")
@click.option("--with", "profiles", multiple=True, metavar="PROFILE", help="nightly or scale (repeatable).")
@click.option("--without", multiple=True, metavar="NAME", help="Leave a process of the Procfile out (repeatable).")
def main(postgres: bool, profiles: tuple[str, ...], without: tuple[str, ...]) -> None:
    """Run MLflow, Prefect with a worker, and the engines' services until Ctrl-C."""
    try:
        stages = [tuple(n for n in stage if n not in without) for stage in processes.chosen(profiles)]
        run([stage for stage in stages if stage], postgres=postgres)
    except ShoalError as error:
        click.echo(f"up: {error}", err=True)
        sys.exit(error.exit_status)


def run(stages: Sequence[Sequence[str]], *, postgres: bool = False) -> None:
    """Start stage after stage, apply the deployments, start again what dies; stop in the reverse order.

    Raises InputError, and ComputationError if a process does not start, or not any more.
    """
    console = Console(stderr=True, highlight=False)
    for name in (name for stage in stages for name in stage):
        processes.check_port(name)
    # A service manager asks with SIGTERM for what a person does with Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    port = int(os.environ.get("SHOAL_POSTGRES_PORT") or 5433)
    keeping = [Postgres(home() / "postgres", port)] if postgres else []
    try:
        with ExitStack() as stack:
            for database in keeping:
                stack.callback(database.stop)
                database.begin()
            environment = environment_of(keeping[0].stores if keeping else {})
            started = [line for stage in stages for line in _stage(stage, environment, stack, console)]
            if any("worker" in stage for stage in stages):
                _deploy(environment)
                choices.remember(environment["PREFECT_API_URL"])
                stack.callback(choices.remember, None)
            _announce(console)
            look_after([*keeping, *started], console)
    except KeyboardInterrupt:
        console.print("stopped")


def environment_of(stores: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of every process: home, addresses of both servers, programs of this Python."""
    folder = home()
    stated = {
        "SHOAL_HOME": str(folder),
        "MLFLOW_TRACKING_URI": f"http://127.0.0.1:{processes.port('mlflow')}",
        "PREFECT_API_URL": f"http://127.0.0.1:{processes.port('prefect')}/api",
        "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath))),
        "PYTHONUNBUFFERED": "1",
    }
    kept = {
        "MLFLOW_BACKEND_STORE_URI": f"sqlite:///{folder / 'mlflow.db'}",
        "MLFLOW_ARTIFACTS_DESTINATION": settings.artifact_folder().as_uri(),
        # Artifacts stay readable without the server: `shoal run` and `shoal ui` use the same database.
        "MLFLOW_DEFAULT_ARTIFACT_ROOT": settings.artifact_folder().as_uri(),
        # Results are in MLflow; Prefect's entries are of use for a while (90 days).
        "PREFECT_SERVER_SERVICES_DB_VACUUM_ENABLED": "events,flow_runs",
        # Who holds the slot of the nights outlives the server: one that was broken off leaves it after five minutes.
        "PREFECT_SERVER_CONCURRENCY_LEASE_STORAGE": "prefect.server.concurrency.lease_storage.filesystem",
        # Here nobody shows progress: what goes wrong in the servers, their background services and the flows is seen.
        "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "ERROR",
    }
    return {**settings.defaults(folder), **kept, **os.environ, **stated, **stores}


def _stage(names: Sequence[str], environment: Mapping[str, str], stack: ExitStack, console: Console) -> list[Line]:
    """These lines of the Procfile, side by side, when all are ready; they end with the stack."""
    lines = [Line(name, environment) for name in names]
    for line in lines:
        stack.callback(line.stop)
        line.begin()
    for line in lines:
        line.ready()
        console.print(f"{line.name} is ready")
    return lines


def _deploy(environment: Mapping[str, str]) -> None:
    command = [sys.executable, "-m", *honcho("deploy")]
    done = subprocess.run(command, env=dict(environment), stdin=subprocess.DEVNULL, cwd=processes.FOLDER, check=False)
    if done.returncode:
        raise ComputationError("the deployments could not be applied; the lines above say why")


def _announce(console: Console) -> None:
    mlflow, prefect = (f"http://127.0.0.1:{processes.port(name)}" for name in ("mlflow", "prefect"))
    console.print(f"MLflow:  {mlflow}\nPrefect: {prefect}   (Ctrl-C stops everything)", soft_wrap=True)
    console.print(f"for `shoal run`: export MLFLOW_TRACKING_URI={mlflow} PREFECT_API_URL={prefect}/api", soft_wrap=True)


if __name__ == "__main__":
    main()
