"""Artifacts of a flow on Prefect's pages: its result as a table, the link to its run in MLflow, its progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar, cast

from prefect.artifacts import (
    create_link_artifact,
    create_markdown_artifact,
    create_progress_artifact,
    update_progress_artifact,
)
from prefect.states import Completed
from shoal.library import KINDS

from shoal_flows import workers
from shoal_flows.inputs import headed
from shoal_flows.tracking.addresses import run_address, table_address
from shoal_flows.tracking.record import LOCAL


class Result(Protocol):
    """Interface of the results of flows."""

    @property
    def trusted(self) -> bool:
        """Return whether it can be used."""
        ...

    @property
    def run_id(self) -> str:
        """Return the id of its run in MLflow."""
        ...

    def doubts(self) -> list[str]:
        """Every reason why not."""
        ...


R = TypeVar("R", bound=Result)


def ended(result: R) -> R:
    """Return the result of a flow; an untrusted one sets a state of that name, with every reason in one line."""
    if result.trusted:
        return result
    # Prefect takes the state, and whoever called the flow gets the result in it.
    return cast(R, Completed(name="Not to be trusted", message="; ".join(result.doubts()), data=result))


def show_result(title: str, table: str, result: Result, answer: str = "") -> None:
    """The table (Markdown) of a flow that runs, after why it cannot be trusted, and a link to its run in MLflow.

    answer: what a card has room for
    """
    run_id, doubts = result.run_id, result.doubts()
    doubt = f"**Not to be trusted:** {'; '.join(doubts)}\n\n" if doubts else ""
    text = f"## {title}\n\n{doubt}{table}\n\n{_where(run_id)}\n"
    create_markdown_artifact(text, key="result", description=answer or title)
    if address := run_address(run_id):
        create_link_artifact(address, link_text="The run in MLflow", key="mlflow-run", description=title)


def _where(run_id: str) -> str:
    if run_id.startswith(LOCAL):
        return "MLflow does not answer: the run is kept in the outbox; `shoal upload` sends it."
    address = run_address(run_id)
    if address:
        return f"[Run {run_id} in MLflow]({address}), [beside the others]({table_address(run_id)})"
    return f"Run `{run_id}` in MLflow; `shoal ui` shows it."


def named(flow: str, parameter: str) -> Callable[[], str]:
    """Return the name of runs of a flow: the title of its input."""
    kind = {one.one: folder for folder, one in KINDS.items()}[parameter]

    def name() -> str:
        from prefect.runtime import flow_run

        return f"{flow} {headed(str(flow_run.parameters[parameter]), kind)}"

    return name


class Bar:
    """A progress artifact of the flow that runs."""

    def __init__(self, total: int, description: str) -> None:
        self._total, self._done = total, 0
        self._artifact: Any = create_progress_artifact(0.0, key="progress", description=description)

    def advance(self) -> None:
        """One more is done."""
        self.stand_at(self._done + 1)

    def stand_at(self, done: int) -> None:
        """Show this number as done."""
        self._done = done
        update_progress_artifact(self._artifact, 100.0 * done / self._total)


@contextmanager
def progress(total: int, description: str) -> Iterator[Bar]:
    """Show a progress bar, complete when the block ends without an exception.

    A flow that is stopped does not wait for its tasks: it would be killed meanwhile.
    """
    bar = Bar(total, description)
    try:
        yield bar
    except BaseException as error:
        if not isinstance(error, Exception):
            workers.abandon()
        raise
    bar.stand_at(total)
