"""Codes that programs look for are unique and documented, and the verdict follows from them alone."""

import json
import re

import pytest
from shoal.findings import Kind, Severity, message, steps
from shoal.identification import Verdict
from shoal.identification import findings as kinds
from shoal.identification.findings import verdict_of

ALL = [one for one in vars(kinds).values() if isinstance(one, Kind)]


def test_codes_are_unique_and_a_rejection_implies_a_verdict_that_is_not_trusted() -> None:
    codes = [one.code for one in ALL]
    assert len(set(codes)) == len(codes) > 30
    assert all(re.fullmatch(r"[a-z]+(-[a-z]+)*", code) for code in codes)
    for one in ALL:
        implied = Verdict(one.implies) if one.implies else Verdict.IDENTIFIED
        assert implied.trusted is (one.severity is not Severity.REJECTION), one.code
        assert one.meaning.endswith("."), one.code


@pytest.mark.parametrize(
    ("found", "verdict"),
    [
        ([], Verdict.IDENTIFIED),
        ([kinds.CURVED], Verdict.IDENTIFIED),
        ([kinds.CURVED, kinds.VAGUE], Verdict.PARTLY),
        ([kinds.CONFOUNDED, kinds.VAGUE], Verdict.COMBINATION),
        ([kinds.VAGUE, kinds.HELD_OUT_REFUTES], Verdict.REJECTED),
        ([kinds.NO_TIME, kinds.MISFIT, kinds.NOT_STATIONARY], Verdict.FAILED),
    ],
)
def test_the_verdict_is_the_worst_that_a_finding_implies(found: list[Kind], verdict: Verdict) -> None:
    assert verdict_of(one.found("") for one in found) is verdict


def test_what_to_do_about_one_finding_comes_before_the_remedies_of_its_kind() -> None:
    found = [kinds.AT_BOUND.found("a ended at a bound"), kinds.CAUSE.found("gravity", "check the gravity", stated=9.81)]
    assert steps([*found, *found]) == ["check the gravity", kinds.AT_BOUND.remedy]
    assert message(found) == "a ended at a bound; gravity"
    written = json.loads(json.dumps(found[1].to_json()))
    assert written["code"] == "likely-cause"
    assert (written["numbers"], written["do"]) == ({"stated": 9.81}, ["check the gravity"])
