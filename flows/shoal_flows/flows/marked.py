"""Hooks of every flow: its run is held, so that a killed one is found; its end brings the morning page up to date."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from prefect import Flow
from shoal.errors import ShoalError

from shoal_flows import alive, server
from shoal_flows.left import end_left
from shoal_flows.report import morning

_held: dict[str, Callable[[], None]] = {}


def marked(flow: Flow[..., Any]) -> None:
    """Have a flow hold its run from its start until Prefect knows its end; first it ends what others left behind."""
    flow.on_running(_hold)
    # What is crashed or cancelled keeps its mark until the process ends; the worker would load the flow for its hooks.
    flow.on_completion(_let_go)
    flow.on_failure(_let_go)


def _hold(flow: Any, flow_run: Any, state: Any) -> None:
    if str(flow_run.id) not in _held:
        _held[str(flow_run.id)] = alive.hold(alive.PREFECT, str(flow_run.id), server.shared())
        end_left()


def _let_go(flow: Any, flow_run: Any, state: Any) -> None:
    if let_go := _held.pop(str(flow_run.id), None):
        let_go()
    with suppress(ShoalError):  # A flow that has ended does not fail for a page.
        morning.refresh()
