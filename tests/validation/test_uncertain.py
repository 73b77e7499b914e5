"""The study of methods for uncertain parameters, at a small size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shoal_validation.uncertain import machines, studies
from shoal_validation.uncertain.__main__ import methods_table, reached_table, studies_text
from shoal_validation.uncertain.measure import measured
from shoal_validation.uncertain.problems import PROBLEMS
from shoal_validation.uncertain.reached import motions


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


def test_series_in_subintervals_hold_where_one_series_does_not() -> None:
    """The rows of `taylor` with options of its own."""
    problem = PROBLEMS[0]
    low, high = problem.reference()
    whole, cut = (measured(problem, "taylor", low, high, degree=2, count=count) for count in (None, 400))
    assert (whole.verdict, cut.verdict) == ("horizon", "holds")
    assert cut.short < 0.2 * whole.short


def test_machines_are_what_they_say() -> None:
    """Closed forms against the equation of motion that they solve, by differences: forced, damped and tumbling."""
    random = np.random.default_rng(5)
    t, h = np.linspace(0.05, 1.0, 7), 1e-4
    for make in (machines.oscillator, machines.forced, machines.tumbling):
        kind = make(random)
        fields = np.array(kind.fields)[:, None, None]
        before, here, after = (kind.motion(fields, t + shift)[:, 0] for shift in (-h, 0.0, h))
        first, second = (after - before) / (2 * h), (after - 2 * here + before) / h**2
        if kind.name == "tumbling body":
            # Euler's equations with moments 1, I2, I3.
            i2, i3 = kind.fields[:2]
            due = np.stack([(i2 - i3) * here[1] * here[2], (i3 - 1) * here[2] * here[0], (1 - i2) * here[0] * here[1]])
            assert np.array([1.0, i2, i3])[:, None] * first == pytest.approx(due, abs=1e-5 * np.abs(here).max() ** 2)
            continue
        k, m, ratio = kind.fields[:3]
        load = kind.fields[3] * np.sin(kind.fields[4] * t) if kind.name == "forced oscillator" else 0.0
        rest = m * second[0] + 2 * ratio * np.sqrt(k * m) * first[0] + k * here[0] - load
        assert rest == pytest.approx(np.zeros(7), abs=1e-5 * k)


def test_random_runs_find_bounds_that_are_too_narrow() -> None:
    """Outer bounds that are a hundredth of the width too narrow are left by some of a few thousand runs."""
    asked = studies.drawn(0)
    answer = studies.answered(asked)
    bounds = answer.bounds
    assert bounds is not None
    assert studies.against(asked, answer, 4000).kept
    less = 0.01 * (bounds.upper - bounds.lower)
    narrow = replace(bounds, lower_outer=bounds.lower_outer + less, upper_outer=bounds.upper_outer - less)
    found = studies.against(asked, replace(answer, bounds=narrow), 4000)
    assert not found.kept
    assert found.beyond == pytest.approx(0.01, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "runs"),
    [*((k, 20_000) for k in (11, 56, 102, 130, 166, 18, 1010, 1050)), *((k, 100_000) for k in (52159, 53057))],
)
def test_random_studies_keep_their_word(seed: int, runs: int) -> None:
    """Those that once did not: a widened extreme between runs, extremes on the wrong one of many ridges, and a cusp."""
    found = studies.judged(studies.drawn(seed), runs)
    assert found.kept
    assert "1 random studies" in studies_text([found], runs)


@pytest.mark.slow
def test_what_is_asked_of_long_motions_is_reached() -> None:
    """The rows of pendulum, two frequencies and rod, and their table."""
    found = list(motions())
    assert all(one.met for one in found), found
    assert reached_table(found).count("| yes |") == len(found)
