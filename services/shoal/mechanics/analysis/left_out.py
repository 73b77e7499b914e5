"""Effects that static equilibrium neglects: dry friction, in which the machine may stick, and moving drives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.joint_reactions import Reactions
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Revolute, Scene, Slider

STILL = 1e-9
"""Rates below this [m/s or rad/s] are none."""


def friction(scene: Scene, react: Callable[[], Reactions] | None) -> str:
    """Return which joints have dry friction, and the error of each reaction [N or N m]; empty where none has.

    react: returns the reactions, if they are known.
    """
    dry = {name: one for name, one in scene.joints.items() if isinstance(one, Revolute | Slider) and one.dry}
    if not dry:
        return ""
    told, reactions = [], None if react is None else react()
    for name, joint in dry.items():
        pressed = 0.0 if reactions is None else float(np.linalg.norm(reactions.joints[name].force))
        size = joint.coulomb + joint.share * pressed
        unit = "N" if isinstance(joint, Slider) else "N m"
        told.append(name if reactions is None else f"{name}: {size:.3g} {unit}")
    return f"dry friction is left out ({', '.join(told)}): it may stick at other places, too"


def driving(evaluator: Evaluator, q: Array, t: float) -> list[str]:
    """Names of joints and ground points whose drives move at time t [s]."""
    rates = zip(evaluator.model.constraint_names, evaluator.at(q, t=t).rate, strict=False)
    return list(dict.fromkeys(name for name, rate in rates if abs(rate) > STILL))


def driven(evaluator: Evaluator, q: Array, t: float) -> str:
    """Return a remark on drives that move at time t [s]; empty where none does."""
    names = driving(evaluator, q, t)
    return f"the motion of {', '.join(names)} at t = {t:g} s is left out" if names else ""
