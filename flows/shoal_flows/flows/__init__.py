"""The flows by name. Importing this imports Prefect: start or name its server first."""

from __future__ import annotations

from typing import Any

from shoal_flows import settings

settings.apply()

from prefect import Flow  # noqa: E402 - it reads the settings when it is imported

from shoal_flows.flows.compare import compare  # noqa: E402
from shoal_flows.flows.demo import demo  # noqa: E402
from shoal_flows.flows.design import design  # noqa: E402
from shoal_flows.flows.export import export  # noqa: E402
from shoal_flows.flows.forward import forward  # noqa: E402
from shoal_flows.flows.identify import identify  # noqa: E402
from shoal_flows.flows.marked import marked  # noqa: E402
from shoal_flows.flows.nightly import nightly  # noqa: E402
from shoal_flows.flows.select import select  # noqa: E402
from shoal_flows.flows.statics import statics  # noqa: E402
from shoal_flows.flows.sweep import sweep  # noqa: E402
from shoal_flows.flows.uncertain import uncertain  # noqa: E402

FLOWS: dict[str, Flow[..., Any]] = {
    flow.name: flow
    for flow in (forward, select, compare, sweep, uncertain, statics, export, identify, design, nightly, demo)
}
for flow in FLOWS.values():
    marked(flow)

__all__ = ["FLOWS"]
