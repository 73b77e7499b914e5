"""Constraints by differences, and Gauss's principle against a dense solution by numpy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shoal.mechanics.assembly.build import build
from shoal.mechanics.dynamics import work_space
from shoal.mechanics.kernels import ready
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import SINGLE, WIDE
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene

ROD = {"kind": "rod", "height": 0.02, "width": 0.05, "density": 1000.0}
ONE = slice(0, 1)
TOLERANCE = 1e-9


def _joint(first: Any, second: Any, **other: Any) -> dict[str, Any]:
    sides = {name: {"body": body, "point": point} for name, (body, point) in {"first": first, "second": second}.items()}
    return sides | other


# A crank, a coupler with a third joint off its axis, two rockers: unit vectors of all kinds and a closure.
LOOP = Scene.parse(
    {
        "name": "loop",
        "bodies": {
            "crank": ROD | {"length": 1.0},
            "coupler": ROD | {"length": 2.0},
            "rocker": ROD | {"length": 1.5},
            "third": ROD | {"length": 1.2},
            "load": {"kind": "rigid-body", "mass": 2.0, "inertia": 0.3, "centre_of_mass": [0.4, 0.1]},
        },
        "joints": {
            "O": _joint(("ground", [0.0, 0.0]), ("crank", "start"), friction=0.2),
            "A": _joint(("crank", "end"), ("coupler", "start"), friction=0.1),
            "B": _joint(("coupler", "end"), ("rocker", "end")),
            "C": _joint(("ground", [2.0, 0.0]), ("rocker", "start")),
            "D": _joint(("coupler", [0.7, 0.3]), ("third", "start")),
            "E": _joint(("third", "end"), ("load", "start"), friction=0.3),
        },
        "markers": {"A": {"body": "crank", "point": "end"}, "L": {"body": "load"}},
        "initial": {
            "crank": {"angle": 1.2, "rate": 1.0},
            "coupler": {"angle": 0.2, "guess": ["angle"]},
            "third": {"angle": -1.0},
        },
    }
)
PENDULUM = load_scene("rigid-double-pendulum").with_values(
    {"joints.O.friction": 0.4, "joints.A.friction": 0.3, "initial.OA.rate": 1.0, "initial.AB.rate": -2.0}
)
MIXED = LOOP.with_values(
    {"bodies.coupler.element": "rigid", "bodies.third.youngs_modulus": 2e8, "bodies.third.element": "ancf-cable"}
)
scenes = pytest.mark.parametrize("scene", [PENDULUM, LOOP, MIXED], ids=["pendulum", "loop", "loop-with-cable"])


def _random_state(model: Model, seed: int) -> tuple[Any, Any]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=model.unknowns), rng.normal(size=model.unknowns)


def _room(model: Model, q: Any, v: Any) -> tuple[Any, Any]:
    arrays = model.tile(SINGLE, ONE)
    room = work_space(SINGLE, arrays)
    room.z[: model.unknowns], room.zdot[: model.unknowns] = q, v
    return ready(SINGLE, arrays, room), room


def _rows(model: Model, q: Any, *, moving: bool = False) -> Any:
    """A state with its derived rows."""
    d = model.derived
    rows = [
        (0.0 if moving else d.constant[r, 0])
        + sum(d.coefficient[t, 0] * q[d.source[t]] for t in range(d.start[r], d.start[r + 1]))
        for r in range(len(d.start) - 1)
    ]
    return np.concatenate([q, rows])


def _residual(kernels: Any, model: Model, q: Any) -> Any:
    out = np.full(model.constraints.size, np.nan)
    arrays = model.tile(SINGLE, ONE)
    kernels.residual(SINGLE, arrays.constraints, arrays.functions, 0.0, _rows(model, q), out)
    return out


def _jacobian(kernels: Any, model: Model, q: Any) -> Any:
    c = model.tile(SINGLE, ONE).constraints
    out = np.full(len(c.column), np.nan)
    kernels.jacobian(SINGLE, c, _rows(model, q), 1.0, out)
    rows = np.zeros((c.size, model.unknowns))
    rows[np.repeat(np.arange(c.size), np.diff(c.entry)), c.column] = out
    return rows


def _bias(kernels: Any, model: Model, v: Any) -> Any:
    out = np.full(model.constraints.size, np.nan)
    arrays = model.tile(SINGLE, ONE)
    kernels.bias(SINGLE, arrays.constraints, arrays.functions, 0.0, _rows(model, v, moving=True), out)
    return out


def _acceleration(kernels: Any, model: Model, q: Any, v: Any, tolerance: float = TOLERANCE) -> Any:
    arrays, room = _room(model, q, v)
    kernels.acceleration(SINGLE, arrays, room, tolerance)
    return room.a[: model.unknowns].copy()


def _mass(model: Model) -> Any:
    mass = np.zeros((model.unknowns, model.unknowns))
    for (i, j), value in model.mass_entries.items():
        mass[i, j] = mass[j, i] = np.ravel(value)[0]
    return mass


@scenes
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.by_day(1)
def test_jacobian_and_bias_are_the_derivatives_of_the_constraints(kernels: Any, scene: Scene, seed: int) -> None:
    # Constraints are quadratic, so central differences are exact but for round-off.
    model = build(scene)
    q, v = _random_state(model, seed)
    h = 1e-3
    columns = [
        (_residual(kernels, model, q + h * unit) - _residual(kernels, model, q - h * unit)) / (2 * h)
        for unit in np.eye(model.unknowns)
    ]
    np.testing.assert_allclose(_jacobian(kernels, model, q), np.transpose(columns), atol=1e-10)
    second = (
        _residual(kernels, model, q + h * v) - 2 * _residual(kernels, model, q) + _residual(kernels, model, q - h * v)
    ) / h**2
    np.testing.assert_allclose(_bias(kernels, model, v), second, atol=1e-7)


@scenes
@pytest.mark.parametrize("seed", range(5))
def test_acceleration_is_the_constrained_minimiser(kernels: Any, scene: Scene, seed: int) -> None:
    """Paper, eq. 16, as one dense linear system: M a + C_q' lambda = Q, C_q a = -eta."""
    model = build(scene)
    q, v = _random_state(model, seed)
    arrays, room = _room(model, q, v)
    kernels.force(SINGLE, arrays, room)
    load = room.a[: model.unknowns].copy()
    rows, mass = _jacobian(kernels, model, q), _mass(model)
    count = len(rows)
    system = np.block([[mass, rows.T], [rows, np.zeros((count, count))]])
    expected = np.linalg.solve(system, np.concatenate([load, -_bias(kernels, model, v)]))[: model.unknowns]
    found = _acceleration(kernels, model, q, v)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())
    # The Gaussian constraint does not fall in any direction that the constraints allow.
    allowed = np.linalg.svd(rows)[2][count:]
    slope = allowed @ (mass @ found - load)
    assert np.abs(slope).max() < 1e-7 * np.abs(load).max()


