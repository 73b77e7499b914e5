"""Forces, torques and springs in space inside Exudyn, and the power they feed into the machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shoal.engines.capabilities import of_kind
from shoal.engines.exudyn import user
from shoal.engines.exudyn.chain import Chain, gauss
from shoal.engines.exudyn.connectors import Exchange, ForceLaw, add_spring
from shoal.engines.exudyn.loads import scaled
from shoal.engines.exudyn.space.ends import SpatialEnds, frame_about
from shoal.engines.exudyn.space.joints import add_twist, require_rigid, spin
from shoal.errors import InputError
from shoal.mechanics.joints import Aligned, of_scene
from shoal.scene import GROUND, Attachment, DistributedForce, Force, Load, Rod, Spring, Torque, TorsionSpring
from shoal.scene.dimensions import padded
from shoal.trajectory import Array


def add_load(ends: SpatialEnds, name: str, load: Load) -> Exchange:
    """Enter a load. Raises InputError."""
    enter = of_kind(LOADS, load.kind, f"loads.{name}")
    ends.system.enter(f"loads.{name}")
    return enter(ends, f"loads.{name}", load)


def _law(load: Spring | TorsionSpring) -> ForceLaw:
    return ForceLaw(load.stiffness, load.cubic, load.damping, elastic=load.elastic)


def _add_spring(ends: SpatialEnds, where: str, load: Spring) -> Exchange:
    return add_spring(ends, load.first, load.second, _law(load), load.length)


def _add_torsion(ends: SpatialEnds, where: str, load: TorsionSpring) -> Exchange:
    _require_hinge(ends, where, load)
    return add_twist(ends, where, load.first, load.second, load.axis, _law(load), load.angle)


def _require_hinge(ends: SpatialEnds, where: str, load: TorsionSpring) -> None:
    """Raises InputError where no joint keeps the axis common: there Exudyn and the native machine mean other angles."""
    bodies, axis = {load.first.body, load.second.body}, np.array(load.axis) / np.linalg.norm(load.axis)
    kept = False
    for _, one in of_scene(ends.scene):
        if isinstance(one, Aligned) and one.axis is not None and {one.first.body, one.second.body} == bodies:
            common = np.array(one.axis) / np.linalg.norm(one.axis)
            kept = kept or bool(np.linalg.norm(np.cross(axis, common)) < 1e-9)
    if not kept:
        raise InputError(f"{where}: engine exudyn needs a joint that keeps its axis common to both bodies; use gauss")


def _add_force(ends: SpatialEnds, where: str, load: Force) -> Exchange:
    if load.follows:
        require_rigid(ends, f"{where}.follows", load.at)
    scale = ends.system.course(load.scale, f"{where}.scale")
    vector = np.array(padded(load.force, 3), dtype=float)
    marker = ends.turn(load.at) if load.follows else ends.hold(load.at)
    options = scaled(ends.system, vector.tolist(), scale)
    ends.system.add("LoadForceVector", markerNumber=marker, bodyFixed=load.follows, **options)

    def power(t: Array, q: Array, v: Array) -> Array:
        here = ends.moved(load.at, q, v)
        force = here.axes @ vector if load.follows else vector
        return np.asarray(-scale(t) * np.sum(force * here.velocity, axis=1))

    return Exchange(power)


def _add_torque(ends: SpatialEnds, where: str, load: Torque) -> Exchange:
    """Torque of a connector about an axis of the body that takes it, or of the ground."""
    holder = load.reaction or Attachment(body=GROUND, point=(0.0, 0.0, 0.0))
    require_rigid(ends, where, load.at, *(() if ends.is_ground(holder) else (holder,)))
    torque = ends.system.course(load.torque, f"{where}.torque")
    axes = frame_about(ends.image(holder, load.axis))

    ends.system.add(
        "ObjectConnectorTorsionalSpringDamper",
        markerNumbers=[ends.framed(holder, axes), ends.turn(load.at)],
        springTorqueUserFunction=ends.system.function(user.torque_against, torque.value),
    )

    def power(t: Array, q: Array, v: Array) -> Array:
        base, here = ends.moved(holder, q, v), ends.moved(load.at, q, v)
        speed = spin(here.axes, here.turning) - spin(base.axes, base.turning)
        return np.asarray(-torque(t) * np.sum(speed * (base.axes @ axes[:, 2]), axis=1))

    return Exchange(power)


def _add_distributed(ends: SpatialEnds, where: str, load: DistributedForce) -> Exchange:
    scale = ends.system.course(load.scale, f"{where}.scale")
    part, rod, system = ends.parts[load.body], ends.scene.bodies[load.body], ends.system
    assert isinstance(rod, Rod)
    force = np.array(padded(load.force, 3), dtype=float)
    if isinstance(part, Chain):
        for element, mass in zip(part.elements, part.sections.mass, strict=True):
            options = scaled(system, (force / mass).tolist(), scale)
            system.accelerate(element, tuple(options.pop("loadVector")), **options)
        along = [(k + (x + 1) / 2) * part.size for k in range(len(part.elements)) for x in gauss(3)[0]]
        weights = np.tile(gauss(3)[1] * part.size / 2, len(part.elements))
    else:
        along, weights = [np.float64(0.5 * rod.length)], np.array([rod.length])
        marker = part.hold(system, (0.5 * rod.length, 0.0, 0.0))
        system.add("LoadForceVector", markerNumber=marker, **scaled(system, (force * rod.length).tolist(), scale))

    def power(t: Array, q: Array, v: Array) -> Array:
        ways = (part.motion(q, v, (s, 0.0, 0.0)).velocity for s in along)
        return np.asarray(-scale(t) * (sum(w * way for w, way in zip(weights, ways, strict=True)) @ force))

    return Exchange(power)


LOADS: dict[str, Callable[[SpatialEnds, str, Any], Exchange]] = {
    "spring": _add_spring,
    "torsion-spring": _add_torsion,
    "force": _add_force,
    "torque": _add_torque,
    "distributed-force": _add_distributed,
}
