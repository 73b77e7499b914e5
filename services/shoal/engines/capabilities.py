"""What every engine can do, what a scene needs, and the one line that refuses a scene that needs more."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from shoal.engines.contract import Capabilities
from shoal.errors import InputError
from shoal.scene import (
    GROUND,
    JOINT_KINDS,
    LOAD_KINDS,
    Coupling,
    Distance,
    Function,
    PointMass,
    Revolute,
    Rod,
    Scene,
    Slider,
    Spring,
    TorsionSpring,
)
from shoal.scene.bodies import Element
from shoal.scene.joints import Joint, places
from shoal.scene.loads import Load

FEATURES = (
    "point masses",
    "free bodies",
    "closed loops",
    "moving ground points",
    "functions of time",
    "varying distances",
    "dry friction",
    "nonlinear springs",
    "curved flexible rods",
    "tapered flexible rods",
    "damped flexible rods",
)

_EXUDYN = Capabilities(
    elements=frozenset({"rigid", "ancf-cable"}),
    joints=frozenset(JOINT_KINDS) - {"coupling"},
    loads=frozenset(LOAD_KINDS),
    features=frozenset(FEATURES) - {"varying distances"},
    lanes=False,
)

CAPABILITIES = {
    "gauss": Capabilities(
        elements=frozenset(get_args(Element)),
        joints=frozenset(JOINT_KINDS),
        loads=frozenset(LOAD_KINDS),
        features=frozenset(FEATURES),
        lanes=True,
    ),
    "exudyn": _EXUDYN,
    "exudyn-ge": Capabilities(
        elements=_EXUDYN.elements,
        joints=_EXUDYN.joints,
        loads=_EXUDYN.loads,
        features=_EXUDYN.features - {"curved flexible rods", "damped flexible rods"},
        lanes=False,
    ),
    "casadi": Capabilities(
        elements=frozenset({"rigid", "ancf-cable"}),
        joints=frozenset({"revolute"}),
        loads=frozenset(LOAD_KINDS),
        features=frozenset({"point masses", "dry friction", "tapered flexible rods"}),
        lanes=False,
    ),
}


def needs(scene: Scene) -> Iterator[tuple[str, str]]:
    """What a scene needs: the field that asks for it, and the kind or feature."""
    for name, body in scene.bodies.items():
        where = f"bodies.{name}"
        yield f"{where}.element", body.element
        if isinstance(body, PointMass):
            yield where, "point masses"
        if isinstance(body, Rod) and body.element != "rigid":
            if body.curvature:
                yield f"{where}.curvature", "curved flexible rods"
            if body.tapered:
                yield where, "tapered flexible rods"
            if body.retardation:
                yield f"{where}.retardation", "damped flexible rods"
        if scene.start(name).position is not None:
            yield f"initial.{name}.position", "free bodies"
    for name in scene.ground_points:
        yield f"ground_points.{name}", "moving ground points"
    for name, joint in scene.joints.items():
        yield f"joints.{name}", joint.kind
        yield from ((f"joints.{name}.{field}", need) for field, need in _joint_needs(joint))
    yield from ((f"joints.{name}", "closed loops") for name in loops(scene))
    for name, load in scene.loads.items():
        yield f"loads.{name}", load.kind
        yield from ((f"loads.{name}.{field}", need) for field, need in _load_needs(load))


def _joint_needs(joint: Joint) -> Iterator[tuple[str, str]]:
    if isinstance(joint, Revolute | Slider) and joint.coulomb:
        yield "coulomb", "dry friction"
    if isinstance(joint, Distance) and joint.length is not None and joint.length.number is None:
        yield "length", "varying distances"
    if isinstance(joint, Coupling) and joint.value.number is None:
        yield "value", "functions of time"


def _load_needs(load: Load) -> Iterator[tuple[str, str]]:
    if isinstance(load, Spring | TorsionSpring) and load.elastic is not None:
        yield "elastic", "nonlinear springs"
    for field in ("scale", "torque"):
        value = getattr(load, field, None)
        if isinstance(value, Function) and value.number is None:
            yield field, "functions of time"


def loops(scene: Scene) -> Iterator[str]:
    """Names of the joints that close a loop, in the order of the scene."""
    group = {name: name for name in (GROUND, *scene.bodies)}
    for name, joint in scene.joints.items():
        joined = {group[side.body] for side in places(joint)}
        if len(joined) == 1:
            yield name
        first = min(joined)
        group = {body: first if owner in joined else owner for body, owner in group.items()}


def require(engine: str, scene: Scene) -> None:
    """Raises InputError, one line, where a scene needs more than the engine can do."""
    able = CAPABILITIES[engine].all
    for field, need in needs(scene):
        if need not in able:
            wanted = {what for _, what in needs(scene)}
            others = [name for name, other in CAPABILITIES.items() if wanted <= other.all]
            raise InputError(f"{field}: engine {engine} cannot do {need}; use {' or '.join(others)}")
