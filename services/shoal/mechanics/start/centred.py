"""Joints with play or backlash at the start: centred where neither stated values nor other joints tell their place.

With N the directions that stated values and joints without play leave free, and J the rows that the joint would have
without play, it is told where J N = 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from shoal.mechanics.numerics.tile import Array, Index
from shoal.mechanics.start.poses import Assembly, stated
from shoal.scene import Scene
from shoal.scene.initial import POSES, RATES, Quantity
from shoal.scene.joints import is_loose, tightened

FREE = 1e-6
"""Part of a row, of its own length, above which a direction that is left free moves it."""


def centred(scene: Scene, lanes: int) -> tuple[Scene, Scene]:
    """Return a scene without play in the joints that are to start centred, of its poses, and the same of its rates."""
    names = [name for name, joint in scene.joints.items() if is_loose(joint)]
    if not names:
        return scene, scene
    assembly = Assembly(_closed(scene, names), lanes)
    poses = assembly.run().poses
    rows = assembly.closure.at(poses).rows(poses)
    slope = rows.slope[0] * np.sqrt(assembly.give)
    owner = np.array(rows.names)

    def with_told(quantities: tuple[Quantity, ...]) -> Scene:
        free = np.ones(slope.shape[1])
        for one in stated(scene, lanes, quantities):
            free[list(one.columns)] = 0.0
        return _closed(scene, _untold(names, slope, slope * free, owner))

    return with_told(POSES), with_told(RATES)


def _untold(names: Sequence[str], whole: Array, slope: Array, owner: Array) -> list[str]:
    """Return the joints whose rows some direction moves that the others leave free. owner: of every row its joint.

    whole: the rows; slope: with no entry where a value is stated
    """
    found = []
    for name in names:
        others = np.flatnonzero(~np.isin(owner, [one for one in names if one not in found]))
        mine = np.flatnonzero(owner == name)
        left = _outside(slope, others, slope[mine])
        if np.any(np.linalg.norm(left, axis=1) > FREE * np.linalg.norm(whole[mine], axis=1)):
            found.append(name)
    return found


def _outside(slope: Array, others: Index, mine: Array) -> Array:
    """Return what the span of some rows leaves of others."""
    basis = np.linalg.svd(slope[others], full_matrices=False)
    rank = int(np.sum(FREE * np.max(basis.S, initial=1e-300) < basis.S))
    return np.asarray(mine - mine @ basis.Vh[:rank].T @ basis.Vh[:rank])


def _closed(scene: Scene, names: Iterable[str]) -> Scene:
    """Return a scene in which some joints have no play."""
    return scene.model_copy(update={"joints": scene.joints | {name: tightened(scene.joints[name]) for name in names}})
