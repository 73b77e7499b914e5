"""Machines in space drawn at random: open and closed, rigid and flexible, stiffness over four decades.

Poses are drawn, and loops close at the places where the ends of chains then are, so that every start is possible.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
from shoal.scene import Rod, Scene

Random = np.random.Generator
GROUND = {"body": "ground", "point": [0.0, 0.0, 0.0]}
STURDY = ("revolute", "spherical", "universal", "slider", "cylindrical")
CLOSING = ("spherical", "universal", "revolute", "distance", "planar", "slider")
FLEXIBLE = ("spherical", "weld")
"""What holds a flexible rod, whose section does not turn."""


def machine(seed: int) -> Scene:
    """The machine of a seed: a chain of one to four bodies from the ground, which may close at its end."""
    rng = np.random.default_rng(seed)
    flexible, closed = bool(rng.random() < 0.45), bool(rng.random() < 0.4)
    if closed and not flexible and rng.random() < 0.3:
        return _tilted_linkage(seed, rng)
    count = int(rng.integers(2 if closed else 1, 4 if flexible else 5))
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    initial: dict[str, Any] = {}
    place, before, bends = np.zeros(3), GROUND, False
    for k in range(count):
        name, turn = f"B{k}", Rotation.random(random_state=int(rng.integers(2**31)))
        bending = flexible and (k == 0 or rng.random() < 0.6)
        bodies[name], tip = _rod(rng) if bending else _link(rng)
        kinds = FLEXIBLE if bending and not bends else ("spherical",) if bending or bends else STURDY
        joints[f"J{k}"] = _joint(rng, str(rng.choice(kinds)), before, {"body": name})
        initial[name] = {"rotation": turn.as_rotvec().tolist()}
        place = place + turn.apply(tip)
        before, bends = {"body": name, "point": "end"}, bending
    if closed:
        end = {"body": "ground", "point": place.tolist()}
        kind = str(rng.choice(("spherical", "planar"))) if bends else str(rng.choice(CLOSING))
        if kind == "distance":
            end["point"] = (place + rng.normal(size=3)).tolist()
        joints["end"] = _joint(rng, kind, end, before, point=bends)
    elif rng.random() < 0.5 and not bends:
        initial["B0"]["spin"] = rng.normal(scale=3.0, size=3).tolist() if joints["J0"]["kind"] == "spherical" else None
    initial = {name: {key: x for key, x in one.items() if x is not None} for name, one in initial.items()}
    return _scene(seed, bodies, joints, initial, _loads(rng, before))


def with_directors(scene: Scene) -> Scene:
    """The same machine with director rods: their square sections, which nothing twists, bend as cables do."""
    rods = [name for name, body in scene.bodies.items() if isinstance(body, Rod)]
    return scene.with_values({f"bodies.{name}.element": "director-rod" for name in rods})


def bent(seed: int) -> Scene:
    """One or two director rods, curved and twisted at rest, clamped or on balls, a body between them or at the end."""
    rng = np.random.default_rng(seed)
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    initial: dict[str, Any] = {}
    before = GROUND
    for k in range(int(rng.integers(1, 4))):
        name, turn = f"B{k}", Rotation.random(random_state=int(rng.integers(2**31)))
        bends = k != 1
        bodies[name], _ = _strip(rng) if bends else _link(rng)
        kind = str(rng.choice(("weld", "weld", "spherical")))
        joints[f"J{k}"] = _joint(rng, kind, before, {"body": name})
        initial[name] = {"rotation": turn.as_rotvec().tolist()}
        before = {"body": name, "point": "end"}
    return _scene(seed, bodies, joints, initial, _loads(rng, before))


def frame(seed: int) -> Scene:
    """Two or three director rods, straight or bent and twisted at rest, that are welded or hinged to each other."""
    rng = np.random.default_rng(seed)
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    initial: dict[str, Any] = {}
    before = GROUND
    for k in range(int(rng.integers(2, 4))):
        name, turn = f"B{k}", Rotation.random(random_state=int(rng.integers(2**31)))
        if rng.random() < 0.4:  # a right angle, as most frames have
            turn = Rotation.from_rotvec(np.pi / 2 * np.eye(3)[int(rng.integers(3))])
        bodies[name], _ = _strip(rng)
        if rng.random() < 0.5:
            bodies[name] |= {"curvature": [], "side_curvature": [], "twist": []}
        kind = str(rng.choice(("weld", "weld", "revolute"))) if k else "weld"
        joint = _joint(rng, kind, before, {"body": name})
        joints[f"J{k}"] = {
            field: value for field, value in joint.items() if field in ("kind", "first", "second", "axis")
        }
        initial[name] = {"rotation": turn.as_rotvec().tolist()}
        before = {"body": name, "point": "end"}
    return _scene(seed, bodies, joints, initial, _loads(rng, before))


def _strip(rng: Random) -> tuple[dict[str, Any], Any]:
    """A flat director rod, curved about both axes by up to a radian and twisted by up to two."""
    rod, end = _rod(rng)
    turns = rng.uniform(-1.0, 1.0, 3) / rod["length"]
    shape = {"curvature": [turns[0]], "side_curvature": [turns[1]], "twist": [2 * turns[2]]}
    rod |= {"element": "director-rod", "width": float(rod["height"] * rng.uniform(1.0, 3.0))}
    return rod | {"elements": int(rng.integers(4, 9))} | shape, end


def _link(rng: Random) -> tuple[dict[str, Any], Any]:
    """A rigid body of any inertia, and where its end is."""
    a, b = rng.uniform(0.01, 0.1, 2)
    turn = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    inertia = turn @ np.diag([a, b, rng.uniform(max(abs(a - b), 0.01), a + b)]) @ turn.T
    end = rng.normal(scale=0.4, size=3)
    mass = float(10 ** rng.uniform(-0.5, 0.7))
    body = {
        "kind": "rigid-body",
        "mass": mass,
        "inertia": ((inertia + inertia.T) / 2).tolist(),
        "centre_of_mass": rng.normal(scale=0.2, size=3).tolist(),
        "named_points": {"end": end.tolist()},
    }
    return body, end


def _rod(rng: Random) -> tuple[dict[str, Any], Any]:
    """A flexible rod of a square section."""
    length, size = float(rng.uniform(0.4, 1.2)), float(rng.uniform(0.008, 0.02))
    element = str(rng.choice(("ancf-cable", "ancf-quintic")))
    rod = {"kind": "rod", "length": length, "height": size, "width": size, "density": 2700.0, "element": element,
           "youngs_modulus": float(10 ** rng.uniform(7, 11)), "elements": int(rng.integers(1, 5))}  # fmt: skip
    return rod, np.array([length, 0.0, 0.0])


def _joint(rng: Random, kind: str, first: Any, second: Any, *, point: bool = False) -> dict[str, Any]:
    """A joint about random axes; point: a plane holds a place only."""
    joint: dict[str, Any] = {"kind": kind, "first": first, "second": second}
    axis = rng.normal(size=3)
    if kind in ("revolute", "universal", "slider", "cylindrical", "planar"):
        joint["axis"] = axis.tolist()
    if kind == "universal":
        joint["second_axis"] = np.cross(axis, rng.normal(size=3)).tolist()
    if kind == "slider":
        joint["rotation"] = str(rng.choice(("free", "locked")))
    if kind == "planar":
        joint["rotation"] = "free" if point else str(rng.choice(("axis", "free")))
    if kind == "revolute" and rng.random() < 0.4:
        joint["friction"] = float(rng.uniform(0.0, 0.2))
        joint["coulomb"] = float(rng.choice((0.0, rng.uniform(0.01, 0.2))))
        joint["coulomb_speed"] = 0.1
    return joint


def _loads(rng: Random, end: dict[str, Any]) -> dict[str, Any]:
    """Springs and forces, or none."""
    loads: dict[str, Any] = {}
    if rng.random() < 0.4:
        loads["spring"] = {
            "kind": "spring",
            "first": {"body": "ground", "point": rng.normal(size=3).tolist()},
            "second": end,
            "stiffness": float(10 ** rng.uniform(0, 3)),
            "damping": float(rng.uniform(0, 2)),
        }
    if rng.random() < 0.4:
        force: dict[str, Any] = {"kind": "force", "at": end, "force": rng.normal(scale=3.0, size=3).tolist()}
        loads["force"] = force | ({"scale": f"sin({rng.uniform(1, 10)}*t)"} if rng.random() < 0.5 else {})
    return loads


def _tilted_linkage(seed: int, rng: Random) -> Scene:
    """A four-bar linkage in a plane of any direction: three of its constraints are redundant."""
    turn = Rotation.random(random_state=int(rng.integers(2**31)))
    corners = np.array([[0, 0, 0], [0.3, rng.uniform(0.3, 0.6), 0], [1.0, rng.uniform(0.4, 0.9), 0], [1.1, 0, 0]])
    bodies, initial, joints = {}, {}, {}
    axis = turn.apply([0, 0, 1]).tolist()
    for k, (one, other) in enumerate(pairwise(corners)):
        away = other - one
        own = turn * Rotation.from_rotvec([0, 0, np.arctan2(away[1], away[0])])
        bodies[f"B{k}"], _ = _link(rng)
        bodies[f"B{k}"]["named_points"] = {"end": [float(np.linalg.norm(away)), 0.0, 0.0]}
        initial[f"B{k}"] = {"rotation": own.as_rotvec().tolist()}
        first = {"body": f"B{k - 1}", "point": "end"} if k else GROUND
        joints[f"J{k}"] = {"first": first, "second": {"body": f"B{k}"}, "axis": axis}
    base = {"body": "ground", "point": turn.apply(corners[-1]).tolist()}
    joints["end"] = {"first": base, "second": {"body": "B2", "point": "end"}, "axis": axis}
    return _scene(seed, bodies, joints, initial, _loads(rng, {"body": "B1", "point": "end"}))


def _scene(seed: int, bodies: Any, joints: Any, initial: Any, loads: Any) -> Scene:
    return Scene.parse(
        {
            "name": f"spatial-{seed}",
            "dimensions": 3,
            "gravity": [0.0, 0.0, -9.81],
            "bodies": bodies,
            "joints": joints,
            "loads": loads,
            "markers": {name: {"body": name, "point": "end"} for name in bodies},
            "initial": initial,
            "solver": {"duration": 0.3, "samples": 6},
        }
    )
