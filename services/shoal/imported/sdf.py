"""SDF (of Gazebo) as URDF: the same links and joints, with a joint's frame in its child besides, which URDF lacks.

Poses are of links in their model, and of joints in their child, unless `relative_to` names another link. Links that no
joint holds float. Nested and included models, frames, and joints of two axes are refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.errors import InputError
from shoal.imported.markup import XmlElement
from shoal.imported.rounding import Array
from shoal.imported.urdf import Pose

_TYPES = {
    "revolute": "revolute",
    "continuous": "continuous",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "ball": "ball",
}
_KNOWN = (
    *(
        "sdf",
        "world",
        "model",
        "static",
        "link",
        "pose",
        "inertial",
        "mass",
        "inertia",
        "ixx",
        "iyy",
        "izz",
        "ixy",
        "ixz",
    ),
    *(
        "iyz",
        "joint",
        "parent",
        "child",
        "axis",
        "xyz",
        "use_parent_model_frame",
        "limit",
        "lower",
        "upper",
        "dynamics",
    ),
    *("damping", "friction"),
)
_REFUSED = ("include", "model", "frame")


def as_urdf(file: Path, root: XmlElement) -> XmlElement:
    """Return the only model of a file as the XML of URDF. Raises InputError that names what that has not."""
    models = [one for part in [root, *root.named("world")] for one in part.named("model")]
    if len(models) != 1:
        raise InputError(f"{file}: has {len(models)} models; import one of a file of its own")
    (model,) = models
    for one in model.children:
        if one.tag in _REFUSED:
            raise InputError(f"{file}: {one}: nested and included models and frames are not read")
    model_pose = _pose(file, model)
    links = {link.attributes.get("name", ""): link for link in model.named("link")}
    poses = {name: model_pose.then(_pose(file, link)) for name, link in links.items()}
    for name, link in links.items():
        if (other := _relative(link)) is not None:
            if other not in links or _relative(links[other]) is not None:
                raise InputError(f"{file}: {link}: pose: relative_to: must be a link with a pose in the model")
            poses[name] = poses[other].then(_pose(file, link))
    joints = [_joint(file, joint, poses) for joint in model.named("joint")]
    static = (_text(model, "static") or "").strip() in ("true", "1")
    held = {_value(joint, "child") for joint in joints}
    for name in links:
        if name not in held and name != "world":
            kind = "fixed" if static else "floating"
            base = _made("joint", {"name": f"{name}-base", "type": kind}, model)
            base.children = [_side("parent", "world"), _side("child", name), _origin("origin", poses[name])]
            joints.append(base)
    robot = _made("robot", {"name": model.attributes.get("name", "model")}, model)
    robot.children = [*(_link(file, name, link) for name, link in links.items()), *joints, *_others(root)]
    return robot


def _others(element: XmlElement) -> Iterator[XmlElement]:
    """Yield what is not translated, so that the audit lists it as unknown; zeros say nothing."""
    for child in element.children:
        if child.tag in _KNOWN:
            yield from _others(child)
        elif child.children or child.text.strip() not in ("", "0", "0.0", "-1", "1"):
            yield child


def _joint(file: Path, joint: XmlElement, poses: dict[str, Pose]) -> XmlElement:
    """Return a joint with its frame in the parent, and in the child."""
    kind = joint.attributes.get("type", "")
    if kind not in _TYPES:
        raise InputError(f"{file}: {joint}: type: must be one of {', '.join(_TYPES)}, found {kind[:40]!r}")
    parent, child = ((_text(joint, side) or "").strip() for side in ("parent", "child"))
    for name in (parent, child):
        if name not in poses and name != "world":
            raise InputError(f"{file}: {joint}: no link {name!r}; there are {', '.join(poses)[:200]}")
    if child == "world":
        raise InputError(f"{file}: {joint}: child: the ground hangs on nothing; let it be the parent")
    base = poses[other] if (other := _relative(joint)) in poses else poses[child]
    frame = base.then(_pose(file, joint))
    within = poses[child].inverse.then(frame)
    ahead = frame if parent == "world" else poses[parent].inverse.then(frame)
    made = _made("joint", {"name": joint.attributes.get("name", ""), "type": kind}, joint)
    made.children = [
        _side("parent", parent),
        _side("child", child),
        _origin("origin", ahead),
        _origin("within", within),
    ]
    axis = next(joint.named("axis"), None)
    if axis is None or kind in ("fixed", "ball"):
        return made
    way = next(axis.named("xyz"), None)
    along = _numbers(file, way, 3) if way is not None else np.array([0.0, 0.0, 1.0])
    seen = (way.attributes.get("expressed_in", "") if way is not None else "") or (
        "__model__" if (_text(axis, "use_parent_model_frame") or "").strip() in ("true", "1") else ""
    )
    if seen:
        if seen not in poses and seen != "__model__":
            raise InputError(f"{file}: {way}: expressed_in: no link {seen!r}")
        along = frame.turn.T @ (poses[seen].turn @ along if seen in poses else along)
    made.children.append(_made("axis", {"xyz": _words(along)}, axis))
    for part, words in (("limit", ("lower", "upper")), ("dynamics", ("damping", "friction"))):
        if (stated := next(axis.named(part), None)) is not None:
            values = {word: text.strip() for word in words if (text := _text(stated, word)) is not None}
            if part == "dynamics" or all(abs(float(value)) < 1e15 for value in values.values()):
                made.children.append(_made(part, values, stated))
    return made


def _link(file: Path, name: str, link: XmlElement) -> XmlElement:
    """Return a link with its mass; without an <inertial> it has none here, where Gazebo assumes 1 kg."""
    made = _made("link", {"name": name}, link)
    inertial = next(link.named("inertial"), None)
    mass, moments = {"value": "1"}, dict.fromkeys(("ixx", "iyy", "izz"), "1")
    pose = Pose()
    if inertial is not None:
        pose = _pose(file, inertial)
        mass = {"value": (_text(inertial, "mass") or "1").strip()}
        if (stated := next(inertial.named("inertia"), None)) is not None:
            moments = {one.tag: one.text.strip() for one in stated.children}
    part = _made("inertial", {}, inertial or link)
    part.children = [_origin("origin", pose), _made("mass", mass, link), _made("inertia", moments, link)]
    made.children = [part]
    return made


def _pose(file: Path, element: XmlElement) -> Pose:
    """Return the pose that an element states: x, y, z [m] and angles about the fixed axes [rad]."""
    stated = next(element.named("pose"), None)
    if stated is None or not stated.text.strip():
        return Pose()
    numbers = _numbers(file, stated, 6)
    angles = np.radians(numbers[3:]) if stated.attributes.get("degrees") in ("true", "1") else numbers[3:]
    return Pose(Rotation.from_euler("xyz", angles).as_matrix(), numbers[:3])


def _numbers(file: Path, element: XmlElement, count: int) -> Array:
    try:
        found = np.array([float(word) for word in element.text.split()])
    except ValueError:
        found = np.zeros(0)
    if len(found) != count or not np.all(np.isfinite(found)):
        raise InputError(f"{file}: {element}: must be {count} numbers, found {element.text.strip()[:40]!r}")
    return found


def _relative(element: XmlElement) -> str | None:
    """Return the link that a pose is relative to, if it names one."""
    return next((one.attributes.get("relative_to") or None for one in element.named("pose")), None)


def _text(element: XmlElement, tag: str) -> str | None:
    return next((one.text for one in element.named(tag)), None)


def _value(joint: XmlElement, side: str) -> str:
    return next(one.attributes["link"] for one in joint.named(side))


def _made(tag: str, attributes: dict[str, str], source: XmlElement) -> XmlElement:
    return XmlElement(tag, attributes, source.line, source.file)


def _side(tag: str, link: str) -> XmlElement:
    return XmlElement(tag, {"link": link})


def _origin(tag: str, pose: Pose) -> XmlElement:
    angles = Rotation.from_matrix(pose.turn).as_euler("xyz")
    return XmlElement(tag, {"xyz": _words(pose.place), "rpy": _words(angles)})


def _words(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
