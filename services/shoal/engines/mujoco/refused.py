"""Features of scenes that MuJoCo's format MJCF has no counterpart of."""

from __future__ import annotations

from shoal.errors import InputError
from shoal.scene import (
    Cylindrical,
    Distance,
    Force,
    Planar,
    Revolute,
    Scene,
    Slider,
    Spherical,
    Spring,
    Torque,
    TorsionSpring,
    Universal,
    Weld,
)

JOINTS = (Revolute, Spherical, Universal, Slider, Cylindrical, Planar, Weld, Distance)
LOADS = (Spring, TorsionSpring, Force, Torque)
"""Kinds that have a counterpart in MJCF."""


def require_counterparts(scene: Scene, *, soft: bool = False) -> None:
    """Raises InputError that names a feature of a scene without a counterpart, of those seen without its tree.

    soft: whether stops, ropes and contacts are accepted, as ones that give way
    """
    for name, body in scene.bodies.items():
        if name == "world":
            raise InputError("bodies.world: MJCF calls the ground so; give the body another name")
        if body.element != "rigid":
            raise InputError(f"bodies.{name}.element: MJCF has no {body.element}; rigid bodies only")
    if scene.initial_from is not None:
        raise InputError("initial.from: MJCF states a start; it has neither statics nor other runs")
    for name in scene.ground_points:
        raise InputError(f"ground_points.{name}: MJCF has no functions of time")
    for name in () if soft else scene.contacts:
        raise InputError(f"contacts.{name}: not written as MJCF; there contacts give way, and its friction creeps")
    for name, joint in scene.joints.items():
        if getattr(joint, "play", None) is not None:
            raise InputError(f"joints.{name}.play: not written as MJCF; there contacts give way, and friction creeps")
        if joint.kind == "gear":
            raise InputError(f"joints.{name}: a gear is not written as MJCF; there its teeth would give way")
        if not isinstance(joint, JOINTS):
            raise InputError(f"joints.{name}: MJCF has no {joint.kind}")
        if isinstance(joint, Revolute | Slider) and joint.share:
            raise InputError(f"joints.{name}.mu: MJCF has no friction by the force of a joint")
        if isinstance(joint, Revolute | Slider) and joint.drag:
            raise InputError(f"joints.{name}.drag: MJCF has no quadratic drag of a joint")
        if isinstance(joint, Revolute | Slider) and joint.stops is not None and not soft:
            raise InputError(f"joints.{name}.stops: not written as MJCF; there its limits would give way")
        if isinstance(joint, Distance) and joint.keeps != "exactly" and not soft:
            raise InputError(f"joints.{name}.keeps: not written as MJCF; there a limit of a length would give way")
        if isinstance(joint, Distance) and joint.length is not None and joint.length.number is None:
            raise InputError(f"joints.{name}.length: MJCF has no functions of time")
    for name, load in scene.loads.items():
        where = f"loads.{name}"
        if not isinstance(load, LOADS):
            raise InputError(f"{where}: MJCF has no {load.kind}")
        if isinstance(load, TorsionSpring) and (load.first_to or load.second_to):
            raise InputError(f"{where}: MJCF has no springs between directions from place to place")
        for key in ("cubic", "elastic"):
            if getattr(load, key, None):
                raise InputError(f"{where}.{key}: MJCF has linear springs only")
        for key in ("scale", "torque"):
            if (f := getattr(load, key, None)) is not None and f.number is None:
                raise InputError(f"{where}.{key}: MJCF has no functions of time")
