"""Kinds of findings of all analyses: what they imply agrees with their severity, and the site lists each."""

import runpy
from collections import Counter
from enum import StrEnum
from pathlib import Path
from types import ModuleType

import pytest
from shoal.findings import Finding, Kind, Severity, steps, worst_implied
from shoal.identification import findings as identification
from shoal.imported import findings as imported
from shoal.mechanics import findings as motions
from shoal.mechanics.analysis import findings as statics
from shoal.mechanics.analysis import modes_findings as modes
from shoal.mechanics.analysis import reaction_findings as reactions
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.mechanics.analysis.modes_findings import ModesStatus
from shoal.mechanics.analysis.reaction_findings import ReactionsStatus
from shoal.response import findings as response
from shoal.trajectory import Status

MODULES = [identification, motions, statics, modes, reactions, response, imported]
STATUSES = [(motions, Status), (statics, EquilibriumStatus), (modes, ModesStatus), (reactions, ReactionsStatus)]


def kinds(module: ModuleType) -> list[Kind]:
    return [one for one in vars(module).values() if isinstance(one, Kind)]


@pytest.mark.parametrize("module", MODULES)
def test_the_site_lists_every_kind_once(module: ModuleType) -> None:
    pytest.importorskip("latex2mathml")  # of the site
    listed = runpy.run_path(str(Path(__file__).parents[1] / "docs" / "hooks.py"))["findings"]()
    for one in kinds(module):
        assert listed.count(f"| `{one.code}` | {one.severity} | {one.meaning} | {one.implies} |") == 1


@pytest.mark.parametrize(("module", "statuses"), STATUSES)
def test_rejections_imply_a_status_that_is_not_ok(module: ModuleType, statuses: type[StrEnum]) -> None:
    for one in kinds(module):
        status = worst_implied([one.found("")], statuses)
        assert (status == "ok") is (one.severity is not Severity.REJECTION), one.code


def test_codes_are_unique() -> None:
    codes = Counter(one.code for module in MODULES for one in kinds(module))
    assert not [code for code, count in codes.items() if count > 1]


def test_a_finding_crosses_as_json() -> None:
    found = motions.ENERGY.found("energy is off by 0.1", "use a smaller step", drift=0.1)
    back = Finding.from_json(found.to_json())
    assert (back.code, back.severity, back.text, back.numbers) == (
        found.code,
        found.severity,
        found.text,
        {"drift": 0.1},
    )
    assert worst_implied([back], Status) is Status.ENERGY
    assert steps([back]) == ["use a smaller step"]
