"""Run a flow by name: the server, the parameters, the answer."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from inspect import signature
from typing import Any

from shoal.errors import ComputationError, InputError, ShoalError
from shoal.requests.function import plain
from shoal.requests.request import fields, renamed
from shoal.scene.load import read_yaml

from shoal_flows import choices, events, server, workers
from shoal_flows.terminal import following, notice, show


def main(name: str, parameters: Mapping[str, Any], as_json: bool) -> list[str]:
    """Run a flow with its progress on standard error, print its answer; returns every reason not to trust it."""
    # Records that Prefect could not be sent: it would print each of them.
    logging.raiseExceptions = False
    with following(f"flow {name}") as listener, events.listening(listener):
        result = run_flow(name, parameters)
    notice()
    if as_json:
        from shoal.json_values import json_text

        print(json_text(result.to_json()))  # noqa: T201 - this is the output
    else:
        show(result)
    return [] if result.trusted else list(result.doubts())


def run_flow(name: str, parameters: Mapping[str, Any]) -> Any:
    """The result of the flow `name`; text among the parameters is read as YAML. Raises InputError, ComputationError."""
    server.start()
    # What follows takes seconds to import; meanwhile the server and the workers start.
    ready = workers.warm_up()
    from prefect.context import get_settings_context, use_profile
    from prefect.exceptions import ParameterTypeError

    from shoal_flows.flows import FLOWS

    if name not in FLOWS:
        raise InputError(f"flow: no flow {name!r}; there are {', '.join(FLOWS)}")
    flow = FLOWS[name]
    wanted = _parsed(name, flow.fn, parameters)
    with events.work("kernels (compiled on first use)"):
        ready.result()
    server.wait()
    if server.shared() and (different := choices.difference()):
        events.note(different)
    try:
        # Who imported Prefect before has let it read the settings too early.
        with use_profile(get_settings_context().profile, include_current_context=False):
            return flow(**wanted)
    except ParameterTypeError as error:
        raise InputError(f"{name}: {' '.join(str(error).split())}") from None
    except ShoalError:
        raise
    except Exception as error:
        if server.answers():
            raise
        where = os.environ["PREFECT_API_URL"]
        text = f"the Prefect server at {where} is gone; what was computed is kept: the same command goes on from there"
        raise ComputationError(text) from error


def _parsed(flow: str, function: Callable[..., Any], parameters: Mapping[str, Any]) -> dict[str, Any]:
    parsed = {name: _read(flow, name, value) for name, value in parameters.items()}
    if (request := getattr(function, "request", None)) is not None:
        parsed = renamed(request, parsed, lambda said: events.note(f"{flow}: {said}"))
        numbers = {name: one for name, one in fields(request).items() if name in parsed and one.limit is not None}
        parsed |= {name: one.read(parsed[name]) for name, one in numbers.items()}
    types = {name: one.annotation for name, one in signature(function, eval_str=True).parameters.items()}
    for name, value in parsed.items():
        if name not in types:
            raise InputError(f"{flow}: no parameter {name!r}; there are {', '.join(types) or 'none'}")
        a_list = plain(types[name]).startswith("list[")
        if a_list and value is not None and not isinstance(value, list | dict):
            parsed[name] = value.split(",") if isinstance(value, str) else [value]
    return parsed


def _read(flow: str, name: str, value: Any) -> Any:
    if not isinstance(value, str):
        return value
    try:
        return read_yaml(value, f"{flow}: {name}")
    except InputError as error:
        raise InputError(f"{error} (write lists as [a, b])") from None
