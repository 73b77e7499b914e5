"""What may be believed: every way a run can fail has its status, and bad scenes are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics import simulate
from shoal.mechanics.integrators import INTEGRATORS
from shoal.mechanics.marched import sampled
from shoal.mechanics.simulate import stable_step
from shoal.mechanics.workspace import Workspace
from shoal.scene import Scene, load_scene
from shoal.trajectory import Status

FLEXIBLE = load_scene("flexible-double-pendulum")
RIGID = load_scene("rigid-double-pendulum")
every = pytest.mark.parametrize("integrator", list(INTEGRATORS))


def _with(scene: Scene, **settings: Any) -> Scene:
    return scene.with_values({f"solver.{key}": value for key, value in settings.items()})


def test_a_run_that_loses_energy_is_not_believed() -> None:
    # A spectral radius below one damps the modes that the step does not resolve; at 0.05 s that is the pendulum.
    scene = _with(RIGID, integrator="generalized-alpha", step=0.05, spectral_radius=0.5)
    run = simulate.simulate(scene, np.array([2.0]))
    assert run.status == (Status.ENERGY,)
    assert run.findings[0].numbers["drift"] == pytest.approx(0.06, abs=0.01)
    assert np.all(np.isfinite(run.points))
    assert simulate.simulate(_with(scene, step=0.005), np.array([2.0])).ok


def _sprung(rate: float, law: dict[str, Any], **solver: Any) -> Scene:
    """1 kg on a line, at the place where the spring is relaxed, with a rate [m/s]."""
    anchor = {"body": "ground", "point": [-1.0, -1.3]}
    return Scene.parse({
        "name": "sprung", "gravity": [0.0, 0.0], "bodies": {"p": {"kind": "point-mass", "mass": 1.0}},
        "joints": {"s": {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "p"},
                         "friction": 0.1}},
        "loads": {"w": {"kind": "spring", "first": anchor, "second": {"body": "p"}, "length": 2.69**0.5, **law}},
        "markers": {"p": {"body": "p"}}, "initial": {"p": {"position": [0.0, 0.0], "velocity": [rate, 0.0]}},
        "solver": {"duration": 20.0, "integrator": "dop853", **solver},
    })  # fmt: skip


LAWS = [{"elastic": "100*t"}, {"elastic": "-t+t**3"}, {"elastic": "sin(t)"}, {"stiffness": 100.0}]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("rate", [0.0, 1e-12, 1e-10])
def test_a_machine_at_rest_but_for_round_off_is_believed(law: dict[str, Any], rate: float) -> None:
    """What the law returns in place of zero drives it, and its energy had no other to be compared with."""
    run = simulate.simulate(_sprung(rate, law, absolute_tolerance=1e-11), np.array([3.0, 20.0]))
    assert run.ok, run.message


@pytest.mark.parametrize("law", [{"elastic": "1e12*t"}, {"stiffness": 1e12}])
def test_a_stiff_spring_at_rest_but_for_round_off_is_believed(law: dict[str, Any]) -> None:
    run = simulate.simulate(_sprung(0.0, law, absolute_tolerance=1e-16, duration=1e-4), np.array([1e-4]))
    assert run.ok, run.message


@pytest.mark.parametrize("law", [LAWS[0], LAWS[3]])
@pytest.mark.parametrize("rate", [1e-9, 1e-6])
def test_small_motions_with_steps_too_long_are_not_believed(law: dict[str, Any], rate: float) -> None:
    """0.1 nm and 0.1 um: the oscillator turns by a radian in a step, and leapfrog's energy is off by a half."""
    run = simulate.simulate(_sprung(rate, law, integrator="leapfrog", step=0.15), np.array([3.0, 20.0]))
    assert run.status == (Status.ENERGY,)


def test_runge_kutta_near_its_limit_shows_its_loss_of_energy() -> None:
    near = simulate.simulate(_with(FLEXIBLE, integrator="rk4", step=9.3e-4, energy_tolerance=1e-7), np.array([0.5]))
    assert near.status == (Status.ENERGY,)
    fine = simulate.simulate(_with(FLEXIBLE, integrator="rk4", step=1e-4, energy_tolerance=1e-7), np.array([0.5]))
    assert fine.ok
    assert fine.energy_drift[0] < 0.01 * near.energy_drift[0]


def test_a_coarse_run_of_violent_motion_is_not_believed() -> None:
    scene = _with(RIGID, integrator="leapfrog", step=0.05).with_values({"initial.AB.rate": 20.0})
    run = simulate.simulate(scene, np.array([2.0]))
    assert run.status[0] in (Status.ENERGY, Status.OUT_OF_REACH, Status.DIVERGED)
    assert run.message


