"""A scene turned into an assembled Exudyn system."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from shoal.engines.capabilities import of_kind
from shoal.engines.course import Clock
from shoal.engines.exudyn.beam import BeamPart
from shoal.engines.exudyn.bodies import BodyPart, Holder, RigidPart, System
from shoal.engines.exudyn.cable import CablePart
from shoal.engines.exudyn.connectors import Exchange
from shoal.engines.exudyn.contacts import Penalty, add_contacts
from shoal.engines.exudyn.ends import SystemAttachments
from shoal.engines.exudyn.ground import GroundPart, add_moving_point
from shoal.engines.exudyn.joints import Gap, add_friction, add_joint
from shoal.engines.exudyn.loads import add_load
from shoal.engines.exudyn.record import Indices
from shoal.engines.poses import initial_poses
from shoal.errors import InputError
from shoal.mechanics.assembly.groups import moving
from shoal.mechanics.joints import conditions
from shoal.mechanics.reach import span
from shoal.mechanics.start.start import complete
from shoal.scene import GROUND, DrivenAngle, Scene
from shoal.scene.dimensions import padded
from shoal.trajectory import Array

Beam = Literal["ancf-cable", "geometrically-exact"]
PARTS: dict[Beam, dict[str, Any]] = {
    "ancf-cable": {"rigid": RigidPart, "ancf-cable": CablePart},
    "geometrically-exact": {"rigid": RigidPart, "ancf-cable": BeamPart, "simo-reissner": BeamPart},
}
"""What stands for a body of each element."""


def library() -> Any:
    """The exudyn package. Raises InputError where it is not installed."""
    try:
        return importlib.import_module("exudyn")
    except ImportError as error:
        raise InputError(f"engine: exudyn cannot be imported ({error}); install shoal[engines]") from None


@contextmanager
def silence(exu: Any) -> Iterator[None]:
    """Exudyn reports failures on standard output, which belongs to the command line's answer."""
    spoke = exu.config.printToConsole
    exu.config.printToConsole = False
    try:
        yield
    finally:
        exu.config.printToConsole = spoke


@dataclass(frozen=True)
class ExudynSystem:
    """An assembled system and the parts that read its coordinates."""

    scene: Scene
    system: System
    mbs: Any
    container: Any
    """Owns the system; Exudyn frees both when it goes."""
    clock: Clock
    """The functions of time, and where steps end because of them."""
    parts: dict[str, BodyPart]
    gaps: list[Gap]
    exchanges: list[Exchange]
    """Springs, friction and applied loads."""
    penalties: dict[str, Penalty]
    """Springs that stand for contacts, by their field."""
    span: float
    """Size of the machine [m]."""
    reference: Array
    """Coordinates [m or rad] of the undeformed start, from which Exudyn counts, (unknowns,)."""
    dependent: int = 0
    """Number of constraints in space that hold what others hold already: Exudyn's Jacobian is singular."""

    @property
    def unknowns(self) -> int:
        """Number of coordinates."""
        return self.reference.size

    @property
    def constraints(self) -> int:
        """Number of constraint equations, those included that Exudyn keeps but does not need."""
        return len(self.mbs.systemData.GetAECoordinates())

    @property
    def unfollowed(self) -> str:
        """Return why the energy is not followed: it comes and goes through constraints, or contacts take it."""
        joints = self.scene.joints.values()
        if self.scene.ground_points or any(isinstance(joint, DrivenAngle) for joint in joints):
            return "motion is prescribed"
        return "contacts take energy" if self.penalties else ""

    def gap(self, q: Array, v: Array) -> float:
        """Largest opening of a joint [m, or rad]; q, v: (rows, unknowns)."""
        return max((float(np.max(gap(q, v))) for gap in self.gaps), default=0.0)

    def energy(self, t: Array, q: Array, v: Array, rows: Indices) -> tuple[Array, Array]:
        """Total energy and that in motion [J] at `rows` of times t [s], (rows,) each.

        In motion: kinetic, elastic of bodies, and the size of that of springs.
        """
        shares = [part.energy(q[rows], v[rows]) for part in self.parts.values()]
        moving = np.sum([share.kinetic + share.elastic for share in shares], axis=0)
        # A torsion spring counts its turns along all times.
        stored = (exchange.stored(t, q, v)[rows] for exchange in self.exchanges if exchange.stored is not None)
        springs = sum(stored, np.zeros(len(rows)))
        gravity = padded(self.scene.gravity, self.scene.dimensions)
        height = np.sum([share.moment for share in shares], axis=0) @ np.array(gravity)
        return moving + springs - height, moving + np.abs(springs)

    def crossed(self, q: Array, v: Array) -> Array:
        """The largest fraction of a narrow part of a force law that each step crosses, (rows - 1,)."""
        fractions = [exchange.crossed(q, v) for exchange in self.exchanges if exchange.crossed is not None]
        return np.max(fractions, axis=0, initial=0.0) if fractions else np.zeros(len(q) - 1)

    def lost_power(self, t: Array, q: Array, v: Array) -> Array:
        """Power lost in friction, dampers and materials less that of applied loads [W] at times t [s], (rows,)."""
        power = sum((exchange.lost(t, q, v) for exchange in self.exchanges), np.zeros(len(t)))
        return np.asarray(sum((part.damping(q, v) for part in self.parts.values()), power))


def build(
    exu: Any, scene: Scene, beam: Beam, end: float | None = None, system_of: type[System] = System
) -> ExudynSystem:
    """Enter bodies, gravity, joints and loads at the initial state. Raises InputError for a joint that is open.

    end [s]: of the run, beyond the scene's duration if at all; system_of: what the items are entered into.
    """
    items = importlib.import_module("exudyn.itemInterface")
    scene = complete(scene).scene
    poses = initial_poses(scene)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    clock = Clock(max(end or 0.0, scene.solver.duration), scene.solver.step)
    system = system_of(mbs, items, scene.gravity, clock)
    parts: dict[str, BodyPart] = {}
    for name, body in scene.bodies.items():
        system.enter(f"bodies.{name}")
        part = of_kind(PARTS[beam], body.element, f"bodies.{name}.element")
        parts[name] = part.add(system, body, poses[name])
    system.enter(GROUND)
    ground = GroundPart.add(system)
    places: dict[str, Holder] = {**parts, GROUND: ground}
    for point, path in scene.ground_points.items():
        name = moving(point)
        system.enter(f"ground_points.{point}")
        places[name] = add_moving_point(system, ground, point, path, poses[name])
    ends = SystemAttachments(scene, system, places, poses)
    gaps = [add_joint(ends, name, joint) for name, joint in scene.joints.items() if conditions(joint)]
    friction = (add_friction(ends, name, joint) for name, joint in scene.joints.items())
    exchanges = [exchange for exchange in friction if exchange is not None]
    exchanges += [add_load(ends, name, load) for name, load in scene.loads.items()]
    penalties = add_contacts(ends)
    mbs.Assemble()
    reference = mbs.systemData.GetODE2Coordinates(configuration=exu.ConfigurationType.Reference)
    return ExudynSystem(
        scene, system, mbs, container, clock, parts, gaps, exchanges, penalties, span(scene), np.array(reference)
    )
