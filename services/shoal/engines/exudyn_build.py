"""A scene turned into an assembled Exudyn system."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shoal.engines.exudyn_beam import BeamPart
from shoal.engines.exudyn_bodies import Part, RigidPart, System
from shoal.engines.exudyn_cable import CablePart
from shoal.engines.exudyn_pose import initial_poses
from shoal.errors import InputError
from shoal.scene import GROUND, Attachment, Rod, Scene
from shoal.trajectory import Array

Beam = Literal["ancf-cable", "geometrically-exact"]


def library() -> Any:
    """The exudyn package. Raises InputError where it is not installed."""
    try:
        return importlib.import_module("exudyn")
    except ImportError as error:
        raise InputError(f"engine: exudyn cannot be imported ({error}); install shoal[engines]") from None


@dataclass(frozen=True)
class Machine:
    """An assembled system and the parts that read its coordinates."""

    scene: Scene
    mbs: Any
    container: Any
    """Owns the system; Exudyn frees both when it goes."""
    parts: dict[str, Part]
    reference: Array
    """Coordinates [m or rad] of the undeformed start, from which Exudyn counts, (unknowns,)."""

    @property
    def unknowns(self) -> int:
        """Number of coordinates."""
        return self.reference.size

    @property
    def constraints(self) -> int:
        """Number of constraint equations."""
        return 2 * len(self.scene.joints)

    def gap(self, q: Array, v: Array) -> float:
        """Largest distance [m] between places that a joint holds together; q, v: (rows, unknowns)."""
        gaps = [
            np.linalg.norm(self._position(joint.first, q, v) - self._position(joint.second, q, v), axis=1)
            for joint in self.scene.joints.values()
        ]
        return float(np.max(gaps))

    def energy(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Total energy and its kinetic plus elastic share [J], (rows,) each."""
        shares = [part.energy(q, v) for part in self.parts.values()]
        moving = np.sum([share.kinetic + share.elastic for share in shares], axis=0)
        height = np.sum([share.moment for share in shares], axis=0) @ np.array(self.scene.gravity)
        return moving - height, moving

    def friction_power(self, q: Array, v: Array) -> Array:
        """Power lost in the joints [W], (rows,)."""
        power = np.zeros(len(q))
        for joint in self.scene.joints.values():
            if joint.friction:
                power += joint.friction * (self._rate(joint.second, q, v) - self._rate(joint.first, q, v)) ** 2
        return power

    def _position(self, end: Attachment, q: Array, v: Array) -> Array:
        place = self.scene.location(end)
        return np.array([place]) if end.body == GROUND else self.parts[end.body].motion(q, v, place).position

    def _rate(self, end: Attachment, q: Array, v: Array) -> Array:
        if end.body == GROUND:
            return np.zeros(len(q))
        return self.parts[end.body].motion(q, v, self.scene.location(end)).rate


def build(exu: Any, scene: Scene, beam: Beam) -> Machine:
    """Enter bodies, gravity, joints and friction at the initial state. Raises InputError for a loop that is open."""
    items = importlib.import_module("exudyn.itemInterface")
    poses = initial_poses(scene)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    system = System(mbs, items, scene.gravity)
    parts: dict[str, Part] = {}
    for name, body in scene.bodies.items():
        if not isinstance(body, Rod) or body.element == "rigid":
            parts[name] = RigidPart.add(system, body, poses[name])
        elif beam == "ancf-cable":
            parts[name] = CablePart.add(system, body, poses[name])
        else:
            parts[name] = BeamPart.add(system, body, poses[name])
    ground = mbs.AddObject(items.ObjectGround())
    for joint in scene.joints.values():
        holds, turns = [], []
        for end in (joint.first, joint.second):
            place = scene.location(end)
            if end.body == GROUND:
                holds.append(system.marker("MarkerBodyPosition", ground, place))
                turns.append(system.marker("MarkerBodyRigid", ground, place))
            else:
                holds.append(parts[end.body].hold(system, place))
                turns += [parts[end.body].turn(system, place)] if joint.friction else []
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=holds))
        if joint.friction:
            mbs.AddObject(items.ObjectConnectorTorsionalSpringDamper(markerNumbers=turns, damping=joint.friction))
    mbs.Assemble()
    reference = mbs.systemData.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)
    return Machine(scene, mbs, container, parts, np.array(reference))
