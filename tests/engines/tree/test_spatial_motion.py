"""Motion of spatial trees: order, energy, closed forms, and what is not believed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from shoal.engines import get_engine
from shoal.engines.tree.tableau import DOPRI853, RK4
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.trajectory import Status, Trajectory

GROUND = {"body": "ground", "point": [0.0, 0.0, 0.0]}
TOP: dict[str, Any] = {
    "bodies": {"T": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.2, 0.3, 0.4],
                     "named_points": {"tip": [0, 0, 1], "side": [1, 0, 0]}}},
    "joints": {"O": {"kind": "spherical", "first": GROUND, "second": {"body": "T"}}},
    "initial": {"T": {"rotation": [0.3, 0, 0], "spin": [0.1, 6.0, 0.2]}},
}  # fmt: skip


def run(times: Any, *, step: float | None = None, tolerance: float = 1e-12, **parts: Any) -> Trajectory:
    """The motion of a scene in space, with a marker at every named point."""
    solver = {"integrator": "rk4", "step": step} if step else {"integrator": "dop853", "relative_tolerance": tolerance}
    markers = {f"{body}-{name}": {"body": body, "point": name}
               for body, one in parts["bodies"].items() for name in one["named_points"]}  # fmt: skip
    scene = {"name": "test", "dimensions": 3, "gravity": [0, 0, -9.81], "markers": markers, **parts}
    return get_engine("tree").simulate(Scene.parse(scene | {"solver": solver}), times)


@pytest.mark.parametrize("mix", ["revolute", "spherical", "mixed"])
def test_convergence_slope_of_the_fixed_step(random_tree: Any, mixes: Any, mix: str) -> None:
    tree = random_tree(mixes[mix][:6], 1)
    exact = tree.run([0.5], tolerance=1e-13).position
    errors = [np.abs(tree.run([0.5], step=h).position - exact).max() for h in (1e-2, 5e-3)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.25)


@pytest.mark.parametrize("mix", ["revolute", "prismatic", "spherical", "fixed", "mixed"])
def test_energy_balance_with_loads_and_dampers(random_tree: Any, mixes: Any, mix: str) -> None:
    record = random_tree(mixes[mix][:6], 2).run(np.linspace(0.05, 0.5, 10), tolerance=1e-11)
    assert np.abs(record.states[:, -1]).max() > 0.1
    balance = record.energy.sum(axis=1) - record.states[:, -1]
    np.testing.assert_allclose(balance, balance[0], atol=1e-8 * record.energy[:, 0].max())


def test_energy_is_conserved_without_losses(random_tree: Any, mixes: Any) -> None:
    made = random_tree(mixes["mixed"][:6], 4)
    tree = made.tree._replace(damping=0.0 * made.tree.damping, load_body=made.tree.load_body[:0])
    record = made._replace(tree=tree).run(np.linspace(0.0, 2.0, 5), step=1e-3)
    np.testing.assert_array_equal(record.states[:, -1], 0.0)
    total = record.energy.sum(axis=1)
    np.testing.assert_allclose(total, total[0], atol=1e-7 * record.energy[:, 0].max())


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0.7, -1.1, 0.4]])
def test_in_a_plane_it_is_the_double_pendulum(uniform_rods: Any, turn: list[float]) -> None:
    """Rods of 1 m and 0.8 m in the plane that `turn` makes of x and y, gravity along -y."""
    plane, times = Rotation.from_rotvec(turn), np.linspace(0.2, 2.0, 10)
    axis = plane.apply([0.0, 0.0, 1.0])
    rods = {"A": (1.0, 2.0, 0.5, 0.0), "B": (0.8, 1.5, -0.3, 1.0)}
    found = run(
        times,
        tolerance=1e-13,
        gravity=plane.apply([0.0, -9.81, 0.0]).tolist(),
        bodies={
            name: {"kind": "rigid-body", "mass": mass, "centre_of_mass": [length / 2, 0, 0],
                   "inertia": [1e-3, mass * length**2 / 12, mass * length**2 / 12 + 5e-4],
                   "named_points": {"end": [length, 0, 0]}}
            for name, (length, mass, _, _) in rods.items()
        },
        joints={
            "O": {"kind": "revolute", "first": GROUND, "second": {"body": "A"}, "axis": (2 * axis).tolist()},
            "P": {"kind": "revolute", "first": {"body": "A", "point": "end"}, "second": {"body": "B"},
                  "axis": axis.tolist()},
        },
        initial={
            name: {"rotation": (plane * Rotation.from_rotvec([0, 0, angle])).as_rotvec().tolist(),
                   "spin": (rate * axis).tolist()}
            for name, (_, _, angle, rate) in rods.items()
        },
    )  # fmt: skip
    assert found.ok, found.message
    inertias = [2.0 / 12 + 5e-4, 1.5 * 0.64 / 12 + 5e-4]
    angles, _ = uniform_rods([2.0, 1.5], inertias, [[0.5, 0.0], [1.0, 0.4]], [0.5, -0.3], [0.0, 1.0], times)
    tip = np.exp(1j * angles[0]) + 0.8 * np.exp(1j * angles[1])
    flat = np.stack([tip.real, tip.imag, np.zeros(10)], axis=1)
    np.testing.assert_allclose(found.marker("B-end"), plane.apply(flat), atol=1e-9)


def test_a_free_top_obeys_euler() -> None:
    """J omega' = -omega x J omega; the middle axis tumbles."""
    times = np.linspace(0.5, 10.0, 20)
    found = run(times, **TOP)
    assert found.ok, found.message
    moments, start = np.array([0.2, 0.3, 0.4]), Rotation.from_rotvec([0.3, 0.0, 0.0])

    def rate(_: float, state: Any) -> Any:
        w, (x, y, z, s) = state[:3], state[3:]
        turning = 0.5 * np.array([s * w[0] + y * w[2] - z * w[1], s * w[1] + z * w[0] - x * w[2],
                                  s * w[2] + x * w[1] - y * w[0], -x * w[0] - y * w[1] - z * w[2]])  # fmt: skip
        return np.concatenate([-np.cross(w, moments * w) / moments, turning])

    begin = np.concatenate([start.inv().apply([0.1, 6.0, 0.2]), start.as_quat()])
    euler = solve_ivp(rate, (0, 10), begin, "DOP853", times, rtol=1e-13, atol=1e-13)
    turns = Rotation.from_quat(euler.y[3:].T)
    np.testing.assert_allclose(found.marker("T-tip"), turns.apply([0, 0, 1]), atol=1e-8)
    np.testing.assert_allclose(found.marker("T-side"), turns.apply([1, 0, 0]), atol=1e-8)


