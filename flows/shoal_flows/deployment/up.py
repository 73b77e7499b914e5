"""`make up`: everything on this machine, in order, until Ctrl-C; `python -m shoal_flows.deployment.up --help`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path

import click
from rich.console import Console
from shoal.errors import ComputationError, ShoalError
from shoal.home import home

from shoal_flows import settings
from shoal_flows.deployment import postgres as database
from shoal_flows.deployment import processes

_PATIENCE = 180.0
_GRACE = 20.0


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
    """Start stage after stage, apply the deployments, wait; stop in the reverse order.

    Raises InputError, and ComputationError if a process does not start or ends by itself.
    """
    console = Console(stderr=True, highlight=False)
    for name in (name for stage in stages for name in stage):
        processes.check_free(name)
    # A service manager asks with SIGTERM for what a person does with Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    port = int(os.environ.get("SHOAL_POSTGRES_PORT") or 5433)
    keeping = database.running(home() / "postgres", port) if postgres else nullcontext(dict[str, str]())
    try:
        with ExitStack() as stack:
            environment = _environment(stack.enter_context(keeping))
            started = [stack.enter_context(_stage(stage, environment, console)) for stage in stages]
            if any("worker" in stage for stage in stages):
                _deploy(environment)
            _announce(console)
            while all(process.poll() is None for process in started):
                time.sleep(0.3)
            raise ComputationError("a process ended by itself; its last lines are above")
    except KeyboardInterrupt:
        console.print("stopped")


def _environment(stores: Mapping[str, str]) -> dict[str, str]:
    """What every process sees: state below the home, the addresses of both servers, the programs of this Python."""
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
    }
    return {**settings.defaults(folder), **kept, **os.environ, **stated, **stores}


@contextmanager
def _stage(names: Sequence[str], environment: Mapping[str, str], console: Console) -> Iterator[subprocess.Popen[bytes]]:
    """These lines of the Procfile, ready when the block begins, ended when it is left."""
    process = subprocess.Popen(
        # Its own session, so that Ctrl-C is for this process alone; a pipe, so that they end with it whatever happens.
        [sys.executable, "-m", "shoal_flows.attached", *_honcho(names)],
        env=dict(environment),
        stdin=subprocess.PIPE,
        start_new_session=True,
    )
    try:
        deadline = time.monotonic() + _PATIENCE
        for name in names:
            while not processes.is_ready(name):
                if process.poll() is not None or time.monotonic() > deadline:
                    raise ComputationError(f"{name} did not start; its last lines are above")
                time.sleep(0.2)
            console.print(f"{name} is ready")
        yield process
    finally:
        process.terminate()
        try:
            process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            process.kill()


def _deploy(environment: Mapping[str, str]) -> None:
    command = [sys.executable, "-m", *_honcho(["deploy"])]
    done = subprocess.run(command, env=dict(environment), stdin=subprocess.DEVNULL, cwd=processes.FOLDER, check=False)
    if done.returncode:
        raise ComputationError("the deployments could not be applied; the lines above say why")


def _honcho(names: Sequence[str]) -> list[str]:
    folder = processes.FOLDER
    return ["honcho", "-f", str(folder / "Procfile"), "-d", str(folder), "-e", os.devnull, "start", *names]


def _announce(console: Console) -> None:
    mlflow, prefect = (f"http://127.0.0.1:{processes.port(name)}" for name in ("mlflow", "prefect"))
    console.print(f"MLflow:  {mlflow}\nPrefect: {prefect}   (Ctrl-C stops everything)", soft_wrap=True)
    console.print(f"for `shoal run`: export MLFLOW_TRACKING_URI={mlflow} PREFECT_API_URL={prefect}/api", soft_wrap=True)


if __name__ == "__main__":
    main()
