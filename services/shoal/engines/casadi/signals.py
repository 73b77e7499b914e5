"""Signals as CasADi expressions of coordinates and rates: what loads follow, without time and without states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from shoal.engines.casadi.tree import PlacedTree
from shoal.errors import InputError
from shoal.scene import GROUND, Attachment, Scene, SignalFunction
from shoal.scene.formula import Measure, Node
from shoal.scene.signals import Constant, joint_of, place, written_out

_RATES = {"rate": "angle", "slide_rate": "slide", "distance_rate": "distance", "velocity": "position"}


def _rise(x: Any) -> Any:
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


OPERATIONS: dict[str, Callable[..., Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "**": ca.power,
    "neg": lambda a: -a,
    "square": lambda a: a * a,
    "rise": _rise,
    "ramp": lambda a: _rise(ca.fmin(ca.fmax(a, 0.0), 1.0)),
    "step": lambda a: ca.if_else(a >= 0.0, 1.0, 0.0),
    "abs": ca.fabs,
    "min": ca.fmin,
    "max": ca.fmax,
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": ca.tan,
    "tanh": ca.tanh,
    "sqrt": ca.sqrt,
    "exp": ca.exp,
    "log": ca.log,
}
"""Those of `formula.OPERATIONS`."""


def strength(scene: Scene, tree: PlacedTree, v: Any, f: SignalFunction) -> Any:
    """The value of a function that depends on no time, at the rates v. Raises InputError."""
    return f.number if f.number is not None else _value(scene, tree, v, written_out(scene, f))


def _value(scene: Scene, tree: PlacedTree, v: Any, node: Node) -> Any:
    if isinstance(node, tuple):
        return OPERATIONS[node[0]](*(_value(scene, tree, v, argument) for argument in node[1:]))
    if isinstance(node, Constant):
        constant = scene.signals[node.name]
        assert isinstance(constant, SignalFunction)
        return constant.number
    if not isinstance(node, Measure):
        return node
    found = _measure(scene, tree, _RATES.get(node.kind, node.kind), node)
    return ca.jtimes(found, tree.coordinates, v) if node.kind in _RATES else found


def _measure(scene: Scene, tree: PlacedTree, kind: str, measure: Measure) -> Any:
    if kind == "angle":
        joint = joint_of(scene, measure)
        if joint is None:
            return _angle(scene, tree, measure, Attachment(body=measure.names[0]))
        first, second = (_angle(scene, tree, measure, side) for side in (joint.first, joint.second))
        return second - first
    points = [_point(scene, tree, name) for name in measure.names[: 2 if kind == "distance" else 1]]
    if kind == "distance":
        return ca.norm_2(points[1] - points[0])
    return points[0]["xy".index(measure.names[1])]


def _point(scene: Scene, tree: PlacedTree, name: str) -> Any:
    at = place(scene, name)
    return ca.SX(list(scene.location(at))) if at.body == GROUND else tree.placed[at.body].point(scene.location(at))


def _angle(scene: Scene, tree: PlacedTree, measure: Measure, side: Attachment) -> Any:
    if side.body == GROUND:
        return 0.0
    if scene.bodies[side.body].element != "rigid":
        raise InputError(f"signals: {measure}: engine casadi counts no turns of {side.body}, which bends")
    return tree.placed[side.body].angle(scene.location(side))
