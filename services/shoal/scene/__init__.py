"""The scene of a user: bodies, joints, loads, markers, initial state, gravity and solver settings, in SI units."""

from shoal.scene.bodies import FRAMED, Body, Rod
from shoal.scene.contacts import Contact, ContactSurface
from shoal.scene.function import Function, SignalFunction
from shoal.scene.initial import InitialState
from shoal.scene.joints import (
    GROUND,
    JOINT_KINDS,
    Attachment,
    Coupling,
    Cylindrical,
    Distance,
    DrivenAngle,
    Gear,
    Joint,
    MovingPoint,
    Parallel,
    Perpendicular,
    Planar,
    Resisted,
    Revolute,
    Slider,
    Spherical,
    Universal,
    Weld,
)
from shoal.scene.load import load_scene, scene_names
from shoal.scene.loads import LOAD_KINDS, Bushing, DistributedForce, Force, Load, Spring, Thrust, Torque, TorsionSpring
from shoal.scene.scene import Scene
from shoal.scene.solids import ModalBody, PointMass, RigidBody
from shoal.scene.solver import Solver

__all__ = [
    "FRAMED",
    "GROUND",
    "JOINT_KINDS",
    "LOAD_KINDS",
    "Attachment",
    "Body",
    "Bushing",
    "Contact",
    "ContactSurface",
    "Coupling",
    "Cylindrical",
    "Distance",
    "DistributedForce",
    "DrivenAngle",
    "Force",
    "Function",
    "Gear",
    "InitialState",
    "Joint",
    "Load",
    "ModalBody",
    "MovingPoint",
    "Parallel",
    "Perpendicular",
    "Planar",
    "PointMass",
    "Resisted",
    "Revolute",
    "RigidBody",
    "Rod",
    "Scene",
    "SignalFunction",
    "Slider",
    "Solver",
    "Spherical",
    "Spring",
    "Thrust",
    "Torque",
    "TorsionSpring",
    "Universal",
    "Weld",
    "load_scene",
    "scene_names",
]
