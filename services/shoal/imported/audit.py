"""Audit of a file against what is translated: elements and attributes of its XML that a scene has no place for.

The tables name what MuJoCo compiles and the importer translates, or reports from the compiled model with the values
that defaults and flags leave it (limits, armature, actuators, contacts, sensors). Everything else of a file is listed,
whether MuJoCo knows it or passes over it, as over unknown elements of URDF.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from shoal.imported.markup import XmlElement

Known = Mapping[str, frozenset[str] | None]
"""Attributes that are translated, by tag or by parent/tag; None of elements that are accounted for with all inside."""


def _of(words: str) -> frozenset[str]:
    return frozenset(words.split())


_WHOLE = None
_POSE = "pos quat axisangle xyaxes zaxis euler"
_OPTIONS: Known = {
    "compiler": _of(
        "autolimits boundmass boundinertia settotalmass balanceinertia strippath coordinate angle fitaabb eulerseq "
        "meshdir texturedir discardvisual usethread fusestatic inertiafromgeom inertiagrouprange saveinertial assetdir "
        "alignfree conflict"
    ),
    "option": _of("gravity density viscosity actuatorgroupdisable"),
    "flag": _of("constraint equality frictionloss limit contact spring damper gravity actuation"),
}
_TENDON = _of("name class limited range springlength stiffness damping frictionloss armature springyield")
_EQUALITY = "name class active "
MJCF: Known = {
    **_OPTIONS,
    "mujoco": _of("model"),
    "mujocoinclude": _of("model"),
    "default": _of("class"),
    **dict.fromkeys(("asset", "worldbody", "deformable", "contact", "tendon", "equality", "keyframe"), frozenset()),
    **dict.fromkeys(("mesh", "hfield", "replicate", "attach", "inertial", "composite", "flexcomp"), _WHOLE),
    **dict.fromkeys(("actuator", "sensor", "camera", "light", "key", "pair", "flex", "plugin", "extension"), _WHOLE),
    # Defaults of actuators.
    **dict.fromkeys(("general", "motor", "position", "velocity", "intvelocity", "orientation", "pid"), _WHOLE),
    **dict.fromkeys(("damper", "cylinder", "muscle", "adhesion", "dcmotor"), _WHOLE),
    "model": _of("name file content_type"),
    "frame": _of(f"name childclass {_POSE}"),
    "body": _of(f"name childclass mocap gravcomp {_POSE}"),
    "joint": _of(
        "name class type pos axis springdamper limited range stiffness ref springref springyield armature damping "
        "frictionloss"
    ),
    "freejoint": _of("name align"),
    "geom": _of(
        f"name class type contype conaffinity size mass density shellinertia fromto mesh fitscale hfield {_POSE} "
        "friction condim priority"
    ),
    "site": _of(f"name class fromto {_POSE}"),
    "spatial": _TENDON,
    "fixed": _TENDON,
    "default/tendon": _TENDON,
    "default/equality": _of("active"),
    "default/mesh": _WHOLE,
    **dict.fromkeys(("spatial/site", "spatial/geom", "spatial/pulley", "fixed/joint"), _WHOLE),
    "connect": _of(_EQUALITY + "body1 body2 anchor site1 site2"),
    "weld": _of(_EQUALITY + "body1 body2 anchor relpose site1 site2 torquescale"),
    "equality/joint": _of(_EQUALITY + "joint1 joint2 polycoef"),
    "equality/tendon": _of(_EQUALITY + "tendon1 tendon2 polycoef"),
    "contact/exclude": _of("name class body1 body2"),
    "equality/flex": _WHOLE,
    "flexvert": _WHOLE,
    "flexstrain": _WHOLE,
}
URDF: Known = {
    "option": _OPTIONS["option"],
    "flag": _OPTIONS["flag"],
    "robot": _of("name"),
    "robot/mujoco": frozenset(),
    "robot/link": _of("name"),
    "link/inertial": frozenset(),
    "inertial/origin": _of("xyz rpy"),
    "inertial/mass": _of("value"),
    "inertial/inertia": _of("ixx ixy ixz iyy iyz izz"),
    "robot/joint": _of("name type"),
    "joint/origin": _of("xyz rpy"),
    "joint/within": _of("xyz rpy"),
    "joint/parent": _of("link"),
    "joint/child": _of("link"),
    "joint/axis": _of("xyz"),
    "joint/dynamics": _of("damping friction"),
    "joint/limit": _of("lower upper"),
    "joint/mimic": _of("joint multiplier offset"),
    "robot/loop_joint": _WHOLE,
}
_OF_TYPES = {
    "joint/axis": ("revolute", "continuous", "prismatic", "planar"),
    "joint/limit": ("revolute", "prismatic"),
    "joint/dynamics": ("revolute", "continuous", "prismatic", "planar", "floating", "spherical"),
}
"""Types of URDF's joints that have such an element; MuJoCo passes over it in others."""
_CARRY_NOTHING = ("transmission", "collision_filter_group", "ros2_control", "disable_collisions", "sensor", "material")
"""Elements beside links and joints that name several and hold none together: drives, sensors, pairs without contact."""
_REASONS = {
    "collision": "shapes of URDF are no contacts",
    **dict.fromkeys(("visual", "material", "texture", "skin"), "drawn only"),
}