@every
def test_a_motion_that_is_not_finite_has_diverged(integrator: str) -> None:
    scene = _with(FLEXIBLE, integrator=integrator, step=5e-4).with_values({"initial.AB.rate": 1e200})
    times = np.linspace(0, 0.02, 5)[1:]
    run = simulate.simulate(scene, times)
    assert run.status == (Status.DIVERGED,)
    assert run.codes == ["not-finite"]
    assert not run.ok


@pytest.mark.parametrize("rate", [1e3, 1e4, 1e6])
@every
@pytest.mark.by_day(4)
def test_violent_motion_never_passes_as_ok(integrator: str, rate: float) -> None:
    # Just under the limit of the state at rest: the stretched cables are stiffer, the step is too long for them.
    scene = _with(FLEXIBLE, integrator=integrator, step=6.5e-4).with_values({"initial.AB.rate": rate})
    assert not simulate.simulate(scene, np.array([0.25, 0.5])).ok


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        ({"samples": np.nan}, Status.DIVERGED),
        ({"energy_error": np.nan}, Status.DIVERGED),
        ({"energy_error": np.inf}, Status.DIVERGED),
        ({"energy_scale": np.nan}, Status.DIVERGED),
        ({"energy_error": 1e3}, Status.ENERGY),
        ({"samples": 4.0}, Status.OUT_OF_REACH),
        ({"drift": 1e-3}, Status.DRIFTED),
        ({"drift": np.nan}, Status.DRIFTED),
        ({}, Status.OK),
    ],
)
def test_the_verdict_on_a_record(spoil: dict[str, float], expected: Status, monkeypatch: pytest.MonkeyPatch) -> None:
    """One number of the record is spoilt after the march."""

    def spoilt(*arguments: Any) -> Any:
        record = march(*arguments)
        for field, value in spoil.items():
            getattr(record, field)[-1] = value
            if field == "samples":
                record.samples[:] = value
        return record

    march = Workspace.run
    monkeypatch.setattr(Workspace, "run", spoilt)
    run = simulate.simulate(RIGID, np.array([0.1, 0.2]))
    assert run.status == (expected,)
    assert bool(run.message) == (expected is not Status.OK)


def test_one_sample_that_is_not_finite_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    def spoilt(*arguments: Any) -> Any:
        record = march(*arguments)
        record.samples[sampled(2)] = np.nan
        return record

    march = Workspace.run
    monkeypatch.setattr(Workspace, "run", spoilt)
    run = simulate.simulate(RIGID, np.linspace(0, 0.2, 11))
    assert run.status == (Status.DIVERGED,)


def test_a_record_of_lanes_names_the_first_that_failed() -> None:
    scene = _with(RIGID, integrator="leapfrog", step=5e-3)
    run = simulate.simulate(scene, np.array([1.0]), {"initial.AB.rate": np.array([0.0, 30.0, 0.1])})
    assert run.status == (Status.OK, Status.ENERGY, Status.OK)
    assert run.codes == ["energy-not-balanced"]


@every
def test_at_time_zero_everything_is_where_it_starts(integrator: str) -> None:
    run = simulate.simulate(_with(RIGID, integrator=integrator), np.array([0.0]))
    assert run.ok
    assert run.steps == 0
    np.testing.assert_allclose(run.angles[0, :, 0], [np.pi / 4, np.pi / 6], atol=1e-15)


def test_a_machine_at_rest_in_equilibrium_is_ok() -> None:
    hanging = {"initial.OA.angle": -np.pi / 2, "initial.AB.angle": -np.pi / 2}
    run = simulate.simulate(RIGID.with_values(hanging), np.array([0.5]))
    assert run.ok, run.message
    np.testing.assert_allclose(run.marker("B")[-1], [0, -3], atol=1e-12)


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(RIGID, id="rigid"),
        pytest.param(FLEXIBLE, id="flexible"),
    ],
)
def test_nothing_moves_without_gravity(scene: Scene) -> None:
    run = simulate.simulate(scene.with_values({"gravity": [0.0, 0.0]}), np.array([0.0, 0.1]))
    np.testing.assert_allclose(run.points[0], run.points[1], atol=1e-12)
    assert run.ok, run.message


ROD = {"kind": "rod", "height": 0.02, "width": 0.05, "density": 1000.0, "length": 1.0}
CABLE = ROD | {"youngs_modulus": 2e8, "element": "ancf-cable", "elements": 2}


def _machine(bodies: dict[str, Any], joints: dict[str, Any], markers: dict[str, Any], **other: Any) -> Scene:
    joined = {
        name: {"first": {"body": a, "point": p}, "second": {"body": b, "point": q}}
        for name, (a, p, b, q) in joints.items()
    }
    places = {name: {"body": body, "point": point} for name, (body, point) in markers.items()}
    return Scene.parse({"name": "m", "bodies": bodies, "joints": joined, "markers": places} | other)


