"""Accelerations of random trees: the recursion, the paper's dense equations, and MuJoCo."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from dense_equations import accelerations, equations
from scipy.spatial.transform import Rotation
from shoal.engines.tree.articulated import accelerate
from shoal.engines.tree.motion import energies
from shoal.engines.tree.tree import COORDINATES, PRISMATIC, RATES, REVOLUTE, SPHERICAL, room

MIXES = ("revolute", "prismatic", "spherical", "fixed", "mixed", "mixed-again")
every = pytest.mark.parametrize("mix", MIXES)
seeds = pytest.mark.parametrize("seed", range(5))


def _recursion(tree: Any, q: Any, v: Any) -> Any:
    out = np.zeros(len(v))
    accelerate(tree, room(tree), q, v, out)
    return out


@seeds
@every
@pytest.mark.by_day(5)
def test_recursion_equals_the_dense_equations(random_tree: Any, mixes: Any, mix: str, seed: int) -> None:
    at = random_tree(mixes[mix], seed)
    dense = accelerations(*at)
    np.testing.assert_allclose(_recursion(*at), dense, rtol=0, atol=1e-10 * np.abs(dense).max())


@seeds
@every
@pytest.mark.by_day(5)
def test_accelerations_equal_mujoco(random_tree: Any, mixes: Any, mix: str, seed: int) -> None:
    tree, q, v = random_tree(mixes[mix], seed)
    reference, kinetic, places = _mujoco(tree, q, v)
    ours = _recursion(tree, q, v)
    np.testing.assert_allclose(ours, reference, rtol=0, atol=1e-9 * np.abs(reference).max())

    work = room(tree)
    accelerate(tree, work, q, v, np.zeros(len(v)))
    assert energies(tree, work)[0] == pytest.approx(kinetic, rel=1e-11)
    np.testing.assert_allclose(work.position, places, atol=1e-12)


@every
def test_dense_equations_are_what_they_are_called(random_tree: Any, mixes: Any, mix: str) -> None:
    """H is dS/dqdot, H_dot its derivative along the motion, and qdot' (M_dot - 2 C) qdot vanishes."""
    tree, q, v = random_tree(mixes[mix], 3)
    here = equations(tree, q, v)
    np.testing.assert_allclose(here.S, here.H @ v, atol=1e-12)
    np.testing.assert_allclose(here.M, here.M.T, atol=1e-12)
    assert np.linalg.eigvalsh(here.M)[0] > 0
    h = 1e-5
    before, after = (equations(tree, _moved(tree, q, v, t), v) for t in (-h, h))
    np.testing.assert_allclose(here.H_dot @ v, (after.H - before.H) @ v / (2 * h), atol=1e-6)
    m_dot = (after.M - before.M) / (2 * h)
    assert v @ (m_dot - 2 * here.C) @ v == pytest.approx(0.0, abs=1e-5 * np.abs(v @ here.C @ v) + 1e-6)


def test_the_recursion_minimises_the_function_of_gauss(random_tree: Any, mixes: Any) -> None:
    """Any other acceleration gives a larger G = (qddot - M^-1 f)' M (qddot - M^-1 f) / 2."""
    tree, q, v = random_tree(mixes["mixed"], 0)
    e = equations(tree, q, v)
    best = _recursion(tree, q, v)

    def measure(qddot: Any) -> float:
        return float(qddot @ e.M @ qddot / 2 - qddot @ (e.F - e.C @ v))

    draw = np.random.default_rng(0)
    assert all(measure(best + draw.normal(size=len(best)) * 1e-3) > measure(best) for _ in range(20))


def test_long_chains_stay_accurate(random_tree: Any) -> None:
    """400 bodies: forces put back into the dense equations leave a residual of round-off."""
    tree, q, v = random_tree(["revolute"] * 400, 0)
    tree = tree._replace(parents=np.maximum(np.arange(401) - 1, 0))
    q, v = 0.1 * np.sin(np.arange(400)), 0.01 * np.cos(np.arange(400))
    e = equations(tree, q, v)
    residual = e.M @ _recursion(tree, q, v) - (e.F - e.C @ v)
    assert np.abs(residual).max() <= 1e-10 * np.abs(e.F).max()


def _moved(tree: Any, q: Any, v: Any, t: float) -> Any:
    """Coordinates after the time t at constant rates."""
    out = q.copy()
    for kind, first, rate in zip(tree.kinds, tree.first_q, tree.first_v, strict=True):
        at, rates = slice(first, first + COORDINATES[kind]), slice(rate, rate + RATES[kind])
        if kind == SPHERICAL:
            turned = Rotation.from_quat(q[at], scalar_first=True) * Rotation.from_rotvec(v[rates] * t)
            out[at] = turned.as_quat(scalar_first=True)
        else:
            out[at] += v[rates] * t
    return out


def _mujoco(tree: Any, q: Any, v: Any) -> tuple[Any, float, Any]:
    """Accelerations, kinetic energy and origins of the bodies, by MuJoCo; its joints may stand in another order."""
    spec = mujoco.MjSpec()
    spec.option.gravity = tree.gravity
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    bodies = [spec.worldbody]
    kinds = {
        REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE,
        PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE,
        SPHERICAL: mujoco.mjtJoint.mjJNT_BALL,
    }
    for k in range(1, len(tree.mass)):
        lever, (xx, xy, xz, yy, yz, zz) = tree.lever[k], tree.inertia[k]
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        about -= tree.mass[k] * (lever @ lever * np.eye(3) - np.outer(lever, lever))
        moments, axes = np.linalg.eigh(about)
        axes[:, 0] *= np.linalg.det(axes)
        body = bodies[tree.parents[k]].add_body(
            name=f"B{k}", pos=tree.offset[k], quat=_quaternion(tree.turn[k].reshape(3, 3)), mass=tree.mass[k],
            ipos=lever, iquat=_quaternion(axes), inertia=moments, explicitinertial=True,
        )  # fmt: skip
        if tree.kinds[k] in kinds:
            joint = body.add_joint(name=f"J{k}", type=kinds[tree.kinds[k]], axis=[0, 0, 1])
            joint.damping[0] = tree.damping[tree.first_v[k]]  # the others are of higher powers of the rate
        bodies.append(body)
    model = spec.compile()
    data = mujoco.MjData(model)
    moving = [k for k in range(1, len(tree.mass)) if tree.kinds[k] in kinds]
    for k in moving:
        first, rate, kind = tree.first_q[k], tree.first_v[k], tree.kinds[k]
        data.joint(f"J{k}").qpos[:] = q[first : first + COORDINATES[kind]]
        data.joint(f"J{k}").qvel[:] = v[rate : rate + RATES[kind]]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    for k, place, force, torque in zip(tree.load_body, tree.load_place, tree.load_force, tree.load_torque, strict=True):
        body = data.body(f"B{k}")
        at = body.xpos + body.xmat.reshape(3, 3) @ place
        mujoco.mj_applyFT(model, data, force, torque, at, model.body(f"B{k}").id, data.qfrc_applied)
    mujoco.mj_forward(model, data)
    mujoco.mj_energyVel(model, data)
    found = np.zeros(len(v))
    for k in moving:
        found[tree.first_v[k] : tree.first_v[k] + RATES[tree.kinds[k]]] = data.joint(f"J{k}").qacc
    places = [np.zeros(3), *(data.body(f"B{k}").xpos for k in range(1, len(tree.mass)))]
    return found, float(data.energy[1]), np.array(places)


def _quaternion(axes: Any) -> Any:
    return Rotation.from_matrix(axes).as_quat(scalar_first=True)
