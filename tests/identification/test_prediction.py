"""What was learnt from the first second of a real machine holds half a minute later (Kaheman et al. 2022)."""

from __future__ import annotations

from pathlib import Path

import pytest
from shoal.identification import Problem, identify, load_problem

RECORDINGS = Path(__file__).parents[3] / "shared" / "data" / "multiarm_kaheman"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the recordings are not here"),
]


@pytest.mark.parametrize(("name", "seconds", "below"), [("double", 1.0, 5e-3), ("single", 4.0, 2e-3)])
def test_a_machine_is_predicted_by_its_parameters(name: str, seconds: float, below: float) -> None:
    """Two seconds from second 30 on, where only the initial state is found anew; RMS of the angles [rad]."""
    data = str(RECORDINGS / f"{name}_1kHz.csv.gz")
    problem = load_problem(f"kaheman-{name}")
    trained = identify(window(problem, 0.0, seconds), data=data)
    machine = {
        parameter.path: trained.parameters[key].value
        for key, parameter in problem.parameters.items()
        if parameter.path is not None and not parameter.path.startswith("initial.")
    }
    later = window(problem, 30.0, 2.0).model_dump(mode="json", exclude_none=True)
    later |= {"values": machine, "quantities": {}, "constants": {}}
    later["parameters"] = {k: p for k, p in later["parameters"].items() if p["path"] not in machine}
    assert len(later["parameters"]) == {"double": 4, "single": 2}[name]
    estimate = identify(Problem.parse(later, "later"), data=data)
    assert estimate.verdict.trusted
    assert estimate.rms < below


def window(problem: Problem, start: float, duration: float) -> Problem:
    """The problem on a part of its recording [s]."""
    data = problem.model_dump(mode="json", exclude_none=True)
    data["source"] |= {"start": start, "duration": duration}
    return Problem.parse(data, problem.name)
