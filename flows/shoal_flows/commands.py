"""The commands of `shoal` that need flows or their runs. Prefect and MLflow are imported when one runs."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Any

import click
from shoal.commands import options
from shoal.errors import ComputationError, check_trusted


def _stoppable() -> None:
    """A service manager asks with SIGTERM for what a person does with Ctrl-C."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)


@click.command("run")
@click.argument("flow")
@click.option(
    "--param", "parameters", multiple=True, metavar="K=V", callback=options.key_value, help="JSON or plain text."
)
@options.as_json
def run_flow(flow: str, parameters: dict[str, str], as_json: bool) -> None:
    """Run a Prefect FLOW and log it to MLflow.

    It is forward, select, compare, sweep, uncertain, statics, export, identify, design, nightly or demo.
    """
    from shoal_flows import run

    _stoppable()
    doubts = run.main(flow, parameters, as_json)
    check_trusted(not doubts, f"not to be trusted: {'; '.join(doubts)}")


@click.command()
@click.argument("run_id")
@options.as_json
def rerun(run_id: str, as_json: bool) -> None:
    """Repeat a study from its MLflow run, and compare the figures."""
    from shoal_flows import rerun

    _stoppable()
    complaint = rerun.main(run_id, as_json)
    check_trusted(not complaint, complaint)


@click.command()
@click.argument("runs", nargs=-1, metavar="RUN...")
@click.option("--all", "everything", is_flag=True, help="All studies in MLflow over time, instead of RUN.")
@click.option("--machine", help="With --all: of this machine only.")
@options.out(".html", default="report.html")
def report(runs: tuple[str, ...], everything: bool, machine: str | None, out: Path) -> None:
    """Make one page of identifications of one problem, or of all studies over time.

    RUN is a file that `shoal identify --out FILE.json` wrote, or the id of a run in MLflow.
    """
    if everything == bool(runs):
        raise click.UsageError("give one RUN or more, or --all")
    if machine is not None and not everything:
        raise click.UsageError("--machine goes with --all")
    if everything:
        from shoal.pictures.files import save

        from shoal_flows.report.overview import overview

        text = overview(machine)
        save(out, {".html": lambda: text})
        click.echo(f"report: {out}")
        return
    from shoal.pictures import archive
    from shoal.pictures.files import save
    from shoal.pictures.study import best_of, study

    found: dict[str, Any] = {}
    for run in runs:
        if Path(run).suffix or Path(run).exists():
            found[Path(run).stem if Path(run).stem not in found else run] = archive.read(Path(run))
        else:
            from shoal_flows.report.stored import stored

            found |= stored(run)
    save(out, {".html": lambda: study(found)})
    click.echo(f"report: {out}")
    best = found[best_of({name: answer.estimate for name, answer in found.items()})].estimate
    check_trusted(best.verdict.trusted, f"{best.verdict}: {best.message}")


@click.command()
def upload() -> None:
    """Send MLflow the runs that wait in the outbox, as it was not reachable when they ended."""
    from shoal_flows.tracking.upload import upload

    click.echo(f"{upload()} runs uploaded")


@click.command()
@click.option("--host", default="127.0.0.1", show_default=True)
@click.option("--port", default=5000, show_default=True)
@click.option(
    "--browser/--no-browser", default=None, help="Open the morning page. Default: in a terminal with a screen."
)
def ui(host: str, port: int, browser: bool | None) -> None:
    """Serve the MLflow dashboard of all runs until Ctrl-C, and write the morning page.

    The page says what ran in the last day, what is not to be trusted, and which parameters drift.
    """
    from shoal_flows.ui import ui

    screen = sys.platform != "linux" or bool({"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys())
    ui(host, port, browser=sys.stdout.isatty() and screen if browser is None else browser)


@click.command()
def demo() -> None:
    """The main job: both cases of the paper on every engine. One table, one report."""
    from shoal_flows import demo

    _stoppable()
    sys.exit(0 if demo.main() else ComputationError.exit_status)
