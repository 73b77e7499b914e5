"""Equations of motion of a scene from Lagrange's equations, differentiated by CasADi from the energies."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from shoal.engines.casadi.bodies import PlacedCable
from shoal.engines.casadi.loads import applied, dissipation, stored, with_rest
from shoal.engines.casadi.tree import PlacedTree, build_tree
from shoal.scene import PointMass, Scene, Solver
from shoal.trajectory import Array


@dataclass(frozen=True, eq=False)
class CasadiModel:
    """CasADi functions of the state x = (q, v, w): coordinates, their rates, and the work lost [J]:
    that of friction and dampers less that of applied loads.

    bodies, markers: names in the scene's order; unknowns: length of q
    start: (angles [rad], rates [rad/s]), one of each per body -> x, (2 unknowns + 1,)
    rate: x -> dx/dt
    energies: x -> kinetic, elastic (with springs) and gravitational energy [J], (3,)
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
    """The model of a scene that the engine can do; scenes that differ only in initial state and solver share one."""
    scene = with_rest(scene)
    bare = scene.model_copy(update={"name": "any", "description": "", "initial": {}, "solver": Solver()})
    return _build(bare.model_dump_json())


@lru_cache(maxsize=32)
def _build(text: str) -> CasadiModel:
    scene = Scene.model_validate_json(text)
    tree = build_tree(scene)
    q = tree.coordinates
    v = ca.SX.sym("v", q.numel())
    x = ca.vertcat(q, v, ca.SX.sym("w"))
    kinetic, elastic, gravity = _kinetic(scene, tree, v), _elastic(tree) + stored(scene, tree), _gravity(scene, tree)
    resisting = ca.gradient(dissipation(scene, tree, v), v) - applied(scene, tree, v)
    momentum = ca.gradient(kinetic, v)
    # Lagrange's equations: d/dt dT/dv - dT/dq + dU/dq + dD/dv = Q.
    force = ca.gradient(kinetic - elastic - gravity, q) - resisting - ca.jtimes(momentum, q, v)
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
        rate=ca.Function("rate", [x], [ca.vertcat(v, acceleration, ca.dot(v, resisting))]),
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


def _kinetic(scene: Scene, tree: PlacedTree, v: Any) -> Any:
    energy = ca.SX(0)
    for name, body in scene.bodies.items():
        placed = tree.placed[name]
        if isinstance(placed, PlacedCable):
            for e, mass in zip(placed.elements(), placed.sections.mass, strict=True):
                speed = ca.jtimes(e, tree.coordinates, v)
                energy += mass / 2 * placed.element.square(speed, placed.h)
        elif isinstance(body, PointMass):
            energy += body.mass / 2 * ca.sumsqr(ca.jtimes(placed.point((0.0, 0.0)), tree.coordinates, v))
        else:
            speed = ca.jtimes(placed.point(body.centre_of_mass), tree.coordinates, v)
            spin = ca.jtimes(placed.angle(body.centre_of_mass), tree.coordinates, v)
            energy += body.mass / 2 * ca.sumsqr(speed) + body.inertia / 2 * spin**2
    return energy


def _elastic(tree: PlacedTree) -> Any:
    energy = ca.SX(0)
    for placed in tree.placed.values():
        if isinstance(placed, PlacedCable):
            sections = placed.sections
            for e, axial, bending in zip(placed.elements(), sections.axial, sections.bending, strict=True):
                strain, curvature = placed.element.strain(e, placed.h)
                energy += axial / 2 * strain + bending / 2 * curvature
    return energy


def _gravity(scene: Scene, tree: PlacedTree) -> Any:
    moment = ca.SX.zeros(2)
    for name, body in scene.bodies.items():
        placed = tree.placed[name]
        if isinstance(placed, PlacedCable):
            for e, mass in zip(placed.elements(), placed.sections.mass, strict=True):
                moment += mass * placed.element.integral(e, placed.h)
        else:
            moment += body.mass * placed.point((0.0, 0.0) if isinstance(body, PointMass) else body.centre_of_mass)
    return -ca.dot(ca.DM(scene.gravity), moment)
