"""Motion of spatial trees: order, energy, closed forms, and what is not believed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from shoal.engines.tree.description import SpatialChain
from shoal.engines.tree.simulate import simulate
from shoal.engines.tree.tableau import DOPRI853, RK4
from shoal.errors import InputError
from shoal.trajectory import Status

TOP = {
    "name": "top",
    "bodies": {"T": {"mass": 1.0, "inertia": [0.2, 0.3, 0.4]}},
    "joints": {"O": {"kind": "spherical", "body": "T"}},
    "points": {"tip": {"body": "T", "position": [0, 0, 1]}},
    "initial": {"O": {"coordinate": [0.3, 0, 0], "rate": [0.1, 6.0, 0.2]}},
}


@pytest.mark.parametrize("mix", ["revolute", "spherical", "mixed"])
def test_convergence_slope_of_the_fixed_step(random_tree: Any, mixes: Any, mix: str) -> None:
    chain = random_tree(mixes[mix][:6], 1)
    exact = simulate(chain, [0.5], tolerance=1e-13)
    assert exact.ok, exact.message
    errors = [np.abs(simulate(chain, [0.5], step=h).points - exact.points).max() for h in (1e-2, 5e-3)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.25)


@pytest.mark.parametrize("mix", ["revolute", "prismatic", "spherical", "fixed", "mixed"])
def test_energy_balance_with_loads_and_dampers(random_tree: Any, mixes: Any, mix: str) -> None:
    run = simulate(random_tree(mixes[mix][:6], 2), np.linspace(0.05, 0.5, 10), tolerance=1e-11)
    assert run.ok, run.message
    assert run.energy_drift < 1e-9
    balance = run.kinetic + run.potential - run.work
    np.testing.assert_allclose(balance, balance[0], atol=1e-8 * run.kinetic.max())


def test_energy_is_conserved_without_losses(random_tree: Any, mixes: Any) -> None:
    chain = random_tree(mixes["mixed"][:6], 4, loads={})
    joints = {name: joint.model_copy(update={"damping": 0.0, "load": None}) for name, joint in chain.joints.items()}
    run = simulate(chain.model_copy(update={"joints": joints}), np.linspace(0.0, 2.0, 5), step=1e-3)
    assert run.ok, run.message
    np.testing.assert_array_equal(run.work, 0.0)
    total = run.kinetic + run.potential
    np.testing.assert_allclose(total, total[0], atol=1e-7 * run.kinetic.max())


def _pendulum(turn: list[float], first: float, second: float) -> SpatialChain:
    """A double pendulum of rods of 1 m and 0.8 m in the plane that `turn` makes of x and y, gravity along -y."""
    plane = Rotation.from_rotvec(turn)
    rods = {"A": (1.0, 2.0), "B": (0.8, 1.5)}
    return SpatialChain.model_validate(
        {
            "name": "double pendulum",
            "gravity": plane.apply([0.0, -9.81, 0.0]).tolist(),
            "bodies": {
                name: {
                    "mass": mass,
                    "inertia": [1e-3, mass * length**2 / 12, mass * length**2 / 12],
                    "centre_of_mass": [length / 2, 0, 0],
                }
                for name, (length, mass) in rods.items()
            },
            "joints": {
                "O": {"body": "A", "axis": [0, 0, 2], "on_parent": {"rotation": turn}},
                "P": {"body": "B", "parent": "A", "axis": [0, 0, 1], "on_parent": {"position": [1, 0, 0]}},
            },
            "initial": {"O": {"coordinate": first}, "P": {"coordinate": second - first, "rate": 1.0}},
            "points": {"tip": {"body": "B", "position": [0.8, 0, 0]}},
        }
    )


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0.7, -1.1, 0.4]])
def test_in_a_plane_it_is_the_double_pendulum(uniform_rods: Any, turn: list[float]) -> None:
    times = np.linspace(0.2, 2.0, 10)
    run = simulate(_pendulum(turn, 0.5, -0.3), times, tolerance=1e-13)
    assert run.ok, run.message
    angles, rates = uniform_rods(
        [2.0, 1.5], [2.0 / 12, 1.5 * 0.64 / 12], [[0.5, 0.0], [1.0, 0.4]], [0.5, -0.3], [0.0, 1.0], times
    )
    np.testing.assert_allclose(run.coordinate("O")[:, 0], angles[0], atol=1e-9)
    np.testing.assert_allclose(run.coordinate("P")[:, 0], angles[1] - angles[0], atol=1e-9)
    np.testing.assert_allclose(run.rate("P")[:, 0], rates[1] - rates[0], atol=1e-9)
    tip = np.exp(1j * angles[0]) + 0.8 * np.exp(1j * angles[1])
    flat = np.stack([tip.real, tip.imag, np.zeros(10)], axis=1)
    np.testing.assert_allclose(run.point("tip"), Rotation.from_rotvec(turn).apply(flat), atol=1e-9)


def test_a_free_top_obeys_euler() -> None:
    """J omega' = -omega x J omega; the middle axis tumbles, and the quaternion stays a unit."""
    times = np.linspace(0.5, 10.0, 20)
    run = simulate(SpatialChain.model_validate(TOP), times, tolerance=1e-12)
    assert run.ok, run.message
    moments = np.array([0.2, 0.3, 0.4])
    euler = solve_ivp(
        lambda _, w: -np.cross(w, moments * w) / moments,
        (0, 10),
        [0.1, 6.0, 0.2],
        "DOP853",
        times,
        rtol=1e-13,
        atol=1e-13,
    )
    np.testing.assert_allclose(run.rate("O"), euler.y.T, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(run.coordinate("O"), axis=1), 1.0, atol=1e-14)
    spin = np.einsum("sij,sj->si", run.rotation("T"), moments * run.rate("O"))
    np.testing.assert_allclose(spin, np.tile(spin[0], (20, 1)), atol=1e-9)