BOB = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.0, "centre_of_mass": [1.0, 0.0], "named_points": {"end": [1, 0]}}
GROUNDED = {"O": ("ground", [0.0, 0.0], "R", "start")}


@pytest.mark.parametrize(
    ("scene", "why"),
    [
        pytest.param(
            _machine({"R": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.0}}, GROUNDED, {"E": ("R", "start")}),
            "mass matrix is singular; some coordinate of R moves no mass: state a larger bodies.R.inertia$",
            id="a-mass-point-that-cannot-move",
        ),
        pytest.param(
            load_scene("rigid-double-pendulum").with_values(
                {"bodies": dict.fromkeys(("OA", "AB"), BOB), "joints.A.mu": 0.1, "joints.A.radius": 0.01}
            ),
            r"a larger bodies\.(OA|AB)\.inertia, or leave out joints\.A\.mu",
            id="a-pin-whose-force-counts-between-bodies-without-inertia",
        ),
        pytest.param(
            _machine(
                {"R": ROD, "S": ROD},
                GROUNDED | {"A": ("R", "end", "S", "start"), "B": ("R", "start", "S", "start")},
                {"E": ("S", "end")},
            ),
            r"joints",
            id="one-point-in-two-places-of-a-body",
        ),
        pytest.param(
            _machine({"R": ROD}, GROUNDED | {"P": ("ground", [1.0, 0.0], "R", "start")}, {"E": ("R", "end")}),
            r"joints",
            id="one-point-in-two-places-of-the-ground",
        ),
    ],
)
def test_a_machine_that_cannot_be_modelled_is_refused(scene: Scene, why: str) -> None:
    with pytest.raises(InputError, match=why) as refusal:
        simulate.simulate(scene, np.array([0.1]))
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(_machine({"R": ROD}, GROUNDED, {"E": ("R", [3.0, 0.5])}), id="a-marker-outside-the-rod"),
        pytest.param(
            _machine(
                {"R": ROD, "S": ROD},
                GROUNDED | {"P": ("ground", [10.0, 0.0], "S", "start")},
                {"E": ("R", "end"), "F": ("S", "end")},
            ),
            id="two-machines-far-apart",
        ),
        pytest.param(
            _machine(
                {"R": ROD, "S": ROD},
                GROUNDED | {"A": ("R", [4.0, 1.0], "S", "start")},
                {"E": ("S", "end")},
            ),
            id="a-joint-outside-the-rod",
        ),
    ],
)
def test_the_check_of_reach_believes_legal_machines(scene: Scene) -> None:
    run = simulate.simulate(_with(scene, integrator="rk4"), np.array([0.05, 0.1]))
    assert run.ok, run.message


def test_a_loop_that_starts_apart_is_assembled_or_refused() -> None:
    """What is not stated follows from the crank; a coupler that no crank allows, and a loop too long, are refused."""
    bodies = {"R": ROD, "S": ROD | {"length": 2.0}, "T": ROD | {"length": 1.5}}
    joints = GROUNDED | {
        "A": ("R", "end", "S", "start"),
        "B": ("S", "end", "T", "end"),
        "C": ("ground", [2.0, 0.0], "T", "start"),
    }
    scene = _machine(bodies, joints, {"B": ("S", "end")}, initial={"R": {"angle": 1.2}})
    run = simulate.simulate(_with(scene, integrator="rk4"), np.array([0.0, 0.1]))
    assert run.ok, run.message
    assert run.model["initial_correction"] == 0.0
    assert run.model["initial"]["R"]["angle"] == pytest.approx(1.2, abs=1e-14)  # from the coordinates
    for place in run.marker("B"):
        assert np.hypot(*(place - [2.0, 0.0])) == pytest.approx(1.5, abs=1e-12)
    wrong = _machine(bodies, joints, {"B": ("S", "end")}, initial={"R": {"angle": 1.2}, "S": {"angle": 0.1}})
    with pytest.raises(InputError, match=r"initial\.S\.angle: 0\.1 rad cannot be kept: joint C"):
        simulate.simulate(wrong, np.array([0.1]))
    apart = _machine(bodies, joints | {"C": ("ground", [9.0, 0.0], "T", "start")}, {"B": ("S", "end")})
    with pytest.raises(InputError, match=r"joints\.C: cannot be assembled"):
        simulate.simulate(apart, np.array([0.1]))


def test_torque_on_a_fine_mesh_has_a_stability_limit() -> None:
    """A load without stiffness and damping leaves the damping matrix of a large model empty."""
    scene = load_scene("flexible-double-pendulum").with_values(
        {
            "bodies.OA.elements": 60,
            "bodies.AB.elements": 60,
            "loads": {"torque": {"kind": "torque", "at": {"body": "OA"}, "torque": 1.0}},
        }
    )
    assert 0 < stable_step(scene, "leapfrog") < 1e-4
