"""The model that is chosen for a tolerance: random machines against finer models and against Exudyn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.selection import select
from shoal.selection.levels import apply, cable
from shoal_validation.selection.chart import draw_chart
from shoal_validation.selection.machines import draw
from shoal_validation.selection.reliability import judge
from shoal_validation.selection.report import section
from shoal_validation.selection.study import Case, study

FEW, LONG = (1, 11, 14), (9, 21, 24)
"""Machines of one and two rods, stiff and soft."""
BENT = (11, 14, 24)
"""Machines whose model is flexible, which Exudyn runs in seconds."""


@pytest.mark.parametrize("seed", [*FEW, *(pytest.param(seed, marks=pytest.mark.slow) for seed in LONG)])
@pytest.mark.by_day(1)
def test_a_machine_keeps_its_word_at_a_fair_price(seed: int) -> None:
    case = study(draw(seed), exhaustive=True)
    assert case.met, case.reason
    assert case.error <= case.tolerance
    assert case.reference_error < 0.2 * case.tolerance, "the finer model is not known well enough to judge"
    assert case.work <= 2.5 * case.least or case.rigid


@pytest.mark.by_day(1)
@pytest.mark.parametrize("seed", [*BENT[:2], pytest.param(BENT[2], marks=pytest.mark.slow)])
def test_exudyn_on_a_fine_mesh_agrees_within_the_tolerance(seed: int) -> None:
    machine = draw(seed)
    chosen = select(machine.scene, machine.tolerance)
    assert chosen.met
    assert any(level.element != "rigid" for level in chosen.chosen.levels.values())
    times = chosen.trajectory.times
    runs = []
    for elements in (8, 16):
        fine = apply(machine.scene, {rod: cable(elements) for rod in chosen.chosen.levels})
        settings = {"solver.integrator": "generalized-alpha", "solver.step": machine.scene.solver.duration / 4000}
        runs.append(get_engine("exudyn").simulate(fine.with_values(settings), times))
    assert all(run.ok for run in runs), [run.message for run in runs]
    settled = float(np.max(np.linalg.norm(runs[1].points - runs[0].points, axis=2)))
    away = float(np.max(np.linalg.norm(chosen.trajectory.points - runs[1].points, axis=2)))
    assert away <= machine.tolerance + settled


def test_machines_are_what_their_seed_says() -> None:
    one, other = draw(5), draw(5)
    assert one == other
    assert draw(6) != one
    sizes = {len(draw(seed).scene.bodies) for seed in range(40)}
    assert sizes == {1, 2, 3, 4}


def test_report_counts_broken_words(tmp_path: Path) -> None:
    cases = [_case(0, error=0.5), _case(1, error=1.5), _case(2, error=4.0), _case(3, error=9.0, met=False)]
    cases.append(_case(4, error=9.0, reference=8.0))
    text = section(cases)
    assert "| all | 5 | 1 | 2 | 1 | 1 | 1 | 0 |" in text
    assert "largest 2.00" in text
    assert "models cap the inertia of axial modes, which takes 0.75 of the work (median)" in text
    draw_chart(cases, tmp_path / "chart.png")
    assert (tmp_path / "chart.png").stat().st_size > 10_000


def _case(seed: int, error: float, met: bool = True, reference: float = 0.01) -> Case:
    return Case(
        seed=seed,
        rods=1,
        stiffness=1e9,
        tolerance=1.0,
        met=met,
        reason="" if met else "takes 2e+08 element steps",
        model="A 1 quintic",
        rigid=False,
        estimate=0.5,
        error=error,
        reference_error=reference,
        work=1.5,
        uncapped=2.0,
        least=1.0,
        cheapest="A 1 cable",
        seconds=0.1,
    )


@pytest.mark.slow
def test_every_tenth_machine_keeps_its_word() -> None:
    """With an exhaustive search for the cheapest model up to two rods; docs/model-choice.md has all two hundred."""
    cases = [study(machine, exhaustive=len(machine.scene.bodies) <= 2) for machine in map(draw, range(4, 200, 10))]
    met = [case for case in cases if case.met and case.known]
    assert len(met) >= 0.8 * len(cases)
    assert np.mean([case.error <= case.tolerance for case in met]) >= 0.95
    assert all(case.error <= 3 * case.tolerance for case in met)
    ratios = [case.work / case.least for case in met if np.isfinite(case.least) and case.least > 0]
    assert np.mean(np.array(ratios) <= 2) >= 0.9


@pytest.mark.parametrize("seed", [pytest.param(9, marks=pytest.mark.slow), 45])
def test_told_errors_cover_the_true_ones(seed: int) -> None:
    found = judge(seed)
    assert found is not None
    assert found.met
    for said, true in (found.answer, found.reference):
        assert 0 < true <= said


@pytest.mark.slow
def test_machines_whose_truth_takes_too_much_are_passed_over() -> None:
    assert judge(9, most=1.0) is None
