"""Contacts as MuJoCo's pairs of spheres and planes, which give way: springs with dampers that push and do not pull."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shoal.engines.mujoco.limits import SpringDamper
from shoal.errors import InputError
from shoal.scene import GROUND, Scene
from shoal.scene.contacts import Contact, ContactSurface

POINT = 1e-6
"""Radius of the sphere that stands for a point, over the size of the machine: MuJoCo has none without radius."""


class Pair(NamedTuple):
    """A contact of two surfaces, the first one round. spring: that stands for it; mu: of friction [1]"""

    name: str
    first: ContactSurface
    second: ContactSurface
    spring: SpringDamper
    mu: float

    @property
    def attributes(self) -> dict[str, str]:
        """Return the attributes of MJCF."""
        rubs = {"condim": "3", "friction": f"{self.mu!r} {self.mu!r} 0 0 0"} if self.mu else {"condim": "1"}
        return {"geom1": f"{self.name}-first", "geom2": f"{self.name}-second", **rubs, **self.spring.attributes("")}


def pairs(scene: Scene) -> list[Pair]:
    """Return the contacts of a scene. Raises InputError for what MuJoCo has no counterpart of."""
    return [_pair(scene, name, contact) for name, contact in scene.contacts.items()]


def _pair(scene: Scene, name: str, contact: Contact) -> Pair:
    first, second = contact.first, contact.second
    for field, found in (
        ("rolling", contact.rolling),
        ("tangential_restitution", contact.tangential_restitution),
        ("mu_static", contact.mu_static is not None and contact.mu_static != contact.mu),
        ("law", contact.law is not None),
        ("first.axis", first.axis is not None),
        ("second.hole", second.hole is not None),
        (f"second.{second.shape}", second.shape in ("line", "plane") and second.body != GROUND),
    ):
        if found:
            more = " on a body" if field == f"second.{second.shape}" else ""
            raise InputError(f"contacts.{name}.{field}: contacts of MuJoCo have no counterpart of it{more}; use gauss")
    return Pair(name, first, second, SpringDamper.of(contact.restitution, scene.solver.step), float(np.max(contact.mu)))
