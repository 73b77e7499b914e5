"""The tree of a scene's bodies, of which MJCF consists: each hangs on another by a joint, or is free."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.engines.tree.scene import BodyStart
from shoal.scene import GROUND, Attachment, Distance, PointMass, Revolute, Scene, Slider, Spherical, Weld
from shoal.scene.dimensions import padded
from shoal.scene.joints import Cylindrical, Planar, Universal
from shoal.trajectory import Array

Freedom = tuple[str, Array]
"""slide, hinge or ball, and its axis (3,) at the start."""


@dataclass
class TreeLink:
    """A body, what it hangs on, and how: by a joint of the scene from a place of the parent, or free."""

    name: str
    parent: str
    joint: str = ""
    freedoms: list[Freedom] = field(default_factory=list)
    place: Array = field(default_factory=lambda: np.zeros(3))
    """Of the joint at the start [m]."""


class LinkTree:
    """The links of a scene at its start.

    begin: how each body begins; axis: of a joint at one of its places, from there and what the scene states of it
    """

    def __init__(self, scene: Scene, begin: Mapping[str, BodyStart], axis: Callable[..., Array]) -> None:
        self._scene, self._begin, self._axis = scene, begin, axis

    def links(self) -> Iterator[TreeLink]:
        """Bodies from the ground outwards; what MuJoCo's constraints can close as well is cut first."""
        joints: dict[str, Any] = {name: joint for name, joint in self._scene.joints.items() if self._hangs(joint)}
        order = sorted(joints, key=lambda name: isinstance(joints[name], Revolute | Spherical | Weld))
        group = {name: name for name in (GROUND, *self._scene.bodies)}
        tree: dict[str, list[str]] = {name: [] for name in group}
        for name in order:
            first, second = (group[side.body] for side in (joints[name].first, joints[name].second))
            if first != second:
                group = {body: second if owner == first else owner for body, owner in group.items()}
                for side in (joints[name].first, joints[name].second):
                    tree[side.body].append(name)
        reached: set[str] = set()
        for root in (GROUND, *self._scene.bodies):
            if root in reached:
                continue
            if root != GROUND:
                yield self._free(root)
            waiting = [root]
            reached.add(root)
            while waiting:
                parent = waiting.pop(0)
                for name in tree[parent]:
                    sides = joints[name].first, joints[name].second
                    child = sides[1] if sides[0].body == parent else sides[0]
                    if child.body not in reached:
                        yield self._hang(name, parent, child)
                        reached.add(child.body)
                        waiting.append(child.body)

    def _hangs(self, joint: Any) -> bool:
        """Return whether a body may hang on another by a joint."""
        sides = (getattr(joint, "first", None), getattr(joint, "second", None))
        masses = any(side is None or isinstance(self._scene.bodies.get(side.body), PointMass) for side in sides)
        return not (masses or isinstance(joint, Distance))

    def _free(self, body: str) -> TreeLink:
        begin, flat = self._begin[body], self._scene.dimensions == 2
        if isinstance(self._scene.bodies[body], PointMass):
            return TreeLink(body, GROUND, "", [("slide", axis) for axis in np.eye(3)[: 2 if flat else 3]], begin.origin)
        if flat:
            freedoms = [("slide", np.eye(3)[0]), ("slide", np.eye(3)[1]), ("hinge", np.eye(3)[2])]
            return TreeLink(body, GROUND, "", freedoms, begin.origin)
        return TreeLink(body, GROUND, "", [("free", np.zeros(3))], begin.origin)

    def _hang(self, name: str, parent: str, child: Attachment) -> TreeLink:
        joint: Any = self._scene.joints[name]
        freedoms = list(self._freedoms(name, joint))
        if joint.first.body != parent:
            freedoms.reverse()
        # Where the second place slides on a line or a plane of the first body, turns are about the second one.
        turned = joint.second if isinstance(joint, Slider | Cylindrical | Planar) else child
        return TreeLink(child.body, parent, name, freedoms, where(self._scene, self._begin, turned))

    def _freedoms(self, name: str, joint: Any) -> Iterator[Freedom]:
        """From the first body to the second."""
        z, flat = np.array([0.0, 0.0, 1.0]), self._scene.dimensions == 2
        turn: Freedom = ("hinge", z) if flat else ("ball", z)
        if isinstance(joint, Revolute):
            yield "hinge", self._axis(joint.first, joint.axis)
        elif isinstance(joint, Spherical):
            yield "ball", z
        elif isinstance(joint, Universal):
            yield "hinge", self._axis(joint.first, joint.axis)
            yield "hinge", self._axis(joint.second, joint.second_axis)
        elif isinstance(joint, Slider):
            if joint.axis is None:
                line = np.array([np.cos(joint.direction), np.sin(joint.direction), 0.0])
                yield "slide", self._begin[joint.first.body].axes @ line
            else:
                yield "slide", self._axis(joint.first, joint.axis)
            if joint.rotation == "free":
                yield turn
        elif isinstance(joint, Cylindrical):
            axis = self._axis(joint.first, joint.axis)
            yield from (("slide", axis), ("hinge", axis))
        elif isinstance(joint, Planar):
            axis = self._axis(joint.first, joint.axis)
            across = np.linalg.svd(axis[None])[2][1:]
            yield from (("slide", one) for one in across)
            if joint.rotation != "locked":
                yield ("hinge", axis) if joint.rotation == "axis" else turn
        else:
            assert isinstance(joint, Weld), name


def local(scene: Scene, at: Attachment) -> Array:
    """A place in the coordinates of its body [m], (3,)."""
    place = at.point if at.body == GROUND else scene.location(at)
    return np.array([float(x) for x in padded(place, 3)])


def where(scene: Scene, begin: Mapping[str, BodyStart], at: Attachment) -> Array:
    """A place at the start [m], (3,)."""
    return begin[at.body].point(local(scene, at))
