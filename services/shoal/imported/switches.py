"""What the flags of a model disable."""

from __future__ import annotations

from typing import Any


def disables(model: Any, bit: Any) -> bool:
    """Return whether a flag (mjtDisableBit) of a model of MuJoCo's is set."""
    return bool(model.opt.disableflags & int(bit))


def switch_off(mujoco: Any, model: Any) -> None:
    """Takes out of a model what its flags disable; actuators and contact pairs stay in it."""
    bits = mujoco.mjtDisableBit
    constraints = {
        bits.mjDSBL_EQUALITY: ["eq_active0"],
        bits.mjDSBL_FRICTIONLOSS: ["dof_frictionloss", "tendon_frictionloss"],
        bits.mjDSBL_LIMIT: ["jnt_limited", "tendon_limited"],
        bits.mjDSBL_CONTACT: ["geom_contype", "geom_conaffinity"],
    }
    stiff = ["jnt_stiffness", "jnt_stiffnesspoly", "tendon_stiffness", "tendon_stiffnesspoly"]
    damped = ["dof_damping", "dof_dampingpoly", "tendon_damping", "tendon_dampingpoly"]
    every = {
        bits.mjDSBL_SPRING: stiff,
        bits.mjDSBL_DAMPER: damped,
        bits.mjDSBL_CONSTRAINT: [name for names in constraints.values() for name in names],
        **constraints,
    }
    for bit, names in every.items():
        for name in names if disables(model, bit) else []:
            getattr(model, name)[:] = 0
    if disables(model, bits.mjDSBL_GRAVITY):
        model.opt.gravity[:] = 0
