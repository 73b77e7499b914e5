from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shoal.engines.sweep import Sweep
from shoal.errors import InputError
from shoal.pictures.signals import residuals
from shoal.requests.simulate import Simulate
from shoal_flows import jobs
from shoal_flows.flows.tables import of_motion
from shoal_flows.jobs import Fit

STUDY = """uncertain:
  scene: single-pendulum
  vary: {{initial.OA.angle: "-0.1:0.1"}}
  at: [0.5]
  limit: A.y > 0.5
  worst-of: {worst}
"""


@pytest.mark.slow
def test_fit_carries_the_motion_of_what_it_found(fits: list[Fit]) -> None:
    fit = fits[0]
    assert fit.estimate.verdict.trusted
    left = residuals(fit.estimate)["recording"]
    assert np.mean(np.sum(left**2, axis=1)) == pytest.approx(fit.estimate.fitness, rel=1e-9)
    assert fit.motion.times[0] == 0
    assert fit.motion.times[-1] == fit.estimate.measurement.end
    assert np.allclose(fit.motion.marker("B")[-1], fit.estimate.predicted["recording"][-1], atol=1e-12)


def test_a_motion_is_verified_and_one_that_a_second_run_contradicts_is_not_trusted() -> None:
    coarse = {"solver.integrator": "rk4", "solver.step": 0.1, "solver.duration": 20.0, "solver.energy_tolerance": 0.5}
    motion = jobs.simulated(Simulate("single-pendulum", set=coarse))[0]
    assert not motion.ok
    assert motion.message.startswith("the time error is about ")
    good = jobs.simulated(Simulate("single-pendulum"))[0]
    assert "estimated error at the markers: " in of_motion(good)


def test_sweep_covers_the_grid(sweep: Sweep) -> None:
    assert sweep.grid["initial.OA.angle"].tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert sweep.ok


def test_unknown_names_are_refused_in_one_line() -> None:
    with pytest.raises(InputError, match="no such scene"):
        jobs.simulated(Simulate("nowhere"))


@pytest.mark.parametrize("worst", ["B.y.upper", "A.y.most", "A.y > 0.6"])
def test_a_worst_case_that_there_is_not_is_told_before_the_study(
    worst: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs, "uncertain", lambda *_, **__: pytest.fail("the study was made first"))
    (tmp_path / "study.yaml").write_text(STUDY.format(worst=worst))
    with pytest.raises(InputError, match=r"worst-of: .* is neither a limit of the study \(A.y > 0.5\) nor"):
        jobs.responded(str(tmp_path / "study.yaml"), {})
