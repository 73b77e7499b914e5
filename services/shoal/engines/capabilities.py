"""Requirements of a scene, and the message that refuses a scene whose requirements an engine does not meet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TypeVar

from shoal.engines.contract import Engine
from shoal.engines.known import ENGINES
from shoal.errors import InputError
from shoal.scene import GROUND, Coupling, Function, Joint, Load, PointMass, Rod, Scene, SignalFunction
from shoal.scene.joints import Rope, places
from shoal.scene.signals import depends_on_time, sampled_parts

T = TypeVar("T")
FEATURES = (
    "machines in space",
    "point masses",
    "free bodies",
    "closed loops",
    "closed rods",
    "moving ground points",
    "starts at rest",
    "starts at the end of a run",
    "functions of time",
    "signals",
    "states",
    "sampled signals",
    "varying distances",
    "dry friction",
    "quadratic drag",
    "friction by joint forces",
    "nonlinear springs",
    "angles of places",
    "curved flexible rods",
    "curved rods in space",
    "tapered flexible rods",
    "damped flexible rods",
    "damped rods in space",
    "stops",
    "one-sided distances",
    "exact stick",
    "contacts",
    "polygons",
    "cams",
    "corners of polygons",
    "play",
    "backlash",
    "armature",
)
_FIELDS = {
    "coulomb": "dry friction",
    "drag": "quadratic drag",
    "mu": "friction by joint forces",
    "stops": "stops",
    "play": "play",
    "backlash": "backlash",
    "armature": "armature",
    "first_to": "angles of places",
    "second_to": "angles of places",
}
"""Fields of joints and loads that need more than their kind where they are given."""
_LAWS = {"elastic": "nonlinear springs", "length": "varying distances"}
"""Fields whose functions need more than functions of time."""


def needs(scene: Scene) -> Iterator[tuple[str, str]]:
    """Yield the requirements of a scene: the field that states each, and the kind or feature."""
    if scene.dimensions == 3:
        yield "dimensions", "machines in space"
    for name, body in scene.bodies.items():
        where = f"bodies.{name}"
        yield f"{where}.element", body.element
        if isinstance(body, PointMass):
            yield where, "point masses"
        if isinstance(body, Rod) and body.element != "rigid":
            spatial = scene.dimensions == 3
            if not body.straight:
                bent = next(field for field in ("curvature", "side_curvature", "twist") if getattr(body, field))
                yield f"{where}.{bent}", "curved rods in space" if spatial else "curved flexible rods"
            if body.tapered:
                yield where, "tapered flexible rods"
            if body.retardation:
                yield f"{where}.retardation", "damped rods in space" if spatial else "damped flexible rods"
        if scene.start(name).position is not None:
            yield f"initial.{name}.position", "free bodies"
    if scene.starts_at_rest:
        yield "initial.from", "starts at rest"
    elif scene.initial_from is not None:
        yield "initial.from", "starts at the end of a run"
    for name in scene.ground_points:
        yield f"ground_points.{name}", "moving ground points"
    for name, joint in scene.joints.items():
        yield from _item(f"joints.{name}", joint)
        if not isinstance(joint, Coupling | Rope) and joint.first.body == joint.second.body:
            yield f"joints.{name}", "closed rods"
    yield from ((f"joints.{name}", "closed loops") for name in loops(scene))
    for name, contact in scene.contacts.items():
        yield f"contacts.{name}", "contacts"
        if contact.second.shape in ("polygon", "cam"):
            yield f"contacts.{name}.second.{contact.second.shape}", f"{contact.second.shape}s"
        if contact.first.polygon is not None:
            yield f"contacts.{name}.first.polygon", "corners of polygons"
    for name, load in scene.loads.items():
        yield from _item(f"loads.{name}", load)
        for field, value in load:
            if isinstance(value, SignalFunction) and not value.of_time and depends_on_time(scene, value):
                yield f"loads.{name}.{field}", "functions of time"
    yield from ((f"states.{name}", "states") for name in scene.states)
    for name in sampled_parts(scene):
        yield f"{'states' if name in scene.states else 'signals'}.{name}", "sampled signals"


def _item(where: str, item: Joint | Load) -> Iterator[tuple[str, str]]:
    """The kind of a joint or a load, and what its fields need beyond that."""
    # A rope or a strut is no bar.
    one_sided = getattr(item, "keeps", "exactly") != "exactly" and not isinstance(item, Rope)
    yield (f"{where}.keeps", "one-sided distances") if one_sided else (where, item.kind)
    for field, value in item:
        if field == "stick" and value == "exact":
            yield f"{where}.stick", "exact stick"
        if field in _FIELDS and value:
            yield f"{where}.{field}", _FIELDS[field]
        if isinstance(value, SignalFunction) and not value.of_time:
            yield f"{where}.{field}", "signals"
        elif isinstance(value, Function) and (value.number is None or field == "elastic"):
            yield f"{where}.{field}", _LAWS.get(field, "functions of time")


def loops(scene: Scene) -> Iterator[str]:
    """Names of the joints that close a loop, in the order of the scene."""
    group = {name: name for name in (GROUND, *scene.bodies)}
    for name, joint in scene.joints.items():
        joined = {group[side.body] for side in places(joint)}
        if len(joined) <= 1:
            yield name
        if not joined:  # a coupling of measures
            continue
        first = min(joined)
        group = {body: first if owner in joined else owner for body, owner in group.items()}


def require(engine: Engine, scene: Scene) -> None:
    """Raises InputError, one line, where a scene needs more than the engine can do."""
    check_acceleration(scene)
    known = engine.capabilities.all
    for field, need in needs(scene):
        if need not in known:
            others = able(scene)
            use = f"; use {' or '.join(others)}" if others else ""
            raise InputError(f"{field}: engine {engine.name} cannot do {need}{use}")


def able(scene: Scene, names: Iterable[str] | None = None) -> list[str]:
    """Those engines, or all that there are, which can do all that a scene needs."""
    wanted = {need for _, need in needs(scene)}
    return [name for name in (ENGINES if names is None else names) if wanted <= ENGINES[name]().capabilities.all]


def check_acceleration(scene: Scene) -> None:
    """Raises InputError for a way to the acceleration that neither the mechanics nor the swarms have."""
    from shoal.mechanics.least.principle import METHODS
    from shoal.swarm import OPTIMIZERS

    known = (*METHODS, *OPTIMIZERS)
    if (name := scene.solver.acceleration) not in known:
        raise InputError(f"solver.acceleration: no way {name!r}; there are {', '.join(known)}")


def is_moved_by_swarm(scene: Scene) -> bool:
    """Return whether `solver.acceleration` names a swarm, which seeks every acceleration."""
    from shoal.swarm import OPTIMIZERS

    return scene.solver.acceleration in OPTIMIZERS


def of_kind(table: Mapping[str, T], kind: str, where: str) -> T:
    """Return the entry for a kind that a field names. Raises InputError for a kind without an entry."""
    if kind not in table:
        raise InputError(f"{where}: {kind} is not among {', '.join(table)}")
    return table[kind]
