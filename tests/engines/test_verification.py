"""What energy and drift cannot see: long steps, chaos, coarse meshes, a wrong branch. A second run sees it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine, sources
from shoal.engines.verification import verified, verify
from shoal.scene import load_scene
from shoal.trajectory import Status
from shoal_validation.problems import PROBLEMS, get_problem

THIN = {"bodies.OA.elements": 1, "bodies.AB.elements": 2, "bodies.OA.height": 0.004, "bodies.AB.height": 0.004}
PULLED = {
    "initial.left.angle": 0.0,
    "initial.left.rate": -4.0,
    "initial.right.angle": 0.0,
    "initial.right.rate": -4.0,
    "loads": {"pull": {"kind": "force", "at": {"body": "left", "point": "end"}, "force": [20.0, 0.0]}},
}
WRONG: dict[str, tuple[str, dict[str, Any]]] = {
    "energy-momentum, long step": (
        "rigid-double-pendulum",
        {"solver.integrator": "energy-momentum", "solver.step": 0.1},
    ),
    "leapfrog, long step": ("parallelogram", {"solver.integrator": "leapfrog", "solver.step": 0.02}),
    "chaos, rk4": (
        "rigid-double-pendulum",
        {"solver.integrator": "rk4", "solver.step": 0.005, "solver.duration": 10.0},
    ),
    "chaos, auto": ("rigid-double-pendulum", {"solver.duration": 30.0}),
    "locked thin rods": ("flexible-double-pendulum", THIN),
    "wrong branch": ("parallelogram", {**PULLED, "solver.rank_tolerance": 1e-14, "solver.duration": 3.0}),
}


@pytest.mark.parametrize("name", list(WRONG))
def test_wrong_runs_that_conserve_energy_are_not_believed(name: str) -> None:
    scene_name, values = WRONG[name]
    run = verified(get_engine("gauss"), load_scene(scene_name).with_values(values))
    assert run.status[0] is not Status.OK, run.model["verification"]


EXACT = [name for name in PROBLEMS if name != "squeezer"]
LONG = {"governor"}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in LONG else name for name in EXACT]
)
@pytest.mark.by_day(3)
def test_estimated_error_covers_the_true_one(name: str) -> None:
    """References: closed forms, scipy, Exudyn (see the problem library)."""
    problem = get_problem(name)
    run = verified(get_engine("gauss"), problem.scene(), problem.times)
    stated = run.model["verification"]
    estimate = (stated["time_error"] or 0.0) + (stated["mesh_error"] or 0.0)
    assert run.ok, run.message
    assert problem.error(run) <= 2 * estimate + problem.reference.error


def test_chaos_is_believed_as_long_as_it_is_known() -> None:
    """At 15 s tolerances of 1e-12 and 1e-14 are 0.13 m apart, 1e-10 and 1e-12 as far as the machine is long."""
    scene = load_scene("rigid-double-pendulum").with_values({"solver.duration": 15.0})
    run = verified(get_engine("gauss"), scene, [15.0])
    tight = get_engine("gauss").simulate(
        scene.with_values({"solver.relative_tolerance": 1e-14, "solver.absolute_tolerance": 1e-14}), [15.0]
    )
    true = float(np.linalg.norm(run.marker("B")[-1] - tight.marker("B")[-1]))
    assert run.ok, run.message
    assert true / 3 < run.model["verification"]["time_error"] < 3 * true


def test_other_engines_are_held_against_the_native_one() -> None:
    run = verified(get_engine("exudyn"), load_scene("flexible-double-pendulum"))
    assert run.ok, run.message
    assert 1e-6 < run.model["verification"]["time_error"] < 1e-3


def test_another_engine_that_is_far_off_is_said_to_differ_and_by_how_much() -> None:
    """Its trajectory is ours under another gravity, of which no step is to blame."""
    scene, gauss = load_scene("single-pendulum"), get_engine("gauss")
    times = np.linspace(0.1, 1.0, 10)
    ours, other = gauss.simulate(scene, times), gauss.simulate(scene.with_values({"gravity.0": 3.0}), times)
    found = verify(replace(other, engine="other", model={"unknowns": 1}), scene)
    assert found.error("time") == pytest.approx(ours.distance(other), rel=1e-6)
    (finding,) = found.findings
    assert finding.code == "differs-from-native"
    assert finding.numbers["error"] == pytest.approx(ours.distance(other), rel=1e-6)
    assert verify(ours, scene).findings == []


def test_no_second_run_that_takes_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sources, "PATIENCE", 0.0)
    monkeypatch.setattr(sources, "GENEROUS", 0.0)
    stated = verified(get_engine("gauss"), load_scene("flexible-double-pendulum")).model["verification"]
    assert stated["time_error"] is stated["mesh_error"] is None
    assert "that would take" in stated["note"]


ENDED: dict[str, tuple[str, dict[str, float]]] = {
    "at the longest step": ("0", {"solver.max_step": 0.3, "solver.duration": 5.0}),
    "as functions of time have it": ("3*sin(7*t)", {"solver.duration": 25.0}),
    "at kinks": ("2*abs(sin(9*t))", {"solver.max_step": 10.0, "solver.duration": 6.0}),
}
"""Steps that end for other reasons than a loose tolerance: the torque on a pendulum of 1 kg and 1 m, and settings."""


@pytest.mark.parametrize("name", list(ENDED))
def test_steps_that_end_for_other_reasons_than_their_tolerance_are_halved_to_tell_their_error(name: str) -> None:
    """A second run of the same steps agrees to the last digit, however wrong both are. Truth: scipy."""
    torque, settings = ENDED[name]
    loose = {"solver.integrator": "dop853", "solver.relative_tolerance": 0.1, "solver.absolute_tolerance": 0.1}
    drive = {"loads": {"drive": {"kind": "torque", "at": {"body": "OA"}, "torque": torque}}}
    times = np.linspace(0.0, settings["solver.duration"], 41)
    run = verified(get_engine("gauss"), load_scene("single-pendulum").with_values(loose | drive | settings), times)
    push = eval(f"lambda t: {torque}", {"sin": np.sin, "abs": abs})
    angle = solve_ivp(
        lambda t, y: [y[1], push(t) - 9.81 * np.cos(y[0])],
        (0.0, times[-1]),
        [0.0, 0.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        max_step=0.02,
        t_eval=times,
    ).y[0]
    true = np.max(np.hypot(*(run.marker("A").T - [np.cos(angle), np.sin(angle)])))
    assert run.ok, run.message
    assert true > 1e-6
    assert true / 1.2 < run.model["verification"]["time_error"] < 3 * true


def test_a_looser_run_of_the_same_steps_says_nothing() -> None:
    """Every step ends at `solver.max_step`, at tolerances that are held against looser ones. Truth: the usual ones."""
    settings = {"solver.relative_tolerance": 1e-8, "solver.absolute_tolerance": 1e-8, "solver.max_step": 0.005}
    scene, engine = load_scene("single-pendulum"), get_engine("gauss")
    run = verified(engine, scene.with_values({"solver.integrator": "radau5", **settings}), [5.0])
    true = run.distance(engine.simulate(scene, [5.0]))
    assert true / 1.2 < run.model["verification"]["time_error"] < 3 * true
