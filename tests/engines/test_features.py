"""Small scenes, one feature each, through the native solver and the others.

Exudyn's trapezoidal rule is of order two: the error of its positions falls by four with the halved step, so that two
runs give (4 fine - coarse) / 3 with an error of order four. That is held against the native solver's Runge-Kutta
method of order four, and the fine run alone must be about four times nearer to it than the coarse one. CasADi's
CVODES runs at a tolerance of 1e-11. What is left is the error of the native run at its own step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.exudyn import ExudynEngine
from shoal.errors import InputError
from shoal.trajectory import Array

Cases = dict[str, Any]
Run = Callable[..., Array]


@pytest.mark.by_day(3)
def test_native_solver_agrees_with_exudyn(exudyn_case: Any, run: Run, native: Run) -> None:
    pytest.importorskip("exudyn")
    case, ours = exudyn_case, native(exudyn_case)
    coarse, fine = (run(ExudynEngine(), case.scene, case.times, step=case.step / k) for k in (1, 2))
    errors = [np.max(np.abs(theirs - ours)) for theirs in (coarse, fine)]
    assert 2.5 < errors[0] / errors[1] < 6
    np.testing.assert_allclose((4 * fine - coarse) / 3, ours, atol=case.tolerance)


def test_native_solver_agrees_with_casadi(casadi_case: Any, run: Run, native: Run) -> None:
    pytest.importorskip("casadi")
    theirs = run(get_engine("casadi"), casadi_case.scene, casadi_case.times)
    np.testing.assert_allclose(theirs, native(casadi_case), atol=1e-8)


@pytest.mark.parametrize(
    "name", ["clamped-tip-mass", pytest.param("distributed", marks=pytest.mark.slow), "torque-on-cable", "two-cables"]
)
@pytest.mark.by_day(1)
def test_beams_come_near_the_cables(name: str, cases: Cases, run: Run) -> None:
    """Shear and rotary inertia are left out of a cable: EI / (kGA L^2) is 1e-4 here."""
    pytest.importorskip("exudyn")
    case = cases[name]
    fine = {f"bodies.{body}.elements": 8 for body, rod in case.scene.bodies.items() if rod.element != "rigid"}
    machine = case.scene.with_values(fine)
    ours = run(get_engine("gauss"), machine, case.times, step=5e-5, integrator="rk4", duration=case.duration)
    beams = ExudynEngine(beam="geometrically-exact", modified_newton=True)
    np.testing.assert_allclose(run(beams, machine, case.times, step=1e-4), ours, atol=2e-4)


@pytest.mark.parametrize(
    ("name", "path", "value", "message"),
    [
        ("driven-crank", "initial.A.rate", 2.0, r"initial\.A\.rate: 2 rad/s cannot .* D asks for 3 rad/s; .*"),
        ("driven-crank", "initial.A.angle", 0.4, r"initial\.A\.angle: 0\.4 rad cannot .* D .* 0\.1 rad apart; .*"),
        ("clamp", "initial.A.rate", 1.0, r"initial\.A\.rate: 1 rad/s cannot be kept: joint O asks for 0 rad/s; .*"),
        ("swinging-mass", "initial.A.velocity", [1.0, 0.0], r"initial\.A\.velocity: .* D asks for \[0\.36, -0\.48\].*"),
    ],
)
def test_a_start_that_a_joint_forbids_is_bad_input(
    name: str, path: str, value: Any, message: str, cases: Cases
) -> None:
    pytest.importorskip("exudyn")
    machine = cases[name].scene
    with pytest.raises(InputError, match=f"^{message}$"):
        ExudynEngine().simulate(machine.with_values({path: value}))


@pytest.mark.parametrize("name", ["torsion", "damped-cable", "slider-friction", "force-in-time", "elastic-table"])
@pytest.mark.by_day(2)
def test_exudyns_energy_balance_counts_springs_friction_and_loads(name: str, cases: Cases) -> None:
    """The trapezoidal rule leaves an error of order two in the balance, and nothing else."""
    pytest.importorskip("exudyn")
    case = cases[name]
    drifts = [
        ExudynEngine().simulate(case.scene.with_values({"solver.step": case.step / k}), case.times).energy_drift[0]
        for k in (1, 2)
    ]
    assert drifts[0] < 3e-5
    assert drifts[0] / drifts[1] == pytest.approx(4, abs=0.5)


def test_prescribed_motion_has_no_energy_balance_and_says_so(cases: Cases) -> None:
    pytest.importorskip("exudyn")
    machine = cases["driven-crank"].scene
    trajectory = ExudynEngine().simulate(machine, [0.1])
    assert trajectory.ok
    assert np.isnan(trajectory.energy_drift[0])
    assert trajectory.model["energy_check"].startswith("none")