def _repeated(model: Model, which: list[int]) -> Model:
    """The model with constraints added once more."""
    c = model.constraints
    order = [*range(c.size), *which]

    def again(starts: Any, *lists: Any) -> tuple[Any, ...]:
        spans = [slice(starts[k], starts[k + 1]) for k in order]
        ends = np.cumsum([0, *(span.stop - span.start for span in spans)])
        return ends, *(np.concatenate([part[span] for span in spans]) for part in lists)

    start, left, right, factor = again(c.start, c.left, c.right, c.factor)
    entry, column = again(c.entry, c.column)
    turned, rising, share = again(c.turned, c.rising, c.share)
    by_constraint = ("constant", "lengths", "open", "drive", "way", "period")
    parts = [
        (entry[n] + target - c.entry[k], source, coefficient)
        for n, k in enumerate(order)
        for target, source, coefficient in zip(c.target, c.source, c.coefficient, strict=True)
        if c.entry[k] <= target < c.entry[k + 1]
    ]
    return replace(
        model,
        constraints=c._replace(
            size=len(order),
            start=start,
            left=left,
            right=right,
            factor=factor,
            **{name: getattr(c, name)[order] for name in by_constraint},
            turned=turned,
            rising=rising,
            share=share,
            entry=entry,
            column=column,
            parts=len(parts),
            target=np.array([target for target, _, _ in parts]),
            source=np.array([source for _, source, _ in parts]),
            coefficient=np.array([coefficient for _, _, coefficient in parts]),
        ),
        constraint_names=tuple(model.constraint_names) + tuple(f"again {k}" for k in which),
        shared_tiles={},
    )


@scenes
def test_a_constraint_stated_twice_changes_nothing(kernels: Any, scene: Scene) -> None:
    model = build(scene)
    twice = _repeated(model, [0, model.constraints.size - 1, 0])
    for seed in range(3):
        q, v = _random_state(model, seed)
        once = _acceleration(kernels, model, q, v)
        np.testing.assert_allclose(_acceleration(kernels, twice, q, v), once, atol=1e-9 * np.abs(once).max())


