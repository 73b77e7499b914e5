"""A scene in space turned into an assembled Exudyn system, at the start that the native machine found."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from shoal.engines.capabilities import loops
from shoal.engines.course import Clock
from shoal.engines.exudyn.bodies import System
from shoal.engines.exudyn.build import Beam, ExudynSystem, silence
from shoal.engines.exudyn.contacts import add_contacts
from shoal.engines.exudyn.ground import drive, driven
from shoal.engines.exudyn.space.beam import SpatialBeamPart
from shoal.engines.exudyn.space.bodies import SolidPart, SpatialCablePart, SpatialGround
from shoal.engines.exudyn.space.ends import SpatialEnds
from shoal.engines.exudyn.space.joints import add_friction, add_joint, still
from shoal.engines.exudyn.space.loads import add_load
from shoal.mechanics.assembly.groups import moving
from shoal.mechanics.assembly.space.start import place_started
from shoal.mechanics.frames import BeamFrame, PointFrame
from shoal.mechanics.numerics.tile import stacked
from shoal.mechanics.reach import span
from shoal.mechanics.start.start import body_states
from shoal.scene import GROUND, ModalBody, PointMass, Rod, Scene
from shoal.scene.dimensions import padded

DEPENDENT = 1e-9
"""Singular values of Exudyn's constraints that are zero, relative to the largest."""


def build_in_space(
    exu: Any, scene: Scene, beam: Beam, end: float | None = None, system_of: type[System] = System
) -> ExudynSystem:
    """Enter bodies, gravity, joints and loads at the initial state. Raises InputError.

    beam, end, system_of: as of `build`
    """
    items = importlib.import_module("exudyn.itemInterface")
    placement = place_started(scene)
    q, v = stacked(placement.positions)[:, 0], stacked(placement.velocities)[:, 0]
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    clock = Clock(max(end or 0.0, scene.solver.duration), scene.solver.step)
    system = system_of(mbs, items, padded(scene.gravity, 3), clock)
    parts: dict[str, Any] = {}
    for name, body in scene.bodies.items():
        system.enter(f"bodies.{name}")
        frame = placement.frames[name]
        if isinstance(frame, BeamFrame):
            assert isinstance(body, Rod)
            if beam == "ancf-cable":
                parts[name] = SpatialCablePart.enter(system, body, frame, q, v)
            else:
                parts[name] = SpatialBeamPart.enter(system, body, placement, name, q, v)
        else:
            assert not isinstance(body, ModalBody)
            parts[name] = SolidPart.add(system, body, frame, q, v)
    system.enter(GROUND)
    ground = SpatialGround.add(system)
    places: dict[str, Any] = {**parts, GROUND: ground}
    for point, path in scene.ground_points.items():
        system.enter(f"ground_points.{point}")
        # A point of the ground that moves is a body whose place is driven, so its mass is idle.
        frame = PointFrame(point, placement.drivers[moving(point)])
        part = places[moving(point)] = SolidPart.add(system, PointMass(mass=1.0), frame, q, v)
        for axis, f in enumerate((path.x, path.y, path.z)):
            drive(system, (ground.node, 0), (part.node, axis), driven(system, f, f"ground_points.{point}"))
        still(system, ground, part)
    ends = SpatialEnds(scene, system, places, {}, placement)
    gaps = [gap for name, joint in scene.joints.items() for gap in add_joint(exu, ends, name, joint)]
    friction = (add_friction(ends, name, joint) for name, joint in scene.joints.items())
    exchanges = [exchange for exchange in friction if exchange is not None]
    exchanges += [add_load(ends, name, load) for name, load in scene.loads.items()]
    penalties = add_contacts(ends)
    mbs.Assemble()
    reference = mbs.systemData.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)
    started = scene.model_copy(update={"initial": body_states(placement.frames, scene, q, v)})
    dependent = _dependent(exu, mbs) if any(loops(scene)) else 0
    return ExudynSystem(
        started, system, mbs, container, clock, parts, gaps, exchanges, penalties, span(scene), np.array(reference),
        dependent,
    )  # fmt: skip


def _dependent(exu: Any, mbs: Any) -> int:
    """Count the redundant constraints; the native machine, which shares axes, may have fewer."""
    solver = importlib.import_module("exudyn.solver")
    with silence(exu):
        found = solver.ComputeSystemDegreeOfFreedom(mbs, threshold=DEPENDENT)
    return int(found["redundantConstraints"])
