"""Kinds of findings of all analyses: what they imply agrees with their severity, and the site lists each."""

import runpy
from pathlib import Path
from types import ModuleType

import pytest
from shoal.findings import Kind, Severity
from shoal.identification import findings as identification
from shoal.mechanics.analysis import findings as statics
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.response import findings as response

MODULES = [identification, statics, response]


def kinds(module: ModuleType) -> list[Kind]:
    return [one for one in vars(module).values() if isinstance(one, Kind)]


@pytest.mark.parametrize("module", MODULES)
def test_the_site_lists_every_kind_once(module: ModuleType) -> None:
    pytest.importorskip("latex2mathml")  # of the site
    listed = runpy.run_path(str(Path(__file__).parents[1] / "docs" / "hooks.py"))["findings"]()
    for one in kinds(module):
        assert listed.count(f"| `{one.code}` | {one.severity} | {one.meaning} | {one.implies} |") == 1


def test_rejections_of_statics_imply_a_status_that_is_not_ok() -> None:
    for one in kinds(statics):
        status = statics.status_of([one.found("")])
        assert (status is EquilibriumStatus.OK) is (one.severity is not Severity.REJECTION), one.code
