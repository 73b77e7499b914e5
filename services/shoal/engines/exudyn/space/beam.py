"""The flexible rod in space as Exudyn's geometrically exact beam: it shears, twists and may be curved at rest.

Found from the residual of ObjectBeamGeometricallyExact, to 1e-8 of the force: two nodes with frames (r, R), and the
strain is the logarithm of the motion from one frame to the other over the length, less that of the reference; it holds
along the whole element (Sonneville, Cardona, Bruls 2014). Masses are those of frames that change linearly.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from shoal.engines.exudyn.bodies import BodyPart, Energy, Place, System
from shoal.engines.exudyn.chain import Chain
from shoal.engines.exudyn.space.bodies import Side, SpatialPointMotion, local_rates
from shoal.engines.exudyn.user import rotation, rotation_slope
from shoal.engines.sections import Sections
from shoal.errors import InputError
from shoal.mechanics import rotation as turns
from shoal.mechanics.assembly.space.attitudes import section
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.frames import BeamFrame
from shoal.scene import Attachment, Rod
from shoal.scene.sections import Section
from shoal.trajectory import Array

PER_ELEMENT = 2
"""Beams of Exudyn's in an element of the scene: nodes are as dense as those of its beams in the plane."""


@dataclass(frozen=True)
class SpatialBeamPart(Chain, BodyPart):
    """A chain of ObjectBeamGeometricallyExact; coordinates of a node: r and Euler parameters of the section.

    stiffness: EA, kGA, kGA, GJ, EI about y and z of every element, (elements, 6); inertia: rho times the polar and
    the two second moments, (elements, 3); rest: the strain of the reference, (elements, 6); begin: axes of the sections
    at the start as columns, (nodes, 3, 3).
    """

    nodes: list[Any]
    stiffness: Array
    inertia: Array
    rest: Array
    begin: Array

    @classmethod
    def enter(cls, system: System, rod: Rod, placement: SpatialPlacement, name: str, q: Array, v: Array) -> Any:
        """Enter an unstrained rod whose nodes are where its frame is at the coordinates q and rates v."""
        fine = rod.model_copy(update={"elements": PER_ELEMENT * rod.elements})
        sections = Sections.stout(fine, "simo-reissner", "director-rod")
        stiffness, inertia = _stiffness(fine, sections), _inertia(fine, sections)
        nodes, columns, frames = [], [], []
        for s in np.linspace(0.0, rod.length, fine.elements + 1):
            here = _start(placement, name, float(s), q, v)
            turn = here.axes.as_quat(scalar_first=True)
            rates = 0.25 * local_rates(turn).T @ here.axes.inv().apply(here.spin)
            node, places = system.node("NodeRigidBodyEP", [*here.place, *turn], [*here.speed, *rates])
            nodes.append(node)
            columns.append(places)
            frames.append(np.array([*here.place, *turn]))
        elements, length = [], rod.length / fine.elements
        for k, pair in enumerate(pairwise(nodes)):
            data = _section(float(sections.mass[k]), inertia[k], stiffness[k])
            kind = "ObjectBeamGeometricallyExact"
            beam = system.add(kind, nodeNumbers=list(pair), length=length, sectionData=data)
            elements.append(beam)
            system.weigh(beam)
        per_element = np.array([first + last for first, last in pairwise(columns)])
        rest = _strain(np.array([[*a, *b] for a, b in pairwise(frames)]), length)
        begin = rotation(np.array(frames)[:, 3:])
        return cls(fine, sections, elements, per_element, nodes, stiffness, inertia, rest, begin)

    def hold(self, system: System, place: Place) -> Any:
        """See SpatialHolder; joints and loads are at nodes."""
        return system.add("MarkerNodePosition", nodeNumber=self.side(place).node)

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """See SpatialHolder."""
        return self.framed(system, place, np.eye(3))

    def framed(self, system: System, place: Place, axes: Array) -> Any:
        """See SpatialHolder."""
        frame = np.eye(4)
        frame[:3, :3] = axes
        return system.add("MarkerNodeRigid", nodeNumber=self.side(place).node, localHT=frame)

    def side(self, place: Place) -> Side:
        """See SpatialHolder."""
        node = place[0] / self.size
        if abs(node - round(node)) > 1e-9 or any(place[1:]):
            raise InputError(
                f"joints: engine exudyn-ge holds rods in space at nodes of their axes, found every {self.size:g} m, "
                f"not at [{', '.join(f'{x:g}' for x in place)}]"
            )
        return Side(self.nodes[round(node)], 7)

    def start_axes(self, place: Place) -> Array:
        """Axes of the section at a node at the start as columns, (3, 3)."""
        return np.asarray(self.begin[round(place[0] / self.size)])

    def motion(self, q: Array, v: Array, place: Place) -> Any:
        """See Part; between two nodes the strain is that of the element."""
        index, xi = self.find(place)
        here, speed = (x[:, self.columns[index]] for x in (q, v))
        part = (1 + xi) / 2
        first = _frames(here[:, :7])
        away = RigidTransform.from_exp_coords(part * (first.inv() * _frames(here[:, 7:])).as_exp_coords())
        position = (first * away).translation
        axes = (first * away).rotation.as_matrix()
        # Rates between nodes are told to second order in the length of the element, as its masses are.
        velocity = (1 - part) * speed[:, :3] + part * speed[:, 7:10]
        spins = (spin_of(here[:, 3:7], speed[:, 3:7]), spin_of(here[:, 10:], speed[:, 10:]))
        spin = (1 - part) * spins[0] + part * spins[1]
        return SpatialPointMotion(position, velocity, axes, np.cross(spin[:, :, None], axes, axis=1))

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        here, speed = (x[:, self.columns].reshape(len(q), len(self.elements), 14) for x in (q, v))
        strain = _strain(here.reshape(-1, 14), self.size).reshape(*here.shape[:2], 6) - self.rest
        elastic = np.sum(strain**2 * self.stiffness, axis=(1, 2)) * self.size / 2
        spins = [np.einsum("reij,rej->rei", local_rates(here[..., k : k + 4]), speed[..., k : k + 4]) for k in (3, 10)]
        mass = self.sections.mass[:, None]
        moved = _product(speed[..., :3], speed[..., 7:10]) * mass
        kinetic = np.sum(moved, axis=(1, 2)) + np.sum(_product(*spins) * self.inertia, axis=(1, 2))
        middle = np.sum(mass * (here[..., :3] + here[..., 7:10]) / 2, axis=1)
        return Energy(kinetic * self.size / 2, elastic, middle * self.size)


