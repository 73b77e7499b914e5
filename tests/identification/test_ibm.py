"""The filmed double pendulum of Asseman et al. (2018): its published clock contradicts gravity.

With the published arms of 91 and 70 mm the five runs agree on a clock that shows 1.26 s for each second.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from shoal.identification import Verdict, identify, load_problem

RECORDINGS = Path(__file__).parents[3] / "shared" / "data" / "ibm_double_pendulum"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the recordings are not here"),
]


@pytest.mark.parametrize("run", [1, 2, 3, 4])
def test_a_free_clock_comes_out_fast(run: int) -> None:
    """Run 0 alone gives 1.19 in its first second and 1.29 later."""
    estimate = identify(load_problem("ibm-double-pendulum"), data=str(RECORDINGS / f"{run}.csv.gz"))
    assert estimate.verdict.trusted
    assert estimate.parameters["clock"].value == pytest.approx(1.26, abs=0.03)


@pytest.mark.parametrize("run", [3, 4])
def test_the_published_clock_is_rejected_and_a_fast_one_named(run: int) -> None:
    problem = load_problem("ibm-double-pendulum")
    known = {name: parameter for name, parameter in problem.parameters.items() if name != "clock"}
    fixed = problem.model_copy(update={"parameters": known})
    estimate = identify(fixed, data=str(RECORDINGS / f"{run}.csv.gz"))
    assert estimate.verdict is Verdict.REJECTED
    # A free swing tells clock and gravity only together: g goes with the square of the clock.
    named = [one for one in estimate.suspects if one.name in ("clock", "gravity")]
    assert named == estimate.suspects
    for one in named:
        fast = one.value if one.name == "clock" else (one.stated / one.value) ** 0.5
        assert fast == pytest.approx(1.26, abs=0.03)
        assert one.before > 3 * one.after
    assert f"check the {named[0].name}" in estimate.advice[0]
