"""Parts of a box that few runs miss are seen by runs of control."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from shoal.cli import main
from shoal.response import respond
from shoal.response.enclosure import CONTROLS, unseen
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval
from shoal.response.runs import Answers
from sliding import puck


@pytest.mark.parametrize("method", ["auto", "chebyshev", "legendre"])
@pytest.mark.parametrize("count", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("place", "share"),
    [(0.31, 0.06), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((-0.72, 0.05), (0.38, 0.12)))],
)
@pytest.mark.by_day(2)
def test_a_band_between_runs_is_not_passed_over(place: float, share: float, count: int, method: str) -> None:
    """A straight line, but for a band of 5 to 12 % of the first interval, where the answer is lower by two."""
    inputs = Inputs(tuple(UncertainParameter(f"p{k}", Interval(-1.0, 1.0), {f"p{k}": 1.0}) for k in range(count)))

    def answers(values: dict[str, np.ndarray]) -> Answers:
        hit = np.abs(values["p0"] - place) < share
        told = sum(values.values()) - 2.0 * count * hit
        return Answers(told[:, None], np.ones(len(hit), dtype=bool))

    found = respond(answers, inputs, 1, method=method).bounds
    assert found is not None
    least = place - share - (count - 1) - 2.0 * count
    assert math.isfinite(found.horizon) or found.lower_outer[0] <= least


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 8))])
@pytest.mark.parametrize("count", [1, 2, 4])
def test_what_is_smooth_is_told_as_before(count: int, seed: int) -> None:
    """A plane and a wave: bounds meet, and what the runs of control cost is told apart."""
    inputs = Inputs(tuple(UncertainParameter(f"p{k}", Interval(-1.0, 1.0), {f"p{k}": 1.0}) for k in range(count)))

    def answers(values: dict[str, np.ndarray]) -> Answers:
        told = sum((k + 1) * x for k, x in enumerate(values.values()))
        return Answers(np.stack([told, np.sin(0.3 * told)], axis=1), np.ones(len(told), dtype=bool))

    answer = respond(answers, inputs, 2, seed=seed)
    assert answer.bounds is not None
    whole = count * (count + 1) / 2
    assert answer.bounds.upper[0] == pytest.approx(whole, rel=1e-12)
    assert math.isinf(answer.horizon)
    assert answer.runs.controls == CONTROLS
    assert answer.runs.own == answer.runs.evaluations - CONTROLS


def test_the_share_that_may_be_unseen() -> None:
    """(1 - share)^n = 5 %, about 3 / n."""
    for count in (1, 40, 1000):
        assert (1 - unseen(count)) ** count == pytest.approx(0.05)
    assert unseen(1000) == pytest.approx(3e-3, rel=5e-3)
    assert unseen(0) == 1.0


@pytest.mark.slow
def test_a_peg_that_a_few_runs_miss_is_seen(tmp_path: Path) -> None:
    """12 % of the interval hit it and turn round, to x = -1.17 m by scipy; five runs say that x is 1 m everywhere."""
    file = tmp_path / "puck.yaml"
    file.write_text(yaml.safe_dump(puck(0.4, 0.12, 2000.0).model_dump(mode="json", exclude_unset=True)))
    words = ["uncertain", str(file), "--vary", "initial.P.position.1=-1:1", "--limit", "P.x < 0.5", "--at", "2"]
    run = CliRunner().invoke(main, [*words, "--json"])
    assert run.exit_code == 3, run.output
    told = json.loads(run.stdout)
    assert told["status"] == "beyond-horizon"
    assert told["bounds"]["P"]["x"]["lower"][0] < -1.0
    assert told["limits"][0]["kept"] is False
    assert told["controls"] >= CONTROLS
    assert told["unseen"] == pytest.approx(unseen(told["controls"]))
