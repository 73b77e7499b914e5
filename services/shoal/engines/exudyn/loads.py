"""Forces, torques and distributed forces inside Exudyn, and the power they feed into the machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shoal.engines.capabilities import of_kind
from shoal.engines.course import PiecewiseFunction
from shoal.engines.exudyn import user
from shoal.engines.exudyn.beam import BeamPart
from shoal.engines.exudyn.bodies import System
from shoal.engines.exudyn.cable import CablePart
from shoal.engines.exudyn.chain import gauss
from shoal.engines.exudyn.connectors import Exchange, ForceLaw, add_spring, add_torsion
from shoal.engines.exudyn.ends import SystemAttachments
from shoal.scene import DistributedForce, Force, Load, Rod, Spring, Torque, TorsionSpring
from shoal.trajectory import Array


def add_load(ends: SystemAttachments, name: str, load: Load) -> Exchange:
    """Enter a load. Raises InputError."""
    enter = of_kind(LOADS, load.kind, f"loads.{name}")
    ends.system.enter(f"loads.{name}")
    return enter(ends, f"loads.{name}", load)


def _add_spring(ends: SystemAttachments, where: str, load: Spring) -> Exchange:
    return add_spring(ends, load.first, load.second, _law(load), load.length)


def _add_torsion(ends: SystemAttachments, where: str, load: TorsionSpring) -> Exchange:
    ends.require_direction(where, load.first, load.second)
    return add_torsion(ends, load.first, load.second, _law(load), load.angle)


def _law(load: Spring | TorsionSpring) -> ForceLaw:
    return ForceLaw(load.stiffness, load.cubic, load.damping, elastic=load.elastic)


def _add_force(ends: SystemAttachments, where: str, load: Force) -> Exchange:
    scale = ends.system.course(load.scale, f"{where}.scale")
    marker = ends.turn(load.at) if load.follows else ends.hold(load.at)
    options = scaled(ends.system, [*load.force, 0.0], scale)
    ends.system.add("LoadForceVector", markerNumber=marker, bodyFixed=load.follows, **options)

    def power(t: Array, q: Array, v: Array) -> Array:
        here = ends.motion(load.at, q, v)
        force = complex(*load.force) * scale(t)
        if load.follows:
            force = force * np.exp(1j * here.direction)
        return -(force.real * here.velocity[:, 0] + force.imag * here.velocity[:, 1])

    return Exchange(power)


def _add_torque(ends: SystemAttachments, where: str, load: Torque) -> Exchange:
    ends.require_direction(where, load.at)
    torque = ends.system.course(load.torque, f"{where}.torque")
    for side, sign in ((load.at, 1.0), (load.reaction, -1.0)):
        if side is not None:
            options = scaled(ends.system, [0.0, 0.0, sign], torque)
            ends.system.add("LoadTorqueVector", markerNumber=ends.turn(side), **options)

    def power(t: Array, q: Array, v: Array) -> Array:
        against = 0.0 if load.reaction is None else ends.motion(load.reaction, q, v).rate
        return -torque(t) * (ends.motion(load.at, q, v).rate - against)

    return Exchange(power)


def _add_distributed(ends: SystemAttachments, where: str, load: DistributedForce) -> Exchange:
    scale = ends.system.course(load.scale, f"{where}.scale")
    part, rod, system = ends.parts[load.body], ends.scene.bodies[load.body], ends.system
    assert isinstance(rod, Rod)
    force = np.array(load.force)
    if isinstance(part, CablePart | BeamPart):
        for element, mass in zip(part.elements, part.sections.mass, strict=True):
            options = scaled(system, [*(force / mass), 0.0], scale)
            system.accelerate(element, options.pop("loadVector")[:2], **options)
        places = [((k + (x + 1) / 2) * part.size, 0.0) for k in range(rod.elements) for x in gauss(3)[0]]
        weights = np.tile(gauss(3)[1] * part.size / 2, rod.elements)
    else:
        nodes, weights = gauss(24)
        places = [(z.real, z.imag) for z in (rod.axis((x + 1) / 2 * rod.length) for x in nodes)]
        weights = weights * rod.length / 2
        middle = weights @ np.array(places) / rod.length
        marker = part.hold(system, (float(middle[0]), float(middle[1])))
        options = scaled(system, [*(force * rod.length), 0.0], scale)
        system.add("LoadForceVector", markerNumber=marker, **options)

    def power(t: Array, q: Array, v: Array) -> Array:
        flow = sum(w * part.motion(q, v, place).velocity for w, place in zip(weights, places, strict=True))
        return np.asarray(-scale(t) * (flow @ force))

    return Exchange(power)


def scaled(system: System, vector: list[float], scale: PiecewiseFunction) -> dict[str, Any]:
    """A load vector times a function of time, as Exudyn's options."""
    if scale.function.number is not None:
        return {"loadVector": [scale.function.number * part for part in vector]}

    return {"loadVector": vector, "loadVectorUserFunction": system.function(user.scaled_load, vector, scale.value)}


LOADS: dict[str, Callable[[SystemAttachments, str, Any], Exchange]] = {
    "spring": _add_spring,
    "torsion-spring": _add_torsion,
    "force": _add_force,
    "torque": _add_torque,
    "distributed-force": _add_distributed,
}