@scenes
def test_projection_makes_a_disturbed_state_consistent(kernels: Any, scene: Scene) -> None:
    model = build(scene)
    rng = np.random.default_rng(0)
    arrays, room = _room(model, model.q0[:, 0], model.v0[:, 0])
    for _ in range(2):  # the loop is assembled from some centimetres apart
        kernels.project(SINGLE, arrays, room, TOLERANCE)
    q, v = room.z[: model.unknowns].copy(), room.zdot[: model.unknowns].copy()
    assert np.abs(_residual(kernels, model, q)).max() < 1e-13
    assert np.abs(_jacobian(kernels, model, q) @ v).max() < 1e-12
    room.z[: model.unknowns] += 1e-4 * rng.normal(size=model.unknowns)
    room.zdot[: model.unknowns] += 1e-3 * rng.normal(size=model.unknowns)
    pushed = room.z[: model.unknowns].copy()
    kernels.project(SINGLE, arrays, room, TOLERANCE)
    found, rates = room.z[: model.unknowns], room.zdot[: model.unknowns]
    rows = _jacobian(kernels, model, found)
    assert np.abs(_residual(kernels, model, found)).max() < 1e-13
    assert np.abs(rows @ rates).max() < 1e-12
    # The smallest change in the mass metric is orthogonal to every allowed motion.
    allowed = np.linalg.svd(rows)[2][len(rows) :]
    change = _mass(model) @ (found - pushed)
    assert np.abs(allowed @ change).max() < 1e-3 * np.abs(change).max()


@scenes
def test_lanes_equal_singles(kernels: Any, scene: Scene) -> None:
    model = build(scene)
    width = len(WIDE)
    arrays = model.tile(WIDE, ONE)
    room = work_space(WIDE, arrays)
    arrays = ready(WIDE, arrays, room)
    states = [_random_state(model, seed) for seed in range(width)]
    for lane, (q, v) in enumerate(states):
        room.z.reshape(-1, width)[: model.unknowns, lane] = q
        room.zdot.reshape(-1, width)[: model.unknowns, lane] = v
    kernels.acceleration(WIDE, arrays, room, TOLERANCE)
    for lane, (q, v) in enumerate(states):
        single = _acceleration(kernels, model, q, v)
        together = room.a.reshape(-1, width)[: model.unknowns, lane]
        np.testing.assert_allclose(together, single, atol=1e-9 * np.abs(single).max())


def test_joints_between_open_chains_need_no_constraints() -> None:
    assert build(load_scene("flexible-double-pendulum")).constraints.size == 0
    assert build(load_scene("rigid-double-pendulum")).constraint_names == ("OA", "AB")


def _three_cranks(count: int) -> Scene:
    """A horizontal coupler carried by that many equal vertical cranks: from three on a redundant joint."""
    cranks = {f"crank{k}": ROD | {"length": 1.0} for k in range(count)}
    joints = {}
    for k in range(count):
        joints[f"O{k}"] = _joint(("ground", [0.75 * k, 0.0]), (f"crank{k}", "start"))
        joints[f"A{k}"] = _joint(("coupler", [0.75 * k, 0.0]), (f"crank{k}", "end"))
    return Scene.parse(
        {
            "name": "cranks",
            "bodies": {**cranks, "coupler": ROD | {"length": 1.5}},
            "joints": joints,
            "markers": {"A": {"body": "crank0", "point": "end"}},
            "initial": {f"crank{k}": {"angle": -0.6, "rate": -0.5} for k in range(count)},
            "solver": {"duration": 1.0, "step": 1e-3, "integrator": "rk4"},
        }
    )


@pytest.mark.parametrize("count", [2, 3])
def test_a_parallelogram_swings_as_the_pendulum_it_is(uniform_rods: Any, count: int) -> None:
    """The coupler translates, so cranks (m l^2 / 3 each) and coupler (M l^2) are one pendulum; away from flat."""
    scene = _three_cranks(count)
    times = np.linspace(0, 1, 21)[1:]
    crank, coupler = scene.bodies["crank0"].mass, scene.bodies["coupler"].mass
    angle, _ = uniform_rods([count * crank, coupler], [count * crank / 12], [[0.5], [1.0]], [-0.6], [-0.5], times)
    run = simulate(scene, times)
    assert run.ok, run.message
    np.testing.assert_allclose(run.angle("A"), angle[0], atol=1e-9)
    assert run.constraint_drift[0] < 1e-12
    assert run.energy_drift[0] < 1e-9
