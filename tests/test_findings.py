"""Codes that programs look for are unique, and a status follows from findings alone."""

import json
import re
from enum import StrEnum
from types import ModuleType

import pytest
from shoal.findings import Kind, Severity, message, steps, worst_implied
from shoal.identification import findings as of_estimates
from shoal.identification.findings import Verdict
from shoal.imported import findings as of_imports
from shoal.mechanics import findings as of_motions
from shoal.mechanics.analysis import findings as of_equilibria
from shoal.mechanics.analysis import modes_findings as of_modes
from shoal.mechanics.analysis import reaction_findings as of_reactions
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.mechanics.analysis.modes_findings import ModesStatus
from shoal.mechanics.analysis.reaction_findings import ReactionsStatus
from shoal.response import findings as of_responses
from shoal.response.findings import ResponseStatus, in_order
from shoal.trajectory import Status

STATUSES: dict[ModuleType, type[StrEnum]] = {
    of_estimates: Verdict,
    of_equilibria: EquilibriumStatus,
    of_imports: Status,
    of_modes: ModesStatus,
    of_motions: Status,
    of_reactions: ReactionsStatus,
    of_responses: ResponseStatus,
}
KINDS = {module: [one for one in vars(module).values() if isinstance(one, Kind)] for module in STATUSES}


def test_codes_are_unique() -> None:
    codes = [one.code for kinds in KINDS.values() for one in set(kinds)]
    assert len(set(codes)) == len(codes) > 140
    assert all(re.fullmatch(r"[a-z]+(-[a-z]+)*", code) for code in codes)


@pytest.mark.parametrize("module", STATUSES, ids=lambda module: module.__name__)
def test_a_rejection_alone_implies_a_status_that_is_not_trusted(module: ModuleType) -> None:
    trusted = {Verdict: [one for one in Verdict if one.trusted]}.get(STATUSES[module], [next(iter(STATUSES[module]))])
    for one in KINDS[module]:
        implied = worst_implied([one.found("")], STATUSES[module])
        assert implied == (one.implies or next(iter(STATUSES[module]))), one.code
        assert (implied in trusted) is (one.severity is not Severity.REJECTION), one.code
        assert one.meaning.endswith("."), one.code


E, R = of_estimates, of_responses


@pytest.mark.parametrize(
    ("found", "status"),
    [
        ([], Verdict.IDENTIFIED),
        ([E.CURVED], Verdict.IDENTIFIED),
        ([E.CURVED, E.VAGUE], Verdict.PARTLY),
        ([E.CONFOUNDED, E.VAGUE], Verdict.COMBINATION),
        ([E.VAGUE, E.HELD_OUT_REFUTES], Verdict.REJECTED),
        ([E.NO_TIME, E.MISFIT, E.NOT_STATIONARY], Verdict.FAILED),
        ([], ResponseStatus.OK),
        ([R.OUTER_UNKNOWN, R.OPPOSITE], ResponseStatus.OK),
        ([R.NOT_MET, R.COARSE], ResponseStatus.LIMIT),
        ([R.COARSE, R.GAP_NOT_REACHED, R.DEVIATION_IN_DOUBT], ResponseStatus.GAP),
        ([R.BEYOND_HORIZON, R.MODEL_REJECTED, R.RUNS_FAILED], ResponseStatus.RUNS),
        ([R.RUNS_FAILED, R.TIME_OVER], ResponseStatus.TIME),
    ],
)
def test_the_status_is_the_worst_that_a_finding_implies(found: list[Kind], status: StrEnum) -> None:
    findings = [one.found("") for one in found]
    assert worst_implied(findings, type(status)) is status
    if isinstance(status, ResponseStatus) and findings:
        assert (in_order(findings)[0].kind.implies or "ok") == status


def test_what_to_do_about_one_finding_comes_before_the_remedies_of_its_kind() -> None:
    found = [E.AT_BOUND.found("a ended at a bound"), E.CAUSE.found("gravity", "check the gravity", stated=9.81)]
    assert steps([*found, *found]) == ["check the gravity", E.AT_BOUND.remedy]
    assert message(found) == "a ended at a bound; gravity"
    written = json.loads(json.dumps(found[1].to_json()))
    assert written["code"] == "likely-cause"
    assert (written["numbers"], written["do"]) == ({"stated": 9.81}, ["check the gravity"])
