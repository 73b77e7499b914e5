"""Accelerations of random trees: the recursion, the paper's dense equations, and MuJoCo."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from shoal.engines.tree.articulated import accelerate
from shoal.engines.tree.description import JointFrame, SpatialChain
from shoal.engines.tree.motion import energies
from shoal.engines.tree.recursive import accelerations, equations
from shoal.engines.tree.tree import build, room

MIXES = ("revolute", "prismatic", "spherical", "fixed", "mixed", "mixed-again")
every = pytest.mark.parametrize("mix", MIXES)
seeds = pytest.mark.parametrize("seed", range(5))


def _recursion(chain: SpatialChain) -> Any:
    model = build(chain)
    out = np.zeros(len(model.v0))
    accelerate(model.tree, room(model.tree), model.q0, model.v0, out)
    return out


@seeds
@every
def test_recursion_equals_the_dense_equations(random_tree: Any, mixes: Any, mix: str, seed: int) -> None:
    chain = random_tree(mixes[mix], seed)
    model = build(chain)
    dense = accelerations(model.tree, model.q0, model.v0)
    np.testing.assert_allclose(_recursion(chain), dense, rtol=0, atol=1e-10 * np.abs(dense).max())


@seeds
@every
def test_accelerations_equal_mujoco(random_tree: Any, mixes: Any, mix: str, seed: int) -> None:
    chain = random_tree(mixes[mix], seed)
    reference, kinetic, points = _mujoco(chain)
    ours = _recursion(chain)
    np.testing.assert_allclose(ours, reference, rtol=0, atol=1e-9 * np.abs(reference).max())

    model = build(chain)
    work = room(model.tree)
    accelerate(model.tree, work, model.q0, model.v0, np.zeros(len(model.v0)))
    assert energies(model.tree, work)[0] == pytest.approx(kinetic, rel=1e-11)
    rotation = work.rotation[model.point_bodies].reshape(-1, 3, 3)
    place = work.position[model.point_bodies] + np.einsum("nij,nj->ni", rotation, model.point_places)
    np.testing.assert_allclose(place, points, atol=1e-12)


@every
def test_dense_equations_are_what_they_are_called(random_tree: Any, mixes: Any, mix: str) -> None:
    """H is dS/dqdot, H_dot its derivative along the motion, and qdot' (M_dot - 2 C) qdot vanishes."""
    model = build(random_tree(mixes[mix], 3))
    q, v = model.q0, model.v0
    here = equations(model.tree, q, v)
    np.testing.assert_allclose(here.S, here.H @ v, atol=1e-12)
    np.testing.assert_allclose(here.M, here.M.T, atol=1e-12)
    assert np.linalg.eigvalsh(here.M)[0] > 0
    h = 1e-5
    before, after = (equations(model.tree, _moved(model, q, v, t), v) for t in (-h, h))
    np.testing.assert_allclose(here.H_dot @ v, (after.H - before.H) @ v / (2 * h), atol=1e-6)
    m_dot = (after.M - before.M) / (2 * h)
    assert v @ (m_dot - 2 * here.C) @ v == pytest.approx(0.0, abs=1e-5 * np.abs(v @ here.C @ v) + 1e-6)


def test_the_recursion_minimises_the_function_of_gauss(random_tree: Any, mixes: Any) -> None:
    """Any other acceleration gives a larger G = (qddot - M^-1 f)' M (qddot - M^-1 f) / 2."""
    model = build(random_tree(mixes["mixed"], 0))
    e = equations(model.tree, model.q0, model.v0)
    best = _recursion(random_tree(mixes["mixed"], 0))

    def measure(qddot: Any) -> float:
        return float(qddot @ e.M @ qddot / 2 - qddot @ (e.F - e.C @ model.v0))

    draw = np.random.default_rng(0)
    assert all(measure(best + draw.normal(size=len(best)) * 1e-3) > measure(best) for _ in range(20))


def test_long_chains_stay_accurate() -> None:
    """400 bodies: forces put back into the dense equations leave a residual of round-off."""
    chain = SpatialChain.model_validate(
        {
            "name": "long",
            "bodies": {
                f"B{k}": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "centre_of_mass": [0.5, 0, 0]} for k in range(400)
            },
            "joints": {
                f"J{k}": {
                    "body": f"B{k}",
                    "parent": f"B{k - 1}" if k else "ground",
                    "axis": [k % 2, 1, k % 3],
                    "on_parent": {"position": [1, 0, 0] if k else [0, 0, 0]},
                }
                for k in range(400)
            },
            "initial": {f"J{k}": {"coordinate": 0.1 * np.sin(k), "rate": 0.01 * np.cos(k)} for k in range(400)},
        }
    )
    model = build(chain)
    e = equations(model.tree, model.q0, model.v0)
    qddot = _recursion(chain)
    residual = e.M @ qddot - (e.F - e.C @ model.v0)
    assert np.abs(residual).max() <= 1e-10 * np.abs(e.F).max()


