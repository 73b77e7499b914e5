"""Bushings in space: springs and dampers of the displacement and of the turn between two bodies.

The turn from the pose of the start is a unit quaternion w, v of unknowns (`assembly.lifted`). With a_i and b_i the
axes of the bodies that point along those of the ground at the start, 4 w v is the sum of a_i x b_i along the axes a:
three constraints and w^2 + v . v = 1 define it up to half a turn, where w vanishes. Of the turn by an angle theta about
a unit vector n, v is sin(theta/2) n, and |omega|^2 is four times the sum of the squares of the rates of w and v.
"""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.lifted import Lifted, first_axis
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Bushing, Function, PointMass, Scene

PIECES = 400
LARGEST = 0.999 * np.pi
"""Pieces of the law of a turn, which is tabulated up to this angle [rad]."""
AXES = np.eye(3)


def make_turns(scene: Scene, result: SpatialPlacement) -> None:
    """Add the quaternions of bushings that resist turns. Raises InputError."""
    for name, load in scene.loads.items():
        if not isinstance(load, Bushing):
            continue
        for field, side in (("first", load.first), ("second", load.second)):
            if not is_stiff(scene, side.body) or (load.resists_turns and _is_point(scene, side.body)):
                raise InputError(f"loads.{name}.{field}: a bushing is between rigid bodies; {side.body} is none")
        if load.resists_turns:
            result.turns[name] = _turn(f"loads.{name}", load, result)


def _is_point(scene: Scene, body: str) -> bool:
    return isinstance(scene.bodies.get(body), PointMass)


def axes_of(load: Bushing, result: SpatialPlacement) -> tuple[list[Affine], list[Affine]]:
    """Return the unit vectors of both bodies that point along the axes of the ground at the start."""
    first, second = ([result.axis(side, tuple(axis)) for axis in AXES] for side in (load.first, load.second))
    return first, second


def _turn(name: str, load: Bushing, result: SpatialPlacement) -> tuple[Affine, Affine]:
    """Return the vector (w, 0, 0) and v of the turn."""
    a, b = axes_of(load, result)
    rate = sum(np.cross(result.start_of(y)[0], result.start_of(y)[1], axis=0) for y in b) / 2
    rate = rate - sum(np.cross(result.start_of(x)[0], result.start_of(x)[1], axis=0) for x in a) / 2
    w = result.new_number(1.0, 0.0)
    v = result.new_vector(np.zeros_like(rate), np.asarray(rate / 2))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        onto = w.turned(np.outer(AXES[k], first_axis(3))) * -4.0
        result.terms.sum(name, [(a[j], b[i]), (a[i] * -1.0, b[j]), (onto, v)], of_start=False)
    result.terms.sum(name, [(w, w), (v, v)], of_start=False, constant=-1.0)
    result.lifted += [Lifted(tuple(w.terms), name, turns=True, span=True), Lifted(tuple(v.terms), name, turns=True)]
    return w, v


def law_of_turn(stiffness: float) -> Function:
    """Return the force along |v| = sin(theta/2) of the potential stiffness theta^2/2, as a function of |v|."""
    angle = np.linspace(0.0, LARGEST, PIECES + 1)
    force: Array = stiffness * angle * 2.0 / np.cos(angle / 2)
    return Function(table=tuple(zip(np.sin(angle / 2).tolist(), force.tolist(), strict=True)))
