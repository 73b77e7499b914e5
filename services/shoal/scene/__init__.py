"""What a user states: bodies, joints, markers, initial state, gravity and solver settings, in SI units."""

from shoal.scene.bodies import Body, RigidBody, Rod
from shoal.scene.joints import GROUND, Attachment, Joint, Revolute
from shoal.scene.load import load_scene, scene_names
from shoal.scene.scene import InitialState, Scene
from shoal.scene.solver import Solver

__all__ = [
    "GROUND",
    "Attachment",
    "Body",
    "InitialState",
    "Joint",
    "Revolute",
    "RigidBody",
    "Rod",
    "Scene",
    "Solver",
    "load_scene",
    "scene_names",
]