def spin_of(turn: Array, rate: Array) -> Array:
    """Angular velocity [rad/s] along the axes of the ground, of Euler parameters and their rates (rows, 4)."""
    axes, turning = rotation(turn), np.einsum("rijk,rk->rij", rotation_slope(turn), rate)
    return np.asarray(0.5 * np.sum(np.cross(axes, turning, axis=1), axis=2))


@dataclass(frozen=True)
class _Begin:
    """A section at the start: place [m], axes, velocity [m/s] and angular velocity [rad/s] along the ground's axes."""

    place: Array
    axes: Rotation
    speed: Array
    spin: Array


def _start(placement: SpatialPlacement, name: str, s: float, q: Array, v: Array) -> _Begin:
    """A section of the native machine at its start, where rods are unstrained."""
    scene, frame, at = placement.scene, placement.frames[name], Attachment(body=name, point=(s, 0.0, 0.0))
    assert isinstance(frame, BeamFrame)
    body = placement.attitudes.rotation(name)[:, :, 0]
    planned = body @ section(scene, Attachment(body=name, point=(0.0, 0.0, 0.0)))[:, :, 0]
    _, slope, *others = frame.nodes[0]
    told, known = [slope], [planned[:, 0]]
    if (director := frame.element.director) is not None:
        told, known = [slope, others[0]], [planned[:, 0], planned[:, director]]
    seen = [one.at(q) for one in told]
    turn, _ = Rotation.align_vectors(np.array(seen), np.array(known))
    axes = turn * Rotation.from_matrix(body @ section(scene, at)[:, :, 0])
    own = placement.attitudes.spin(name)[:, 0] @ seen[0]
    if director is not None:
        # What the director turns beside the tangent is about the axis of the rod.
        third = np.cross(seen[0], seen[1])
        own = (others[0].rate(v) - np.cross(np.cross(seen[0], slope.rate(v)), seen[1])) @ third
    point, direction = placement.point(scene, at), frame.direction((s, 0.0, 0.0))
    tangent = turns.unit(direction.at(q)[:, None])[:, 0]
    spin = np.cross(tangent, direction.rate(v)) + tangent * own
    return _Begin(point.at(q), axes, point.rate(v), spin)


def _frames(q: Array) -> RigidTransform:
    """Frames of nodes from their coordinates (rows, 7); those of the ground after a failure, where there are none."""
    size = np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    known = np.all(np.isfinite(q), axis=1, keepdims=True) & (size > 0)
    q = np.where(known, q, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    return RigidTransform.from_components(q[:, :3], Rotation.from_quat(q[:, 3:7], scalar_first=True))


def _strain(q: Array, length: float) -> Array:
    """Stretch, shears, twist and curvatures of elements with the coordinates q (rows, 14), (rows, 6)."""
    moved = (_frames(q[:, :7]).inv() * _frames(q[:, 7:])).as_exp_coords() / length
    return np.roll(moved, 3, axis=1)


def _product(one: Array, other: Array) -> Array:
    """Twice the mean along an element of the square of what changes linearly from one value to another."""
    return np.asarray((one**2 + one * other + other**2) / 3)


def _moments(rod: Rod, section: Section) -> Array:
    """Polar second moment and those about y and z of every element [m^4], (elements, 3)."""
    about_z, about_y = section.bending, section.side
    return np.stack([one * np.ones(rod.elements) for one in (about_z + about_y, about_y, about_z)], axis=1)


def _inertia(rod: Rod, sections: Sections) -> Array:
    return np.asarray(sections.density * _moments(rod, sections.heavy))


def _stiffness(rod: Rod, sections: Sections) -> Array:
    shear_modulus = rod.modulus / (2 * (1 + rod.poisson_ratio))
    torsion = sections.section.torsion if rod.torsion_constant is None else rod.torsion_constant
    twist = shear_modulus * torsion * np.ones(rod.elements)
    bending = rod.modulus * _moments(rod, sections.section)[:, 1:]
    return np.column_stack([sections.axial, sections.shear, sections.shear, twist, bending])


def _section(mass: float, inertia: Array, stiffness: Array) -> Any:
    """Exudyn's description of a section."""
    data = importlib.import_module("exudyn").BeamSection()
    data.massPerLength, data.inertia = mass, np.diag(inertia)
    data.stiffnessMatrix = np.diag(stiffness)
    return data