@pytest.mark.parametrize("how", [{"step": 5e-3}, {"tolerance": 1e-12}])
def test_quaternions_stay_units(random_tree: Any, how: Any) -> None:
    made = random_tree(["spherical"], 5)
    assert np.linalg.norm(made.run([5.0], **how).states[0, :4]) == pytest.approx(1.0, abs=1e-14)


def test_a_slider_falls() -> None:
    body = {"kind": "rigid-body", "mass": 2.0, "inertia": [1, 1, 1], "named_points": {"o": [0, 0, 0]}}
    slider = {"kind": "slider", "first": GROUND, "second": {"body": "S"}, "axis": [0, 0, -3], "rotation": "locked",
              "friction": 2.0}  # fmt: skip
    push = {"kind": "force", "at": {"body": "S"}, "force": [0.0, 0.0, -1.0]}
    found = run([0.0, 1.0, 2.0], bodies={"S": body}, joints={"O": slider}, loads={"F": push})
    pull = 9.81 + 0.5
    speed = pull * (1 - np.exp(-found.times))
    np.testing.assert_allclose(found.marker("S-o")[:, 2], -(pull * found.times - speed), atol=1e-10)


def test_a_welded_body_moves_as_one_with_its_parent() -> None:
    """Two halves, welded, are the whole."""
    tips = {"end": [1.0, 0, 0], "quarter": [0.75, 0, 0]}
    whole = {"kind": "rigid-body", "mass": 2.0, "inertia": [0.02, 0.2, 0.2], "centre_of_mass": [0.5, 0, 0],
             "named_points": tips}  # fmt: skip
    half = {"mass": 1.0, "inertia": [0.01, 0.1 - 0.25**2, 0.1 - 0.25**2]}
    hinge = {"kind": "revolute", "first": GROUND, "second": {"body": "A"}, "axis": [0, 1, 0]}
    # In the order of the scene the weld comes first; the tree is sorted.
    weld = {"kind": "weld", "first": {"body": "A", "point": "quarter"}, "second": {"body": "B"}}
    halves = {"A": whole | half | {"centre_of_mass": [0.25, 0, 0]},
              "B": {"kind": "rigid-body", **half, "named_points": {}}}  # fmt: skip
    one = run([0.5, 1.0], step=1e-3, bodies={"A": whole}, joints={"O": hinge})
    two = run([0.5, 1.0], step=1e-3, bodies=halves, joints={"W": weld, "O": hinge})
    np.testing.assert_allclose(two.marker("A-end"), one.marker("A-end"), atol=1e-12)


