"""The charts of identification measure what they say: counts are the counter's, classes are told apart."""

from pathlib import Path

import numpy as np
import pytest
from shoal.identification import METHODS
from shoal.swarm import BudgetExhausted
from shoal_validation.document import rewrite, table
from shoal_validation.inverse_precision.cases import CASES, rigid_problem, textbook
from shoal_validation.inverse_precision.charts import best_so_far, reach, worst_cells
from shoal_validation.inverse_precision.contenders import Contender, contenders
from shoal_validation.inverse_precision.horizon_noise import (
    DEVIATIONS,
    EXACT,
    HORIZONS,
    NOISES,
    RIGHT,
    Panel,
    classify,
    measure_cell,
    measure_panel,
    panels,
)
from shoal_validation.inverse_precision.measure import CLOSE, Run, run
from shoal_validation.inverse_precision.trace import Trace
from shoal_validation.judge import Outcome


def find(name: str) -> Contender:
    return next(contender for contender in contenders() if contender.name == name)


def test_every_method_of_the_list_takes_part_once() -> None:
    """A method that is added to METHODS appears in the charts and on the map without being named there."""
    assert [contender.name for contender in contenders() if contender.name in METHODS] == list(METHODS)
    assert {panel.method for panel in panels()} <= set(METHODS)


def test_a_trace_notes_improvements_only_and_stops_at_the_budget() -> None:
    values = iter([3.0, 5.0, np.inf, 1.0, 0.5])
    trace = Trace(lambda points: np.array([next(values)]), cost=lambda x: x, budget=4)
    for _ in range(4):
        trace(np.zeros((1, 2)))
    with pytest.raises(BudgetExhausted):
        trace(np.zeros((1, 2)))
    assert [(row.evaluations, row.fitness) for row in trace.improvements] == [(1, 3.0), (4, 1.0)]


@pytest.mark.parametrize("name", ["least-squares", "iafsa-unseeded", "differential-evolution", "cma-es"])
def test_a_run_stays_within_the_budget_and_ends_at_its_best(name: str) -> None:
    case = CASES["rigid-2s"]
    done = run(case, case.data(case.problem), find(name), 0, 120)
    assert 0 < done.spent <= 120
    assert done.evaluations[-1] <= done.spent
    assert np.all(np.diff(done.evaluations) > 0)
    assert np.all(np.diff(done.seconds) >= 0)
    assert done.success or name != "least-squares"


def test_data_are_not_made_by_the_model_that_is_fitted() -> None:
    """No inverse crime: the truth leaves residuals of the model's own error, far above round-off."""
    for name in ("paper-case-1-same-mesh", "rigid-5s"):
        case = CASES[name]
        data = case.data(case.problem)
        at_truth = case.model(data).fitness(np.array([list(data.truth.values())]))
        assert 1e-14 < at_truth[0] < 1e-3


def test_noise_has_the_size_and_the_seed_that_it_says() -> None:
    clean, noisy, again = (textbook(rigid_problem(), 2.0, noise, 1) for noise in (0.0, 0.1, 0.1))
    assert np.std(noisy.first.values - clean.first.values) == pytest.approx(0.1, rel=0.15)
    assert np.array_equal(noisy.first.values, again.first.values)


def made(errors: list[float]) -> Run:
    spent = np.arange(1.0, len(errors) + 1)
    return Run("case", "method", "shoal", 0, spent, spent, np.array(errors), 0.0, len(errors), 1.0)


def test_arrival_is_when_the_error_stays_small() -> None:
    """A best point that passes the truth by chance has not arrived."""
    there, away = CLOSE / 2, 2 * CLOSE
    assert reach([made([away, there, away, there, there])], "method", "evaluations") == 4
    assert reach([made([there, away])], "method", "evaluations") == np.inf
    assert list(best_so_far(np.array([2.0, 4.0]), np.array([3.0, 1.0]), np.array([2.0, 3.9, 4.0, 9.0]))) == [3, 3, 1, 1]


def test_classes_of_an_answer() -> None:
    assert classify(True, RIGHT, DEVIATIONS) is Outcome.HOLDS
    assert classify(True, EXACT, 1e9) is Outcome.HOLDS
    assert classify(True, RIGHT, 1e9) is Outcome.INACCURATE
    assert classify(True, 2 * RIGHT, DEVIATIONS) is Outcome.INACCURATE
    assert classify(True, 2 * RIGHT, 2 * DEVIATIONS) is Outcome.SILENT
    assert classify(False, 0.0, 0.0) is Outcome.FAILED


def test_least_squares_with_stated_noise_holds_over_short_records() -> None:
    cell = measure_cell(Panel("least-squares", stated=True), 0.5, 1e-4, 0)
    assert cell.outcome is Outcome.HOLDS
    assert cell.deviations < DEVIATIONS


def test_a_page_keeps_what_stands_around_the_generated_part(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- begin a -->\nold\n<!-- end a -->\nafter\n")
    rewrite(page, "a", table(("x", "y"), [("1", "2")]))
    text = page.read_text()
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    assert "| 1 | 2 |" in text
    with pytest.raises(ValueError, match="no section"):
        rewrite(page, "b", "")


@pytest.mark.slow
def test_least_squares_is_nowhere_silently_wrong_when_the_noise_is_stated() -> None:
    cells = list(measure_panel(Panel("least-squares", stated=True), horizons=HORIZONS, noises=NOISES))
    wrong = [(c.horizon, c.noise, c.error) for c in worst_cells(cells) if c.outcome is Outcome.SILENT]
    assert wrong == []