def test_fixed_step_keeps_quaternions_units() -> None:
    run = simulate(SpatialChain.model_validate(TOP), [5.0], step=5e-3)
    assert run.ok, run.message
    assert np.linalg.norm(run.coordinate("O")) == pytest.approx(1.0, abs=1e-14)


def test_a_slider_falls() -> None:
    chain = SpatialChain.model_validate(
        {
            "name": "slider",
            "bodies": {"S": {"mass": 2.0, "inertia": [1, 1, 1]}},
            "joints": {"O": {"kind": "prismatic", "body": "S", "axis": [0, 0, -1], "damping": 2.0, "load": 1.0}},
            "points": {"S": {"body": "S"}},
        }
    )
    run = simulate(chain, [0.0, 1.0, 2.0], tolerance=1e-12)
    pull = 9.81 + 0.5
    speed = pull * (1 - np.exp(-run.times))
    np.testing.assert_allclose(run.rate("O")[:, 0], speed, atol=1e-10)
    np.testing.assert_allclose(run.point("S")[:, 2], -(pull * run.times - speed), atol=1e-10)


def test_a_welded_body_moves_as_one_with_its_parent() -> None:
    """Two halves, welded, are the whole."""
    whole = {"mass": 2.0, "inertia": [0.02, 0.2, 0.2], "centre_of_mass": [0.5, 0, 0]}
    half = {"mass": 1.0, "inertia": [0.01, 0.1 - 0.25**2, 0.1 - 0.25**2]}
    tip = {"tip": {"body": "A", "position": [1, 0, 0]}}
    hinge = {"body": "A", "axis": [0, 1, 0]}
    weld = {"kind": "fixed", "body": "B", "parent": "A", "on_parent": {"position": [0.75, 0, 0], "rotation": [1, 0, 0]}}
    one = SpatialChain.model_validate({"name": "one", "bodies": {"A": whole}, "joints": {"O": hinge}, "points": tip})
    bodies = {"A": {**half, "centre_of_mass": [0.25, 0, 0]}, "B": half}
    # In the order of the file the weld comes first; the tree is sorted.
    two = SpatialChain.model_validate(
        {"name": "two", "bodies": bodies, "joints": {"W": weld, "O": hinge}, "points": tip}
    )
    expected, found = (simulate(chain, [0.5, 1.0], step=1e-3).points for chain in (one, two))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_controlled_steps_follow_the_tolerance() -> None:
    chain = SpatialChain.model_validate(TOP)
    exact = simulate(chain, [10.0], tolerance=1e-13).points
    runs = [simulate(chain, [10.0], tolerance=10.0**-digits) for digits in (5, 8, 11)]
    errors = [np.abs(run.points - exact).max() for run in runs]
    assert errors[0] > errors[1] > errors[2]
    assert all(error < 100 * 10.0**-digits for error, digits in zip(errors, (5, 8, 11), strict=True))
    assert runs[0].steps < runs[1].steps < runs[2].steps


def test_sampling_does_not_change_the_motion(random_tree: Any, mixes: Any) -> None:
    chain = random_tree(mixes["mixed"][:6], 6)
    few = simulate(chain, [0.5], step=1e-3)
    many = simulate(chain, np.linspace(0.0, 0.5, 51), step=1e-3)
    assert few.steps == many.steps == 500
    np.testing.assert_allclose(many.points[-1], few.points[0], atol=1e-12)


@pytest.mark.parametrize(("method", "order"), [(RK4, 4), (DOPRI853, 8)])
def test_tableaus_are_consistent(method: Any, order: int) -> None:
    """Row sums, and sum b c^k = 1 / (k + 1) up to the order."""
    c = method.a.sum(axis=1)
    assert method.order == order
    for power in range(order):
        assert method.b @ c**power == pytest.approx(1 / (power + 1), abs=1e-14)
    assert not np.any(np.triu(method.a))


def test_too_long_steps_are_not_believed(random_tree: Any, mixes: Any) -> None:
    spun = SpatialChain.model_validate({**TOP, "initial": {"O": {"rate": [50.0, 80.0, 1.0]}}})
    assert simulate(spun, [1.0], step=2e-2).status is Status.ENERGY
    fast = SpatialChain.model_validate({**TOP, "initial": {"O": {"rate": [1e200, 1e200, 0.0]}}})
    run = simulate(fast, [1.0], step=1e-2)
    assert run.status is Status.DIVERGED
    assert run.message
    assert simulate(fast, [1.0], tolerance=1e-6).status is not Status.OK


def test_standing_still_is_believed() -> None:
    run = simulate(
        _pendulum([0.0, 0.0, 0.0], -np.pi / 2, -np.pi / 2).model_copy(
            update={"initial": {}, "gravity": (1.0, 0.0, 0.0)}
        ),
        [1.0],
        step=1e-2,
    )
    assert run.ok, run.message


def test_a_step_that_would_take_forever_is_refused() -> None:
    with pytest.raises(InputError, match="use a longer one"):
        simulate(SpatialChain.model_validate(TOP), [1.0], step=1e-12)


def test_nothing_that_moves_is_refused() -> None:
    welded = {**TOP, "joints": {"O": {"kind": "fixed", "body": "T"}}, "initial": {}}
    with pytest.raises(InputError, match="nothing can move"):
        simulate(SpatialChain.model_validate(welded), [1.0], step=1e-3)
