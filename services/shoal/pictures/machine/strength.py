"""Loads as functions of time, for arrows as large as they are."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.scene import Scene
from shoal.scene.formula import OPERATIONS, Node
from shoal.scene.function import Function, SignalFunction
from shoal.scene.loads import Force, Torque
from shoal.scene.signals import Constant, Table, written_out
from shoal.trajectory import Array


def strength(scene: Scene, function: SignalFunction, times: Array) -> Array | None:
    """Return a load's function at some times; None of one that follows the motion, which times do not define."""
    if function.expression is None:
        return np.asarray(function(times), dtype=float)
    with np.errstate(all="ignore"):
        found = _value(scene, written_out(scene, function), times)
    return None if found is None else np.array(np.broadcast_to(np.nan_to_num(found), times.shape))


def _value(scene: Scene, node: Node, times: Array) -> Any:
    """Return a tree that is written out at some times; None where it depends on the motion."""
    if isinstance(node, tuple):
        arguments = [_value(scene, argument, times) for argument in node[1:]]
        return None if any(one is None for one in arguments) else OPERATIONS[node[0]](*arguments)
    if isinstance(node, Constant | Table):
        signal = scene.signals[node.name]
        return signal(times) if isinstance(signal, Function) else None
    if isinstance(node, float):
        return node
    return times if node == "t" else None


def largest(scene: Scene) -> dict[str, float]:
    """Return the largest value of each force and torque over that of the largest of its kind, by name.

    Loads that follow the motion count as they are stated, with a factor of one.
    """
    found: dict[str, float] = {}
    times = np.linspace(0.0, scene.solver.duration, 201)
    for kind in (Force, Torque):
        sizes = {name: _size(scene, load, times) for name, load in scene.loads.items() if isinstance(load, kind)}
        most = max(sizes.values(), default=0.0) or 1.0
        found |= {name: size / most for name, size in sizes.items()}
    return found


def _size(scene: Scene, load: Any, times: Array) -> float:
    function = load.scale if isinstance(load, Force) else load.torque
    signed = strength(scene, function, times)
    size = 1.0 if signed is None else float(np.max(np.abs(signed)))
    return size * (float(np.linalg.norm(load.force)) if isinstance(load, Force) else 1.0)
