"""Equations of motion of a scene from Lagrange's equations, differentiated by CasADi from the energies."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from shoal.engines.casadi_bodies import PlacedCable
from shoal.engines.casadi_tree import Tree, build_tree
from shoal.scene import Scene, Solver
from shoal.trajectory import Array


@dataclass(frozen=True, eq=False)
class CasadiModel:
    """CasADi functions of the state x = (q, v, w): coordinates, their rates, and the work lost to friction [J].

    bodies, markers: names in the scene's order; unknowns: length of q
    start: (angles [rad], rates [rad/s]), one of each per body -> x, (2 unknowns + 1,)
    rate: x -> dx/dt
    energies: x -> kinetic, elastic and gravitational energy [J], (3,)
    places: x -> positions of the markers [m], (2, markers), and directions [rad], (markers,)
    root: the point of the ground [m] from which each marker's chain hangs, (2, markers)
    reach: length of that chain [m], (markers,)
    weight: sum of mass times gravity [N], the scale of the gravitational energy
    """

    bodies: tuple[str, ...]
    markers: tuple[str, ...]
    unknowns: int
    start: Any
    rate: Any
    energies: Any
    places: Any
    root: Array
    reach: Array
    weight: float


def casadi_model(scene: Scene) -> CasadiModel:
    """The model of a scene; scenes that differ only in initial state and solver share one. Raises InputError."""
    bare = scene.model_copy(update={"name": "any", "description": "", "initial": {}, "solver": Solver()})
    return _build(bare.model_dump_json())


@lru_cache(maxsize=32)
def _build(text: str) -> CasadiModel:
    scene = Scene.model_validate_json(text)
    tree = build_tree(scene)
    q = tree.coordinates
    v = ca.SX.sym("v", q.numel())
    x = ca.vertcat(q, v, ca.SX.sym("w"))
    kinetic, elastic, gravity = _kinetic(scene, tree, v), _elastic(tree), _gravity(scene, tree)
    dissipation = _dissipation(scene, tree, v)
    momentum = ca.gradient(kinetic, v)
    # Lagrange's equations: d/dt dT/dv - dT/dq + dU/dq + dD/dv = 0.
    force = ca.gradient(kinetic - elastic - gravity, q) - ca.gradient(dissipation, v) - ca.jtimes(momentum, q, v)
    acceleration = _solve(ca.jacobian(momentum, v), force)
    rates = ca.SX.sym("rates", len(scene.bodies))
    start = ca.vertcat(tree.start, ca.jtimes(tree.start, tree.angles, rates), 0)
    markers = [(tree.placed[marker.body], scene.location(marker)) for marker in scene.markers.values()]
    points = ca.horzcat(*(body.point(place) for body, place in markers))
    angles = ca.vertcat(*(body.angle(place) for body, place in markers))
    return CasadiModel(
        bodies=tuple(scene.bodies),
        markers=tuple(scene.markers),
        unknowns=q.numel(),
        start=ca.Function("start", [tree.angles, rates], [start]),
        rate=ca.Function("rate", [x], [ca.vertcat(v, acceleration, 2 * dissipation)]),
        energies=ca.Function("energies", [x], [ca.vertcat(kinetic, elastic, gravity)]),
        places=ca.Function("places", [x], [points, angles]),
        root=np.array([tree.root[marker.body] for marker in scene.markers.values()]).T,
        reach=np.array(
            [
                tree.length[marker.body] + math.dist(tree.entry[marker.body], scene.location(marker))
                for marker in scene.markers.values()
            ]
        ),
        weight=sum(body.mass for body in scene.bodies.values()) * math.hypot(*scene.gravity),
    )


def _solve(mass: Any, force: Any) -> Any:
    """M^-1 f as an expression; a constant M is factored here, once."""
    if mass.is_constant():
        mass = ca.evalf(mass)
    return ca.ldl_solve(force, *ca.ldl(mass))


def _kinetic(scene: Scene, tree: Tree, v: Any) -> Any:
    energy = ca.SX(0)
    for name, body in scene.bodies.items():
        placed = tree.placed[name]
        if isinstance(placed, PlacedCable):
            for e in placed.elements():
                speed = ca.jtimes(e, tree.coordinates, v)
                energy += placed.rod.mass_per_length / 2 * placed.element.square(speed, placed.h)
        else:
            speed = ca.jtimes(placed.point(body.centre_of_mass), tree.coordinates, v)
            spin = ca.jtimes(placed.angle(body.centre_of_mass), tree.coordinates, v)
            energy += body.mass / 2 * ca.sumsqr(speed) + body.inertia / 2 * spin**2
    return energy


def _elastic(tree: Tree) -> Any:
    energy = ca.SX(0)
    for placed in tree.placed.values():
        if isinstance(placed, PlacedCable):
            for e in placed.elements():
                axial, bending = placed.element.strain(e, placed.h)
                energy += placed.rod.axial_stiffness / 2 * axial + placed.rod.bending_stiffness / 2 * bending
    return energy


def _gravity(scene: Scene, tree: Tree) -> Any:
    moment = ca.SX.zeros(2)
    for name, body in scene.bodies.items():
        placed = tree.placed[name]
        if isinstance(placed, PlacedCable):
            for e in placed.elements():
                moment += placed.rod.mass_per_length * placed.element.integral(e, placed.h)
        else:
            moment += body.mass * placed.point(body.centre_of_mass)
    return -ca.dot(ca.DM(scene.gravity), moment)


def _dissipation(scene: Scene, tree: Tree, v: Any) -> Any:
    """Rayleigh's function: half the power [W] that the joints' friction takes."""
    half = ca.SX(0)
    for joint in scene.joints.values():
        first, second = (tree.placed[side.body].angle(scene.location(side)) for side in (joint.first, joint.second))
        half += joint.friction / 2 * ca.jtimes(first - second, tree.coordinates, v) ** 2
    return half
