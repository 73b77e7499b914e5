"""A scene of rigid bodies as MJCF, MuJoCo's own format. The engine runs this text, and `shoal export` writes it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.engines.capabilities import check_acceleration
from shoal.engines.mujoco.contacts import POINT, pairs
from shoal.engines.mujoco.limits import Limit, SpringDamper, limit_of, limit_of_length, start_of_hinges
from shoal.engines.mujoco.links import Freedom, LinkTree, TreeLink, local, where
from shoal.engines.mujoco.refused import require_counterparts
from shoal.engines.tree.scene import started
from shoal.errors import InputError
from shoal.mechanics.assembly.masses import second_moments
from shoal.mechanics.reach import span
from shoal.scene import (
    GROUND,
    Attachment,
    Distance,
    Force,
    ModalBody,
    PointMass,
    Revolute,
    Rod,
    Scene,
    Slider,
    Spherical,
    Spring,
    Torque,
    TorsionSpring,
    Weld,
)
from shoal.scene.contacts import ContactSurface
from shoal.scene.dimensions import padded
from shoal.scene.sections import Tube

THINNEST = 1e-14
"""Of mass times size squared: the least moment of inertia, of which MuJoCo needs one about every axis."""
LEAST = 2e-15
"""The same [kg m^2]: MuJoCo refuses 1e-15."""
STIFF = 2.0
"""Time constant of a soft constraint, in steps: the least that MuJoCo takes."""
START = "start"
"""The keyframe with the rates of the start, which MJCF has no other place for."""


class Mjcf:
    """A scene as MJCF at its start. Raises InputError that names what MJCF has not.

    text: the file; rates: of MuJoCo's joints at the start; soft: joints and the like that its soft constraints keep
    """

    def __init__(self, scene: Scene, *, soft: bool = False) -> None:
        """soft: whether stops, ropes and contacts are written, as ones that give way."""
        check_acceleration(scene)
        require_counterparts(scene, soft=soft)
        self.scene = scene
        self.pairs = pairs(scene)
        self.springs: dict[str, SpringDamper] = {f"contacts.{one.name}": one.spring for one in self.pairs}
        limited = any(getattr(joint, "stops", None) is not None for joint in scene.joints.values())
        self._hinges = start_of_hinges(scene) if limited else {}
        self._size = span(scene)
        self._begin, self._axis, self.initial = started(scene)
        self.soft: list[str] = []
        self.rates: list[float] = []
        self._sites: dict[str, list[tuple[str, Any]]] = {}
        self._springs: dict[str, list[tuple[float, float, float]]] = {}
        links = list(LinkTree(scene, self._begin, self._axis).links())
        self._hung = {link.joint: link for link in links if link.joint}
        parts = self._tendons_and_actuators()
        for name, at in scene.markers.items():
            self._site(name, at)
        root = _element("mujoco", model=scene.name)
        said = f"{scene.description.rstrip('.')}. " if scene.description else ""
        root.append(ElementTree.Comment(f" {said}SI units, at its start. Written by Shoal. ".replace("--", "- -")))
        _under(root, "compiler", angle="radian", autolimits="false")
        options = {
            "gravity": _numbers(padded(scene.gravity, 3)),
            "timestep": repr(scene.solver.step),
            "iterations": "200",
        }
        # An elliptic cone, and friction so much stiffer than the normal force: what sticks creeps least.
        cone = {"cone": "elliptic", "impratio": "10"} if self.pairs else {}
        option = _under(root, "option", **options, **cone, integrator="RK4", tolerance="1e-14")
        _under(option, "flag", contact="enable" if self.pairs else "disable", energy="enable")
        world = _under(root, "worldbody")
        self._grow(world, GROUND, links)
        for part, entries in parts.items():
            if entries:
                element = _under(root, part)
                if part == "equality":
                    element.append(ElementTree.Comment(" constraints of MuJoCo are soft: these give way a little "))
                element.extend(entries)
        if any(self.rates):
            keys = _under(root, "keyframe")
            keys.append(ElementTree.Comment(" load this one: the rates of the start have no other place "))
            _under(keys, "key", name=START, qvel=_numbers(self.rates))
        ElementTree.indent(root)
        self.text = ElementTree.tostring(root, encoding="unicode") + "\n"

    def _grow(self, element: ElementTree.Element, body: str, links: list[TreeLink]) -> None:
        """The sites of a body and the bodies that hang on it."""
        begin = self._begin[body]
        for name, place in self._sites.get(body, []):
            _under(element, "site", name=name, pos=_numbers(place))
        for one in self.pairs:
            for side, surface in (("first", one.first), ("second", one.second)):
                if surface.body == body:
                    self._surface(element, f"{one.name}-{side}", surface)
        for link in links:
            if link.parent != body:
                continue
            own = self._begin[link.name]
            turn = Rotation.from_matrix(begin.axes.T @ own.axes)
            child = _under(
                element, "body", name=link.name, pos=_numbers(begin.back(own.origin)), quat=_quaternion(turn)
            )
            self._inertia(child, link.name)
            for number, freedom in enumerate(link.freedoms):
                self._joint(child, link, number, freedom)
            self._shapes(child, link.name)
            self._grow(child, link.name, links)

    def _surface(self, element: ElementTree.Element, name: str, surface: ContactSurface) -> None:
        """A sphere or a plane that touches nothing but in its pair."""
        options = {"name": name, "pos": _numbers(local(self.scene, surface)), "contype": "0", "conaffinity": "0",
                   "mass": "0"}  # fmt: skip
        if surface.shape == "round":
            radius = surface.radius or POINT * self._size
            _under(element, "geom", type="sphere", size=repr(float(radius)), **options)
            return
        if surface.line is None:
            normal = self._axis(surface, surface.plane)
        else:
            normal = np.array([-np.sin(surface.line), np.cos(surface.line), 0.0])
        _under(element, "geom", type="plane", size="1 1 1", zaxis=_numbers(normal), **options)

    def _inertia(self, element: ElementTree.Element, name: str) -> None:
        body = self.scene.bodies[name]
        least = max(THINNEST * body.mass * self._size**2, LEAST)
        centre, turn = (0.0, 0.0, 0.0), Rotation.identity()
        if isinstance(body, PointMass):
            moments = np.full(3, least)
        else:
            assert not isinstance(body, ModalBody)
            second = np.array(second_moments(body), dtype=float)
            centre, inertia = padded(body.centre_of_mass, 3), np.trace(second) * np.eye(3) - second
            if self.scene.dimensions == 2:
                moments = np.full(3, max(inertia[2, 2], least))
            else:
                moments, axes = np.linalg.eigh(inertia)
                axes[:, 2] *= np.linalg.det(axes)
                turn, moments = Rotation.from_matrix(axes), moments + (least if moments[0] < least else 0.0)
        options = {"pos": _numbers(centre), "mass": repr(float(body.mass)), "diaginertia": _numbers(moments)}
        _under(element, "inertial", **options, quat=_quaternion(turn))

    def _joint(self, element: ElementTree.Element, link: TreeLink, number: int, freedom: Freedom) -> None:
        kind, axis = freedom
        own, parent = self._begin[link.name], self._begin[link.parent]
        turning = own.spin - parent.spin
        name = link.joint or f"{link.name}-free"
        name += "" if number == 0 else f"-{number + 1}"
        if kind == "free":
            _under(element, "freejoint", name=name)
            self.rates += [*own.velocity, *(own.axes.T @ own.spin)]
            return
        options = {"name": name, "type": kind, "pos": _numbers(own.back(link.place))}
        if kind != "ball":
            options["axis"] = _numbers(own.axes.T @ axis)
        joint: Any = self.scene.joints.get(link.joint)
        if (kind == "hinge" and isinstance(joint, Revolute)) or (kind == "slide" and isinstance(joint, Slider)):
            options |= self._forces(link, joint)
            if joint.stops is not None:
                limit = self._limit(link, joint, axis)
                self.springs[f"joints.{link.joint}.stops"] = limit.spring
                options |= limit.attributes
        _under(element, "joint", **options)
        speed = own.speed(link.place) - parent.speed(link.place)
        self.rates += {"slide": [speed @ axis], "hinge": [turning @ axis], "ball": [*(own.axes.T @ turning)]}[kind]

    def _forces(self, link: TreeLink, joint: Any) -> dict[str, str]:
        """Friction of a joint, and the torsion springs that act in it."""
        springs = self._springs.get(link.joint, [])
        stiffness = sum(spring[0] for spring in springs)
        moment = sum(spring[0] * spring[2] for spring in springs)
        found = {
            "damping": joint.friction + sum(spring[1] for spring in springs),
            "frictionloss": joint.coulomb,
            "armature": joint.armature,
            "stiffness": stiffness,
            "springref": moment / stiffness if stiffness else 0.0,
        }
        sticking = {"solreffriction": self._stiff()["solref"]} if joint.coulomb else {}
        return {name: repr(float(value)) for name, value in found.items() if value} | sticking

    def _limit(self, link: TreeLink, joint: Revolute | Slider, axis: Any) -> Limit:
        """Return the limit that stands for the stops of a joint."""
        assert joint.stops is not None
        if isinstance(joint, Revolute):
            start = self._hinges[link.joint]
        else:
            first, second = (where(self.scene, self._begin, side) for side in (joint.first, joint.second))
            start = float((second - first) @ axis)
        return limit_of(joint.stops, start, 1.0 if link.name == joint.second.body else -1.0, self.scene.solver.step)

    def _shapes(self, element: ElementTree.Element, name: str) -> None:
        """Add the visible geometry of a body: a rod's cuboid, or lines from the centre to its points."""
        body, seen = self.scene.bodies[name], {"contype": "0", "conaffinity": "0", "mass": "0"}
        if isinstance(body, Rod) and not body.curvature:
            section = body.section_at(0.5)
            middle = _numbers([body.length / 2, 0.0, 0.0])
            if isinstance(section, Tube):
                size, axis = [section.height / 2, body.length / 2], _numbers([0.0, np.pi / 2, 0.0])
                _under(element, "geom", type="cylinder", pos=middle, euler=axis, size=_numbers(size), **seen)
            else:
                size = [body.length / 2, section.height / 2, section.width / 2]
                _under(element, "geom", type="box", pos=middle, size=_numbers(size), **seen)
            return
        thick = repr(0.01 * self._size)
        if isinstance(body, PointMass):
            _under(element, "geom", type="sphere", size=thick, **seen)
            return
        centre = np.array(padded(body.centre_of_mass, 3), dtype=float)
        places = [local(self.scene, at) for at in self._attached(name)]
        for place in {tuple(place): place for place in places}.values():
            if np.linalg.norm(place - centre) > 1e-9 * self._size:
                ends = _numbers([*centre, *place])
                _under(element, "geom", type="capsule", fromto=ends, size=thick, **seen)

    def _attached(self, body: str) -> Iterator[Attachment]:
        items = [*self.scene.joints.values(), *self.scene.loads.values()]
        sides = (getattr(item, side, None) for item in items for side in ("first", "second", "at"))
        yield from (at for at in (*sides, *self.scene.markers.values()) if at is not None and at.body == body)

    def _tendons_and_actuators(self) -> dict[str, list[ElementTree.Element]]:
        """Return the elements outside of the tree: loads, and joints that close loops."""
        found: dict[str, list[ElementTree.Element]] = {"tendon": [], "equality": [], "actuator": [],
                                                   "contact": []}  # fmt: skip
        found["contact"] += [_element("pair", name=one.name, **one.attributes) for one in self.pairs]
        for name, load in self.scene.loads.items():
            if isinstance(load, Spring):
                rest = self._apart(load.first, load.second) if load.length is None else load.length
                more = {"stiffness": load.stiffness, "damping": load.damping, "springlength": rest}
                found["tendon"].append(self._tendon(name, load.first, load.second, more))
            elif isinstance(load, TorsionSpring):
                self._spiral(name, load)
            else:
                assert isinstance(load, Force | Torque)
                found["actuator"].append(self._push(name, load))
        for name, joint in self.scene.joints.items():
            if name in self._hung:
                continue
            if isinstance(joint, Distance) and joint.keeps != "exactly":
                found["tendon"].append(self._rope(name, joint))
                continue
            self.soft.append(f"joints.{name}")
            assert not isinstance(joint, list)
            if isinstance(joint, Distance):
                found["tendon"].append(self._tendon(name, joint.first, joint.second, {}))
                found["equality"].append(_element("tendon", name=name, tendon1=name, **self._stiff()))
            else:
                found["equality"] += self._closing(name, joint)
        return found

    def _rope(self, name: str, joint: Distance) -> ElementTree.Element:
        """A rope or a strut: the limit of a length."""
        length = self._apart(joint.first, joint.second) if joint.length is None else float(joint.length.number or 0.0)
        limit = limit_of_length(joint, length, self.scene.solver.step)
        self.springs[f"joints.{name}"] = limit.spring
        tendon = self._tendon(name, joint.first, joint.second, {})
        tendon.attrib.update(limit.attributes)
        return tendon

    def _closing(self, name: str, joint: Any) -> Iterator[ElementTree.Element]:
        """A joint that closes a loop, by constraints."""
        bodies = {"body1": _called(joint.first.body), "body2": _called(joint.second.body)}
        masses = any(isinstance(self.scene.bodies.get(side.body), PointMass) for side in (joint.first, joint.second))
        if getattr(joint, "friction", 0.0) or getattr(joint, "coulomb", 0.0):
            raise InputError(f"joints.{name}.friction: MJCF has none in a joint that closes a loop")
        if isinstance(joint, Weld) and not masses:
            anchor = _numbers(local(self.scene, joint.second))
            yield _element("weld", name=name, **bodies, anchor=anchor, **self._stiff())
        elif isinstance(joint, Revolute | Spherical | Weld):
            place = where(self.scene, self._begin, joint.first)
            places = [place]
            if isinstance(joint, Revolute) and self.scene.dimensions == 3 and not masses:
                places.append(place + 0.2 * self._size * self._axis(joint.first, joint.axis))
            for number, one in enumerate(places):
                anchor = _numbers(self._begin[joint.first.body].back(one))
                own = name if number == 0 else f"{name}-{number + 1}"
                yield _element("connect", name=own, **bodies, anchor=anchor, **self._stiff())
        else:
            raise InputError(f"joints.{name}: closes a loop, as in MJCF only revolute, spherical and weld joints can")

    def _stiff(self) -> dict[str, str]:
        return {"solref": _numbers([STIFF * self.scene.solver.step, 1.0]), "solimp": "0.9999 0.9999 0.001 0.5 2"}

    def _tendon(self, name: str, first: Attachment, second: Attachment, more: dict[str, float]) -> ElementTree.Element:
        tendon = _element("spatial", name=name, **{key: repr(float(value)) for key, value in more.items()})
        for end, at in (("first", first), ("second", second)):
            _under(tendon, "site", site=self._site(f"{name}-{end}", at))
        return tendon

    def _spiral(self, name: str, load: TorsionSpring) -> None:
        """A torsion spring in the joint that has its axis. Raises InputError where there is none."""
        flat = self.scene.dimensions == 2
        for joint, link in self._hung.items():
            sides = [load.first.body, load.second.body]
            if sorted(sides) != sorted((link.parent, link.name)) or [kind for kind, _ in link.freedoms] != ["hinge"]:
                continue
            axis = link.freedoms[0][1]
            about = axis if flat else self._axis(load.first, load.axis)
            if np.linalg.norm(np.cross(axis, about)) > 1e-9:
                continue
            away = 0.0
            if load.angle is not None:
                if not flat:
                    raise InputError(f"loads.{name}.angle: MJCF's springs of machines in space rest at the start")
                begin = [self._angle(side) for side in sides]
                away = (load.angle - (begin[1] - begin[0])) * (1.0 if link.name == load.second.body else -1.0)
            self._springs.setdefault(joint, []).append((load.stiffness, load.damping, away))
            return
        raise InputError(f"loads.{name}: MJCF has torsion springs in revolute joints only, about their axis")

    def _angle(self, body: str) -> float:
        """The angle of a body in the plane at the start, over full turns [rad]."""
        return 0.0 if body == GROUND else float(self.initial[body].angle or 0.0)

    def _push(self, name: str, load: Force | Torque) -> ElementTree.Element:
        """A constant force or torque, by an actuator that nothing controls."""
        options = {"name": name, "site": self._site(name + "-at", load.at)}
        if isinstance(load, Force):
            size = float(load.scale.number or 0.0)
            gear = [*padded(load.force, 3), 0.0, 0.0, 0.0]
            if not load.follows:
                options["refsite"] = self._site(name + "-from", Attachment(body=GROUND, point=(0.0, 0.0, 0.0)))
        else:
            size = float(load.torque.number or 0.0)
            holder = load.reaction or Attachment(body=GROUND, point=(0.0, 0.0, 0.0))
            options["refsite"] = self._site(name + "-from", holder)
            axis = np.array([0.0, 0.0, 1.0]) if self.scene.dimensions == 2 else self._axis(holder, load.axis)
            gear = [0.0, 0.0, 0.0, *(self._begin[holder.body].axes.T @ axis)]
        return _element("general", **options, gear=_numbers(gear), biastype="affine", gainprm="0", biasprm=repr(size))

    def _site(self, name: str, at: Attachment) -> str:
        """A place under a name, which no other has."""
        taken = {known for sites in self._sites.values() for known, _ in sites}
        while name in taken:
            name += "-"
        self._sites.setdefault(at.body, []).append((name, local(self.scene, at)))
        return name

    def _apart(self, first: Attachment, second: Attachment) -> float:
        return float(np.linalg.norm(where(self.scene, self._begin, second) - where(self.scene, self._begin, first)))


def _element(tag: str, **attributes: str) -> ElementTree.Element:
    return ElementTree.Element(tag, attributes)


def _under(parent: ElementTree.Element, tag: str, **attributes: str) -> ElementTree.Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _called(body: str) -> str:
    return "world" if body == GROUND else body


def _numbers(values: Any) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)


def _quaternion(turn: Rotation) -> str:
    return _numbers(turn.as_quat(scalar_first=True))
