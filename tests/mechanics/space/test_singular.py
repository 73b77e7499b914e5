"""Machines in space that pass, start at and stop near singular positions, against their motion in one angle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.assembly import redundancy
from shoal.mechanics.assembly.build import build
from shoal.mechanics.simulate import simulate
from shoal.mechanics.start.start import body_states
from shoal.scene import Scene, load_scene
from shoal_validation.stability.singular_in_space import MACHINES, TURN, linkage


def ends(scene: dict[str, Any], marker: str, times: Any, **solver: Any) -> Any:
    run = simulate(Scene.parse({**scene, "solver": {**scene.get("solver", {}), **solver}}), np.asarray(times))
    assert run.ok, run.message
    return TURN.inv().apply(run.marker(marker))


@pytest.mark.parametrize("name", list(MACHINES))
def test_a_machine_passes_its_singular_position(name: str) -> None:
    machine, reference = MACHINES[name]
    times = np.linspace(0.05, 1.0, 20)
    assert ends(machine(0.6), "A", times) == pytest.approx(reference(0.6)(times), abs=1e-8)


@pytest.mark.parametrize("name", list(MACHINES))
@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-6, 1e-4])
@pytest.mark.by_day(3)
def test_started_at_any_distance_from_the_singular_position(name: str, offset: float) -> None:
    machine, reference = MACHINES[name]
    times = np.array([0.1, 0.5])
    assert ends(machine(offset), "A", times) == pytest.approx(reference(offset)(times), abs=1e-7)


@pytest.mark.parametrize("name", list(MACHINES))
@pytest.mark.parametrize(("integrator", "order"), [("leapfrog", 2), ("rk4", 4)])
def test_an_integrator_keeps_its_order_when_started_at_the_singular_position(
    name: str, integrator: str, order: int
) -> None:
    """A linkage that only its geometry lets move needs short steps: within one it leaves its conditions.

    From halving to halving the order differs where errors are small: what counts is the whole of two of them.
    """
    machine, reference = MACHINES[name]
    longest = 0.01 if name != "bennett" else 3e-4 if integrator == "leapfrog" else 2.5e-3
    exact = reference(0.0)(np.array([0.4]))
    errors = [
        np.abs(ends(machine(0.0), "A", [0.4], integrator=integrator, step=step, energy_tolerance=0.1) - exact).max()
        for step in (longest, longest / 4)
    ]
    assert np.log(errors[0] / errors[1]) / np.log(4.0) > order - 0.35, f"errors {errors}"


@pytest.mark.parametrize("step", [0.02, 0.005, 0.00125])
def test_long_steps_of_a_linkage_that_its_geometry_lets_move_are_right_or_end_in_a_status(step: float) -> None:
    """Leapfrog is of second order; the truth is that of dop853."""
    scenes = ({"integrator": "leapfrog", "step": step}, {"integrator": "dop853"})
    run, true = (simulate(Scene.parse(linkage(0.6) | {"solver": one}), np.array([0.4])) for one in scenes)
    assert run.ok == (step < 0.01)
    if run.ok:
        assert run.distance(true) < 3.0 * step**2
    else:
        assert {*run.codes} & {"energy-not-balanced", "out-of-reach", "joint-not-closed", "joint-torn-open"}


def test_what_holds_twice_is_named_at_a_singular_position_too() -> None:
    named = {}
    for name, angle in (("platform with a leg too many", 0.6), ("bennett", 0.6), ("platform", 0.6)):
        run = simulate(Scene.parse(MACHINES[name][0](angle)), np.array([0.01]))
        named[name] = run.model["redundant_joints"]
    assert set(named["platform with a leg too many"]) == {"L0", "L1", "L2", "L3"}
    assert set(named["bennett"]) == {"R0", "R1", "R2", "R3"}
    assert not named["platform"]


@pytest.mark.parametrize("name", list(MACHINES))
def test_inverse_iterations_find_the_same_redundant_joints(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As they do for machines with many constraints."""
    scene = Scene.parse(MACHINES[name][0](0.6))
    model = build(scene)
    start = body_states(model.frames, scene, model.q0[:, 0], model.v0[:, 0])
    few = redundancy.redundant_joints(scene, start)
    monkeypatch.setattr(redundancy, "DENSE", 0)
    monkeypatch.setattr(redundancy, "SOUGHT", 3)
    assert redundancy.redundant_joints(scene, start) == few


@pytest.mark.parametrize("name", ["n-four-bar-2", "equal-slider-crank"])
def test_joints_named_as_redundant_are_those_whose_forces_are_not_unique(name: str) -> None:
    """A machine of the plane holds itself more than it needs to in space, where its hinges hold all parallel axes."""
    scene = load_scene(name).with_values({"dimensions": 3})
    run = simulate(scene, np.array([1e-3]))
    (found,) = reactions(scene, [0.0])
    assert run.model["redundant_joints"] == list(found.not_unique) == list(scene.joints)
