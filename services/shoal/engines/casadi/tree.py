"""Positions of every body as CasADi expressions: the open chains of revolute joints, walked from the ground.

A rigid body contributes its absolute angle, a cable the positions and slopes of its nodes. Where a body
hangs on its parent its position is an expression in the parent's coordinates, so no joint needs a multiplier.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from shoal.engines.capabilities import of_kind
from shoal.engines.casadi.bodies import PlacedBody, PlacedCable, PlacedRigid, cable_place, turned
from shoal.engines.casadi.element import cable_element
from shoal.engines.poses import hanging
from shoal.errors import InputError
from shoal.scene import GROUND, PointMass, Revolute, RigidBody, Rod, Scene
from shoal.scene.record import Vector


@dataclass(frozen=True)
class PlacedTree:
    """All bodies of a scene, placed.

    placed: the ground and every body by name
    coordinates: q, symbols, (unknowns,)
    angles: one symbol per body in the scene's order, the initial angles [rad], (bodies,)
    start: q of the straight bodies as an expression in `angles`, (unknowns,)
    entry: where each body hangs on its parent, in its own frame [m]
    root: the point of the ground [m] from which each body's chain hangs
    length: length of that chain up to the body's entry [m]
    """

    placed: dict[str, PlacedBody]
    coordinates: Any
    angles: Any
    start: Any
    entry: dict[str, Vector]
    root: dict[str, Vector]
    length: dict[str, float]


def build_tree(scene: Scene) -> PlacedTree:
    """Place every body of a scene of open chains, which `capabilities.require` has accepted."""
    ground: PlacedBody = PlacedRigid(ca.SX.zeros(2), ca.SX(0))
    placed, straight = {GROUND: ground}, {GROUND: ground}
    entry: dict[str, Vector] = {}
    root: dict[str, Vector] = {}
    length: dict[str, float] = {}
    angles = {name: ca.SX.sym(f"{name}_start") for name in scene.bodies}
    coordinates: list[Any] = []
    start: list[Any] = []
    for joint, parent, child in hanging(scene, "casadi"):
        if not isinstance(scene.joints[joint], Revolute):
            raise InputError(f"joints.{joint}: engine casadi cannot do {scene.joints[joint].kind}")
        outer, inner, name = scene.location(parent), scene.location(child), child.body
        body, angle = scene.bodies[name], angles[name]
        straight[name] = rest = PlacedRigid(straight[parent.body].point(outer) - turned(angle, inner), angle)
        anchor = placed[parent.body].point(outer)
        place = of_kind(ELEMENTS, body.element, f"bodies.{name}.element")
        placed[name], free, straight_free = place(name, body, inner, anchor, rest)
        coordinates += free
        start += straight_free
        entry[name] = inner
        on_ground = parent.body == GROUND
        root[name] = outer if on_ground else root[parent.body]
        length[name] = 0.0 if on_ground else length[parent.body] + math.dist(outer, entry[parent.body])
    return PlacedTree(
        placed=placed,
        coordinates=ca.vertcat(*coordinates),
        angles=ca.vertcat(*angles.values()),
        start=ca.vertcat(*start),
        entry=entry,
        root=root,
        length=length,
    )


def _place_rigid(
    name: str, body: Rod | RigidBody | PointMass, inner: Vector, anchor: Any, rest: PlacedRigid
) -> tuple[PlacedBody, list[Any], list[Any]]:
    if isinstance(body, PointMass):
        return PlacedRigid(anchor, ca.SX(0)), [], []
    angle = ca.SX.sym(f"{name}_angle")
    return PlacedRigid(anchor - turned(angle, inner), angle), [angle], [rest.turn]


def _place_cable(
    name: str, rod: Rod, inner: Vector, anchor: Any, rest: PlacedRigid
) -> tuple[PlacedBody, list[Any], list[Any]]:
    """The held node's position follows from the anchor, because the Hermite field is linear in it."""
    h, knots = rod.length / rod.elements, range(rod.elements + 1)
    index, s = cable_place(rod, inner)
    held = index + int(s > h / 2)

    def free(positions: list[Any], slopes: list[Any]) -> list[Any]:
        return [part for k in knots for part in ([] if k == held else [positions[k]]) + [slopes[k]]]

    slopes = [ca.SX.sym(f"{name}_slope{k}", 2) for k in knots]
    positions = [ca.SX.sym(f"{name}_node{k}", 2) for k in knots]
    unknowns = free(positions, slopes)
    positions[held] = ca.SX.zeros(2)
    others = PlacedCable(rod, _nodes(positions, slopes)).point(inner)
    unit = np.eye(8)[4 * (held - index)]
    weight = float(cable_element(rod.quadrature).field(unit, s, h)[0][0])
    positions[held] = (anchor - others) / weight
    straight = free([rest.point((k * h, 0.0)) for k in knots], [turned(rest.turn, (1.0, 0.0))] * len(knots))
    return PlacedCable(rod, _nodes(positions, slopes)), unknowns, straight


ELEMENTS: dict[str, Callable[..., tuple[PlacedBody, list[Any], list[Any]]]] = {
    "rigid": _place_rigid,
    "ancf-cable": _place_cable,
}
"""A body of each element on its anchor [m], its free coordinates, and where those are in the straight body."""


def _nodes(positions: list[Any], slopes: list[Any]) -> tuple[Any, ...]:
    return tuple(ca.vertcat(*pair) for pair in zip(positions, slopes, strict=True))
