"""What a user states: bodies, joints, loads, markers, initial state, gravity and solver settings, in SI units."""

from shoal.scene.bodies import Body, PointMass, RigidBody, Rod
from shoal.scene.function import Function
from shoal.scene.joints import (
    GROUND,
    JOINT_KINDS,
    Attachment,
    Coupling,
    Distance,
    DrivenAngle,
    Joint,
    MovingPoint,
    Parallel,
    Perpendicular,
    Revolute,
    Slider,
    Weld,
)
from shoal.scene.load import load_scene, scene_names
from shoal.scene.loads import LOAD_KINDS, DistributedForce, Force, Load, Spring, Torque, TorsionSpring
from shoal.scene.scene import InitialState, Scene
from shoal.scene.solver import Solver

__all__ = [
    "GROUND",
    "JOINT_KINDS",
    "LOAD_KINDS",
    "Attachment",
    "Body",
    "Coupling",
    "Distance",
    "DistributedForce",
    "DrivenAngle",
    "Force",
    "Function",
    "InitialState",
    "Joint",
    "Load",
    "MovingPoint",
    "Parallel",
    "Perpendicular",
    "PointMass",
    "Revolute",
    "RigidBody",
    "Rod",
    "Scene",
    "Slider",
    "Solver",
    "Spring",
    "Torque",
    "TorsionSpring",
    "Weld",
    "load_scene",
    "scene_names",
]
