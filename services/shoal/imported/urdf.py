"""URDF as MuJoCo reads it, without the files of shapes that carry no mass, and what the format leaves open."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shoal.errors import InputError
from shoal.imported.markup import XmlElement

_WORLD = "world"
_BOM = b"\xef\xbb\xbf"


class _Robot:
    """The links of a file, and which are fixed together."""

    def __init__(self, root: XmlElement) -> None:
        self.links = {link.attributes.get("name", ""): link for link in root.named("link")}
        self.joints = list(root.named("joint"))
        self.sides = [(_side(joint, "parent"), _side(joint, "child")) for joint in self.joints]
        held = {child for _, child in self.sides}
        self.roots = [name for name in self.links if name not in held and name != _WORLD]
        self.on_ground = self.fixed_to(_WORLD, *self.roots)

    def fixed_to(self, *names: str) -> set[str]:
        """Return links and what is fixed to them, directly or by others."""
        found, waiting = set[str](), [*names]
        while waiting:
            found.add(name := waiting.pop())
            for joint, (parent, child) in zip(self.joints, self.sides, strict=True):
                if parent == name and joint.attributes.get("type") == "fixed" and child not in found:
                    waiting.append(child)
        return found

    def states_mass(self, name: str) -> bool:
        """Return whether a link has an <inertial>."""
        return name in self.links and any(self.links[name].named("inertial"))

    def has_mass(self, name: str) -> bool:
        """Return whether a link has an <inertial>, or shapes from which MuJoCo infers a mass."""
        return name in self.links and any(self.links[name].named("inertial", "collision"))


def urdf_spec(mujoco: Any, file: Path, written: bytes, root: XmlElement) -> tuple[Any, list[str]]:
    """Return a MjSpec of a URDF file, and notes on what was assumed.

    written: the bytes of the file; root: their XML. Raises InputError, and ValueError where MuJoCo refuses it.
    """
    robot = _Robot(root)
    _check(file, root, robot)
    spec = mujoco.MjSpec.from_string(_needed(written, robot, root).removeprefix(_BOM).decode())
    spec.modelfiledir = str(file.parent)
    for body in spec.bodies[1:]:
        # A link that is fixed to another becomes part of it; its frame stays to be seen.
        if not list(body.joints) and body.name not in robot.on_ground:
            body.add_site(name=body.name)
    return spec, [*_roots(robot), *_shapes(robot)]


def _side(joint: XmlElement, side: str) -> str:
    """Return the link that a joint names as its parent or child."""
    return next((one.attributes.get("link", "") for one in joint.named(side)), "")


def _needed(text: bytes, robot: _Robot, root: XmlElement) -> bytes:
    """Return a file without shapes that carry no mass, and with the link `world` where joints name it, as Drake allows.

    The lines that MuJoCo's messages name stay those of the file.
    """
    for name, link in robot.links.items():
        masses = not robot.states_mass(name) and name not in robot.on_ground
        for shape in link.named("visual", *([] if masses else ["collision"])):
            blank = bytes(mark if mark == ord("\n") else ord(" ") for mark in text[shape.begin : shape.end])
            text = text[: shape.begin] + blank + text[shape.end :]
    if _WORLD not in robot.links and any(parent == _WORLD for parent, _ in robot.sides):
        inside = root.children[0].begin
        text = text[:inside] + b'<link name="world"/>' + text[inside:]
    return text


def _check(file: Path, root: XmlElement, robot: _Robot) -> None:
    """Refuse what MuJoCo would misread, or name by numbers of its own."""
    for element in root.walk():
        if element.tag.startswith("xacro:"):
            raise InputError(f"{file}: {element}: a macro of xacro; write the file out first (xacro FILE > FILE.urdf)")
    for joint, sides in zip(robot.joints, robot.sides, strict=True):
        if unknown := next((name for name in sides if name not in robot.links and name != _WORLD), None):
            raise InputError(f"{file}: {joint}: no link {unknown!r}; there are {', '.join(robot.links)[:200]}")
        child = sides[1]
        moves = joint.attributes.get("type") != "fixed"
        if moves and child in robot.links and not any(map(robot.has_mass, robot.fixed_to(child))):
            raise InputError(f"{file}: {robot.links[child]}: moves and has no mass; give it an <inertial>")


def _roots(robot: _Robot) -> list[str]:
    """Return a note for each link with mass that no joint holds: URDF does not say whether the ground does."""
    found = []
    for name in robot.roots:
        link = robot.links[name]
        mass = next((one.attributes.get("value", "") for i in link.named("inertial") for one in i.named("mass")), "")
        if mass:
            free = f'<joint name="..." type="floating"><parent link="world"/><child link="{name}"/></joint>'
            found.append(f"{link}: the root, with {mass} kg, is fixed to the ground; to free it add {free}")
    return found


def _shapes(robot: _Robot) -> list[str]:
    """Return a note for each moving link whose mass follows from its shapes."""
    return [
        f"{link}: no <inertial>; its mass is that of its collision shapes at 1000 kg/m^3, as MuJoCo assumes"
        for name, link in robot.links.items()
        if name not in robot.on_ground and robot.has_mass(name) and not robot.states_mass(name)
    ]