def test_controlled_steps_follow_the_tolerance(random_tree: Any) -> None:
    made = random_tree(["spherical", "revolute"], 7)
    exact = made.run([2.0], tolerance=1e-13).position
    runs = [made.run([2.0], tolerance=10.0**-digits) for digits in (5, 8, 11)]
    errors = [np.abs(found.position - exact).max() for found in runs]
    assert errors[0] > errors[1] > errors[2]
    assert all(error < 100 * 10.0**-digits for error, digits in zip(errors, (5, 8, 11), strict=True))
    assert runs[0].facts[2] < runs[1].facts[2] < runs[2].facts[2]


def test_sampling_does_not_change_the_motion(random_tree: Any, mixes: Any) -> None:
    tree = random_tree(mixes["mixed"][:6], 6)
    few, many = tree.run([0.5], step=1e-3), tree.run(np.linspace(0.0, 0.5, 51), step=1e-3)
    assert few.facts[2] == many.facts[2] == 500
    np.testing.assert_allclose(many.position[-1], few.position[0], atol=1e-12)


@pytest.mark.parametrize(("method", "order"), [(RK4, 4), (DOPRI853, 8)])
def test_tableaus_are_consistent(method: Any, order: int) -> None:
    """Row sums, and sum b c^k = 1 / (k + 1) up to the order."""
    c = method.a.sum(axis=1)
    assert method.order == order
    for power in range(order):
        assert method.b @ c**power == pytest.approx(1 / (power + 1), abs=1e-14)
    assert not np.any(np.triu(method.a))


def test_too_long_steps_are_not_believed() -> None:
    spun = TOP | {"initial": {"T": {"spin": [150.0, 240.0, 3.0]}}}
    assert run([1.0], step=1e-2, **spun).status == (Status.ENERGY,)
    fast = TOP | {"initial": {"T": {"spin": [1e200, 1e200, 0.0]}}}
    found = run([1.0], step=1e-2, **fast)
    assert found.status == (Status.DIVERGED,)
    assert found.message
    assert not run([1.0], tolerance=1e-6, **fast).ok


def test_standing_still_is_believed() -> None:
    found = run([1.0], step=1e-2, **TOP | {"initial": {}, "gravity": [0, 0, 1.0]})
    assert found.ok, found.message


def test_a_step_that_would_take_forever_is_refused() -> None:
    with pytest.raises(InputError, match="use a longer one"):
        run([1.0], step=1e-12, **TOP)


def test_nothing_that_moves_is_refused() -> None:
    welded = TOP | {"joints": {"O": TOP["joints"]["O"] | {"kind": "weld"}}, "initial": {}}
    with pytest.raises(InputError, match="nothing can move"):
        run([1.0], step=1e-3, **welded)
