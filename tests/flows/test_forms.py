"""Flows are asked for with the fields of the requests."""

from __future__ import annotations

from inspect import signature

import pytest
from shoal.requests.request import offered
from shoal_flows.flows import FLOWS

REQUESTS = {name: flow.fn.request for name, flow in FLOWS.items() if getattr(flow.fn, "request", None) is not None}
OWN = {"identify": ({"methods", "seeds"}, {"method", "seed"}), "export": ({"to", "verify"}, set())}
"""Parameters that a flow has besides, and fields that it has not."""


def test_most_flows_have_a_request() -> None:
    assert len(REQUESTS) == 8


@pytest.mark.parametrize("name", REQUESTS)
def test_the_form_of_a_flow_has_the_fields_of_its_request(name: str) -> None:
    more, less = OWN.get(name, (set(), set()))
    assert {*signature(FLOWS[name].fn).parameters} == ({*offered(REQUESTS[name], "form")} - less) | more
