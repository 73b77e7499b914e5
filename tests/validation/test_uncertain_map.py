"""The map of horizons: its reference against a scan, a method that is right, one that cannot tell, and the picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shoal_validation.nightly.plan import plan
from shoal_validation.nightly.uncertain import studied
from shoal_validation.uncertain.chart import draw, findings
from shoal_validation.uncertain.maps import Question, cell


@pytest.mark.parametrize("asked", [Question(1, 0.1, 0.0), Question(2, 0.1, 0.2), Question(2, 0.01, 0.2)])
def test_the_reference_is_that_of_a_scan(asked: Question) -> None:
    axis = np.linspace(1 - asked.width / 2, 1 + asked.width / 2, 2001 if asked.parameters == 1 else 401)
    places = np.stack(np.meshgrid(*[axis] * asked.parameters), axis=-1).reshape(-1, asked.parameters)
    times = asked.times[:4]
    found = asked.at(times)({f"k{k}": places[:, k] for k in range(asked.parameters)}).values
    low, high = asked.reference()
    assert low[:4] == pytest.approx(found.min(axis=0), abs=2e-3)
    assert high[:4] == pytest.approx(found.max(axis=0), abs=2e-3)
    assert np.all(low[:4] <= found.min(axis=0) + 1e-12)
    assert np.all(high[:4] >= found.max(axis=0) - 1e-12)


def test_cells_and_their_picture(tmp_path: Path) -> None:
    """Without chaos `auto` is right to the end, corners until the phase passes an extreme, and neither is silent."""
    asked = Question(1, 0.1, 0.0)
    cells = [cell("auto", asked), cell("vertices", asked)]
    assert cells[0].horizon == asked.times[-1]
    assert cells[1].horizon < cells[0].horizon / 5
    assert [one.told for one in cells] == [True, False]
    assert not any(one.silent for one in cells)
    picture = tmp_path / "map.png"
    draw(cells, picture)
    assert picture.stat().st_size > 10_000
    assert "| auto | 1 | 1 | 0 | 0 | 0 | 3e+02 |" in findings(cells)


@pytest.mark.parametrize("method", ["chebyshev-total", "kriging", "legendre", "rbf", "taylor"])
@pytest.mark.parametrize("width", [0.01, 0.1])
def test_what_a_surrogate_misses_of_runs_left_out_counts(method: str, width: float) -> None:
    """Runs at its extremes alone once told too small an error of kriging where neighbours part."""
    found = cell(method, Question(4, width, 0.2))
    assert found.told
    assert not found.silent


@pytest.mark.slow
def test_the_night_tries_uncertain_bounds() -> None:
    lines = plan("uncertain-bounds", quick=True)
    assert [line.limit for line in lines] == [1e-5, 1e-9]
    found = studied(3, 2_000, 9_100)
    assert found.status == "ok"
    assert found.error <= 1e-9