def unread(root: XmlElement, known: Known) -> Iterator[str]:
    """Yield a line for each tag with attributes that are not translated, and for each tag of elements that are not."""
    attributes: dict[str, dict[str, list[XmlElement]]] = {}
    for parent, element in _pairs(root, known):
        for name in element.attributes:
            if name not in (_allowed(parent, element, known) or ()) and not name.startswith("xmlns"):
                attributes.setdefault(element.tag, {}).setdefault(name, []).append(element)
    for tag, names in attributes.items():
        counted = (f"{len(names[name])} x {name}" if len(names[name]) > 1 else name for name in sorted(names))
        first = min(element.line for having in names.values() for element in having)
        yield f"<{tag}>: {', '.join(counted)} (from line {first})"
    elements: dict[str, list[XmlElement]] = {}
    for element in unknown(root, known):
        elements.setdefault(element.tag, []).append(element)
    for tag, found in elements.items():
        where = "in" if len(found) == 1 else "from"
        why = f"; {_REASONS[tag]}" if tag in _REASONS else ""
        yield f"<{tag}>: {len(found)} ({where} line {found[0].line}){why}"


def unknown(root: XmlElement, known: Known) -> Iterator[XmlElement]:
    """Yield the elements that the tables do not have, without those inside them."""
    for _, element in _pairs(root, known):
        yield from (child for child in element.children if _is_unknown(element, child, known))


def constraints(root: XmlElement) -> Iterator[str]:
    """Yield a line for each unknown element of a URDF file that joins links: without it other motions are possible."""
    links = {link.attributes.get("name", "") for link in root.named("link")}
    for element in unknown(root, URDF):
        if element.tag.split(":")[-1] in _CARRY_NOTHING:
            continue
        inside = list(element.walk())
        if element.tag == "gazebo":
            joins = any(
                "mimic" in one.tag.lower() or {"parent", "child"} <= {child.tag for child in one.children}
                for one in inside
            )
            named = set[str]()
        else:
            named = links & {word for one in inside for word in _words([*one.attributes.values(), one.text])}
            joins = len(named) > 1 or element.tag.lower().endswith("joint")
        if joins:
            yield f"{element}" + (f", which joins {' and '.join(sorted(named))}" if len(named) > 1 else "")


def _words(texts: Iterable[str]) -> Iterator[str]:
    for text in texts:
        yield from (text.strip(), *re.split(r"[\s,:]+", text))


def _allowed(parent: XmlElement | None, element: XmlElement, known: Known) -> frozenset[str] | None:
    key = f"{parent.tag if parent is not None else ''}/{element.tag}"
    return known[key] if key in known else known.get(element.tag)


def _is_unknown(parent: XmlElement, element: XmlElement, known: Known) -> bool:
    key, kind = f"{parent.tag}/{element.tag}", parent.attributes.get("type", "")
    if key in _OF_TYPES and kind not in _OF_TYPES[key]:
        return True
    return key not in known and element.tag not in known


def _pairs(root: XmlElement, known: Known) -> Iterator[tuple[XmlElement | None, XmlElement]]:
    """Yield the elements that the tables have attributes of, each with its parent."""
    waiting: list[tuple[XmlElement | None, XmlElement]] = [(None, root)]
    while waiting:
        parent, element = waiting.pop(0)
        if _allowed(parent, element, known) is None:
            continue
        yield parent, element
        waiting += [(element, child) for child in element.children if not _is_unknown(element, child, known)]