def _moved(model: Any, q: Any, v: Any, t: float) -> Any:
    """Coordinates after the time t at constant rates."""
    out = q.copy()
    for joint in model.joints:
        at, rates = model.coordinates(joint), model.rates(joint)
        if at.stop - at.start == 4:
            turned = Rotation.from_quat(q[at], scalar_first=True) * Rotation.from_rotvec(v[rates] * t)
            out[at] = turned.as_quat(scalar_first=True)
        else:
            out[at] += v[rates] * t
    return out


def _mujoco(chain: SpatialChain) -> tuple[Any, float, Any]:
    """Accelerations in the order and axes of ours, kinetic energy and named points, by MuJoCo."""
    model = mujoco.MjModel.from_xml_string(_mjcf(chain))
    data = mujoco.MjData(model)
    ours = build(chain)
    names = [name for name in ours.joints if chain.joints[name].kind != "fixed"]
    for name in names:
        joint, state = chain.joints[name], chain.initial[name]
        q, v = data.joint(name).qpos, data.joint(name).qvel
        if joint.kind == "spherical":
            # MuJoCo measures ball joints in the axes of the body.
            axes = _rotation(joint.on_body)
            q[:] = Rotation.from_rotvec(axes.apply(state.coordinate)).as_quat(scalar_first=True)
            v[:] = axes.apply(state.rate)
            data.joint(name).qfrc_applied[:] = axes.apply(joint.load)
        else:
            q[:], v[:], data.joint(name).qfrc_applied[:] = state.coordinate, state.rate, joint.load
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    for load in chain.loads.values():
        body = data.body(load.body)
        place = body.xpos + body.xmat.reshape(3, 3) @ load.position
        mujoco.mj_applyFT(
            model, data, np.array(load.force), np.array(load.torque), place, model.body(load.body).id, data.qfrc_applied
        )
    mujoco.mj_forward(model, data)
    mujoco.mj_energyVel(model, data)
    qddot = np.zeros(len(ours.v0))
    for name in names:
        acceleration = data.joint(name).qacc
        if chain.joints[name].kind == "spherical":
            acceleration = _rotation(chain.joints[name].on_body).inv().apply(acceleration)
        qddot[ours.rates(name)] = acceleration
    return qddot, float(data.energy[1]), np.array([data.site(name).xpos for name in chain.points])


def _mjcf(chain: SpatialChain) -> str:
    children: dict[str, list[str]] = {}
    for name, joint in chain.joints.items():
        children.setdefault(joint.parent, []).append(name)

    def element(name: str) -> str:
        joint = chain.joints[name]
        body = chain.bodies[joint.body]
        turn = _rotation(joint.on_parent) * _rotation(joint.on_body).inv()
        place = np.array(joint.on_parent.position) - turn.apply(joint.on_body.position)
        kinds = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball"}
        axis = f'axis="{_text(_rotation(joint.on_body).apply(joint.axis))}"' if joint.axis else ""
        moves = (
            f'<joint name="{name}" type="{kinds[joint.kind]}" pos="{_text(joint.on_body.position)}" {axis} '
            f'damping="{joint.damping!r}"/>'
            if joint.kind in kinds
            else ""
        )
        moments, principal = np.linalg.eigh(np.array(body.inertia))
        principal[:, 0] *= np.linalg.det(principal)
        quaternion = Rotation.from_matrix(principal).as_quat(scalar_first=True)
        points = (
            f'<site name="{point}" pos="{_text(at.position)}"/>'
            for point, at in chain.points.items()
            if at.body == joint.body
        )
        return (
            f'<body name="{joint.body}" pos="{_text(place)}" quat="{_text(turn.as_quat(scalar_first=True))}">{moves}'
            f'<inertial pos="{_text(body.centre_of_mass)}" quat="{_text(quaternion)}" mass="{body.mass!r}" '
            f'diaginertia="{_text(moments)}"/>{"".join(points)}'
            f"{''.join(map(element, children.get(joint.body, [])))}</body>"
        )

    return (
        f'<mujoco><compiler angle="radian"/><option gravity="{_text(chain.gravity)}">'
        '<flag contact="disable" constraint="disable"/></option>'
        f"<worldbody>{''.join(map(element, children['ground']))}</worldbody></mujoco>"
    )


def _rotation(placement: JointFrame) -> Rotation:
    return Rotation.from_rotvec(placement.rotation)


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in numbers)


@given(st.floats(1e-150, 1e150), st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: max(map(abs, a)) > 1e-3))
def test_the_length_of_an_axis_means_nothing(length: float, direction: Any) -> None:
    body = {"mass": 1.0, "inertia": [[1, 0.1, 0], [0.1, 1, 0], [0, 0, 1.5]], "centre_of_mass": [1.0, 0.2, 0.3]}

    def chain(axis: list[float]) -> SpatialChain:
        hinge = {"body": "B", "axis": axis}
        return SpatialChain.model_validate({"name": "hinge", "bodies": {"B": body}, "joints": {"P": hinge}})

    here, there = _recursion(chain([length * a for a in direction])), _recursion(chain(list(direction)))
    np.testing.assert_allclose(here, there, atol=1e-9)
