"""The study of methods for uncertain parameters, at a small size."""

from __future__ import annotations

import pytest
from shoal_validation.uncertain.__main__ import methods_table, studies_text
from shoal_validation.uncertain.measure import measured, random_study
from shoal_validation.uncertain.problems import PROBLEMS


@pytest.mark.parametrize("problem", [PROBLEMS[0], PROBLEMS[-1]], ids=lambda problem: problem.name)
def test_auto_is_never_wrong_in_silence(problem: object) -> None:
    """Neither after a few cycles nor where neighbours part; vertices tell nothing and fall short."""
    assert isinstance(problem, type(PROBLEMS[0]))
    low, high = problem.reference()
    auto, corners = (measured(problem, method, low, high) for method in ("auto", "vertices"))
    assert auto.verdict in ("holds", "horizon")
    assert corners.verdict == "unknown"
    assert corners.short > 10 * auto.short
    assert problem.name in methods_table([auto, corners])


@pytest.mark.slow
def test_random_studies_keep_their_word() -> None:
    studies = [random_study(seed) for seed in range(1000, 1002)]
    assert all(study.kept for study in studies)
    assert "2 random studies" in studies_text(studies)
