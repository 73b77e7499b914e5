"""Codes that programs look for are unique, and the status of a response follows from them alone."""

import re

import pytest
from shoal.findings import Kind, Severity
from shoal.response import findings as kinds
from shoal.response.findings import ResponseStatus, in_order, status_of

ALL = [one for one in vars(kinds).values() if isinstance(one, Kind)]


def test_codes_are_unique_and_a_rejection_implies_a_status_that_is_not_ok() -> None:
    codes = [one.code for one in ALL]
    assert len(set(codes)) == len(codes) > 25
    assert all(re.fullmatch(r"[a-z]+(-[a-z]+)*", code) for code in codes)
    for one in ALL:
        assert status_of([one.found("")]).value == (one.implies or "ok"), one.code
        assert (status_of([one.found("")]) is ResponseStatus.OK) is (one.severity is not Severity.REJECTION), one.code
        assert one.meaning.endswith("."), one.code


@pytest.mark.parametrize(
    ("found", "status"),
    [
        ([], ResponseStatus.OK),
        ([kinds.OUTER_UNKNOWN, kinds.OPPOSITE], ResponseStatus.OK),
        ([kinds.NOT_MET, kinds.COARSE], ResponseStatus.LIMIT),
        ([kinds.COARSE, kinds.GAP_NOT_REACHED, kinds.DEVIATION_IN_DOUBT], ResponseStatus.GAP),
        ([kinds.BEYOND_HORIZON, kinds.MODEL_REJECTED, kinds.RUNS_FAILED], ResponseStatus.RUNS),
        ([kinds.RUNS_FAILED, kinds.TIME_OVER], ResponseStatus.TIME),
    ],
)
def test_the_status_is_the_worst_that_a_finding_implies(found: list[Kind], status: ResponseStatus) -> None:
    findings = in_order(one.found("") for one in found)
    assert status_of(findings) is status
    assert not findings or (findings[0].kind.implies or "ok") == status
