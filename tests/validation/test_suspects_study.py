"""The study of wrong models: its bounds, and what it counts."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from shoal_validation.suspects.__main__ import main
from shoal_validation.suspects.study import Trial, at_most

ONE = Trial(0, "pendulum", "clock", "clock", "model rejected", ("clock",), (), True, 1.0, 30.0, 1.0)


@pytest.mark.parametrize(
    ("count", "total", "bound"), [(0, 100, 0.02951), (1, 200, 0.02350), (0, 200, 0.01487), (3, 3, 1.0)]
)
def test_the_largest_chance_at_95_per_cent(count: int, total: int, bound: float) -> None:
    """One-sided; 1 - 0.05^(1/n) for none of n."""
    assert at_most(count, total) == pytest.approx(bound, abs=1e-5)


def test_where_a_cause_is_named() -> None:
    with_gravity = replace(ONE, named=("clock", "gravity"))
    assert ONE.place == "alone"
    assert replace(with_gravity, alike=("gravity",)).place == "same effect"
    assert with_gravity.place == "fits as well"
    assert replace(ONE, named=("tilt",)).place == "missed"
    assert replace(ONE, named=(), noticed=False).place == "unseen"


def test_trials_in_a_file_are_not_run_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "trials.jsonl"
    unseen = replace(ONE, seed=1, named=(), noticed=False)
    file.write_text("\n".join(json.dumps(asdict(t)) for t in (ONE, unseen)) + "\n")
    main(["--seeds", "0:2", "--file", str(file)])
    told = capsys.readouterr().out
    assert "cause named first: 1 of 1 (100.0 %, at least 5.0 %) whose misfit is seen, 1 of 2 (50.0 %" in told
