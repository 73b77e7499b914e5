"""Rigid machines in space: tops, closed linkages that move by their geometry, platforms on legs, and generic loops.

Every body has any frame, mass, centre and inertia; every pose is stated, so that other programs can read the mapping.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

Random = np.random.Generator
Array = Any
FREEDOMS = {"revolute": 1, "slider": 1, "universal": 2, "cylindrical": 2, "spherical": 3, "planar": 3}
"""Of a joint of a generic loop; its sliders are locked, its planes keep an axis."""


def drawn(seed: int) -> tuple[str, dict[str, Any]]:
    """The family of a seed and the mapping of its scene."""
    rng = np.random.default_rng([19, seed])
    name = list(FAMILIES)[seed % len(FAMILIES)]
    data = FAMILIES[name](rng)
    return name, data | {"name": f"{name}-{seed}", "dimensions": 3}


def _turn(rng: Random) -> Rotation:
    return Rotation.from_quat(rng.normal(size=4))


def _inertia(rng: Random, size: float) -> Array:
    """Inertia [kg m^2] of twenty points of a body of a size [m] and 1 kg, (3, 3)."""
    points = size * rng.normal(size=(20, 3)) * rng.uniform(0.3, 1.0, 3) / 2
    points = _turn(rng).apply(points - points.mean(axis=0))
    matrix = np.mean(np.sum(points**2, axis=1)) * np.eye(3) - points.T @ points / 20
    return (matrix + matrix.T) / 2


def _body(rng: Random, start: Array, end: Array) -> tuple[dict[str, Any], dict[str, Any]]:
    """A body between two places, in a frame of its own, and its pose."""
    turn, mass, size = _turn(rng), float(10 ** rng.uniform(-0.7, 0.7)), max(float(np.linalg.norm(end - start)), 0.1)
    middle = rng.uniform(0.2, 0.8) * (end - start) + 0.15 * size * rng.normal(size=3)
    body = {
        "kind": "rigid-body", "mass": mass, "inertia": (mass * _inertia(rng, size)).tolist(),
        "centre_of_mass": turn.inv().apply(middle).tolist(),
        "named_points": {"end": turn.inv().apply(end - start).tolist()},
    }  # fmt: skip
    return body, {"rotation": turn.as_rotvec().tolist(), "position": start.tolist()}


def loop(rng: Random, places: Array, axes: Array, kinds: list[str] | None = None) -> dict[str, Any]:
    """A loop of bodies from the ground through joints at these places about these axes back to the ground."""
    kinds = kinds or ["revolute"] * len(places)
    bodies, initial, joints, before = {}, {}, {}, {"body": "ground", "point": places[0].tolist()}
    for k, (one, other) in enumerate(pairwise(places)):
        name = f"B{k}"
        bodies[name], initial[name] = _body(rng, one, other)
        joints[f"J{k}"] = _joint(rng, kinds[k], before, {"body": name}, axes[k])
        before = {"body": name, "point": "end"}
    base = {"body": "ground", "point": places[-1].tolist()}
    joints["end"] = _joint(rng, kinds[-1], base, before, axes[-1])
    markers = {name: {"body": name, "point": "end"} for name in list(bodies)[:-1]}
    centre = bodies[before["body"]]["centre_of_mass"]
    return _machine(rng, bodies, joints, initial, markers | {"last": {"body": before["body"], "point": centre}})


def _joint(rng: Random, kind: str, first: Any, second: Any, axis: Array) -> dict[str, Any]:
    joint = {"kind": kind, "first": first, "second": second}
    if kind != "spherical":
        joint["axis"] = (axis * rng.uniform(0.5, 2.0)).tolist()
    if kind == "slider":
        joint["rotation"] = "locked"
    if kind == "universal":
        joint["second_axis"] = np.cross(axis, rng.normal(size=3)).tolist()
    return joint


def _machine(rng: Random, bodies: Any, joints: Any, initial: Any, markers: Any) -> dict[str, Any]:
    gravity = 9.81 * _turn(rng).apply([0.0, 0.0, -1.0])
    return {"bodies": bodies, "joints": joints, "loads": {}, "initial": initial, "markers": markers,
            "gravity": gravity.tolist(), "solver": {"duration": 0.5, "samples": 5}}  # fmt: skip


def top(rng: Random) -> dict[str, Any]:
    """A symmetric body on a point, spun about its axis by up to 300 rad/s, sometimes asleep."""
    mass, long, height = float(10 ** rng.uniform(-1, 1)), rng.uniform(0.1, 1.0), rng.uniform(0.05, 0.5)
    a = mass * long**2 * rng.uniform(0.02, 0.2)
    c = a * rng.uniform(0.3, 1.9)
    tilt = 0.0 if rng.random() < 0.2 else rng.uniform(0.1, 2.5)
    turn = Rotation.from_rotvec([tilt, 0, 0]) * Rotation.from_rotvec([0, 0, rng.uniform(0, 6)])
    axis = turn.apply([0, 0, 1])
    spin = float(10 ** rng.uniform(0, 2.5)) * axis + rng.choice([0.0, 1.0]) * rng.normal(size=3) * (tilt > 0)
    body = {"kind": "rigid-body", "mass": mass, "inertia": [a, a, c], "centre_of_mass": [0, 0, height],
            "named_points": {"tip": [0, 0, 2 * height], "side": [height, 0, height]}}  # fmt: skip
    joint = {"kind": "spherical", "first": {"body": "ground", "point": [0.0, 0.0, 0.0]}, "second": {"body": "top"}}
    pose = {"rotation": turn.as_rotvec().tolist(), "position": [0.0, 0.0, 0.0], "spin": spin.tolist()}
    data = _machine(rng, {"top": body}, {"foot": joint}, {"top": pose},
                    {name: {"body": "top", "point": name} for name in ("tip", "side")})  # fmt: skip
    return data | {"gravity": [0.0, 0.0, -9.81]}


def bennett(rng: Random) -> dict[str, Any]:
    """Four hinges: lengths as the sines of the twists, second angle by Bennett's closure."""
    twists = rng.uniform(0.3, 1.4, 2)
    lengths, first = np.sin(twists) * rng.uniform(0.3, 1.0), rng.uniform(0.4, 2.6)
    other = 2 * np.arctan(np.sin(sum(twists) / 2) / np.sin((twists[1] - twists[0]) / 2) / np.tan(first / 2))
    turn, shift, places, axes = Rotation.identity(), np.zeros(3), [np.zeros(3)], [np.array([0.0, 0.0, 1.0])]
    for length, twist, angle in zip(lengths, twists, (first, other), strict=True):
        turn = turn * Rotation.from_rotvec([0, 0, angle])
        shift = shift + turn.apply([length, 0, 0])
        turn = turn * Rotation.from_rotvec([twist, 0, 0])
        places.append(shift)
        axes.append(turn.apply([0, 0, 1]))
    places.append(np.array([-lengths[1], 0, 0]))
    axes.append(Rotation.from_rotvec([-twists[1], 0, 0]).apply([0, 0, 1]))
    return loop(rng, *_anyhow(rng, places, axes))


def _anyhow(rng: Random, places: Any, axes: Any) -> tuple[Array, Array]:
    """Turned and moved as a whole."""
    turn = _turn(rng)
    return turn.apply(np.array(places)) + rng.normal(size=3), turn.apply(np.array(axes))


def line_symmetric(rng: Random) -> dict[str, Any]:
    """Bricard's six hinges of which three are the others turned by half a turn about a line."""
    places, axes, half = rng.normal(scale=0.5, size=(3, 3)), rng.normal(size=(3, 3)), np.array([-1.0, -1.0, 1.0])
    return loop(rng, *_anyhow(rng, [*places, *(half * places)], [*axes, *(half * axes)]))


def plane_symmetric(rng: Random) -> dict[str, Any]:
    """Bricard's six hinges of which two lie in a plane that mirrors the others."""
    places, axes, mirror = rng.normal(scale=0.5, size=(4, 3)), rng.normal(size=(4, 3)), np.array([-1.0, 1.0, 1.0])
    for k in (0, 3):
        places[k, 0] = axes[k, 0] = 0.0
    order = [0, 1, 2, 3]
    back = [2, 1]
    return loop(rng, *_anyhow(rng, [*places[order], *(mirror * places[back])], [*axes[order], *(mirror * axes[back])]))


def sarrus(rng: Random) -> dict[str, Any]:
    """Two trains of three parallel hinges: a straight line without a slide."""
    places = rng.normal(scale=0.5, size=(6, 3))
    one, other = rng.normal(size=(2, 3))
    return loop(rng, places, np.array([one] * 3 + [other] * 3))


def spherical(rng: Random) -> dict[str, Any]:
    """Four or five hinges whose axes meet in a point."""
    count = int(rng.integers(4, 6))
    axes = rng.normal(size=(count, 3))
    return loop(rng, rng.normal(size=3) + axes * rng.uniform(0.3, 0.8, (count, 1)), axes)


def parallelogram(rng: Random) -> dict[str, Any]:
    """Two equal cranks in a plane of any direction, away from where they lie on a line."""
    crank, base, angle = rng.uniform(0.3, 0.8), rng.uniform(0.5, 1.5), rng.uniform(0.7, 2.4)
    up = crank * np.array([np.cos(angle), np.sin(angle), 0])
    across = np.array([base, 0.0, 0.0])
    places = np.array([np.zeros(3), up, up + across, across])
    return loop(rng, *_anyhow(rng, places, np.tile([0.0, 0.0, 1.0], (4, 1))))


def generic(rng: Random) -> dict[str, Any]:
    """Joints of any kind whose freedoms are seven or eight: one or two more than the loop takes."""
    while True:
        kinds = [str(kind) for kind in rng.choice(list(FREEDOMS), int(rng.integers(3, 8)))]
        if sum(FREEDOMS[kind] for kind in kinds) in (7, 8) and kinds.count("slider") + kinds.count("planar") < 3:
            break
    return loop(rng, rng.normal(scale=0.6, size=(len(kinds), 3)), rng.normal(size=(len(kinds), 3)), kinds)


def rssr(rng: Random) -> dict[str, Any]:
    """Two cranks on hinges and a coupler on two balls, which may spin about itself."""
    return loop(
        rng,
        rng.normal(scale=0.6, size=(4, 3)),
        rng.normal(size=(4, 3)),
        ["revolute", "spherical", "spherical", "revolute"],
    )


def slider_crank(rng: Random) -> dict[str, Any]:
    """A crank on a hinge, a rod on a ball and a universal joint or two balls, and what slides."""
    kinds = ["revolute", "spherical", str(rng.choice(["universal", "spherical"])), "slider"]
    return loop(rng, rng.normal(scale=0.6, size=(4, 3)), rng.normal(size=(4, 3)), kinds)


def platform(rng: Random) -> dict[str, Any]:
    """A platform on three to five legs of constant length."""
    legs = int(rng.integers(3, 6))
    body, pose = _body(rng, rng.normal(size=3), rng.normal(size=3))
    corners = rng.normal(scale=0.5, size=(legs, 3))
    body["named_points"] |= {f"P{k}": corner.tolist() for k, corner in enumerate(corners)}
    turn = Rotation.from_rotvec(pose["rotation"])
    joints = {}
    for k, corner in enumerate(corners):
        foot = turn.apply(corner) + pose["position"] + rng.normal(size=3)
        joints[f"L{k}"] = {"kind": "distance", "first": {"body": "ground", "point": foot.tolist()},
                           "second": {"body": "B0", "point": f"P{k}"}}  # fmt: skip
    markers = {name: {"body": "B0", "point": name} for name in body["named_points"]}
    return _machine(rng, {"B0": body}, joints, {"B0": pose}, markers)


FAMILIES: dict[str, Callable[[Random], dict[str, Any]]] = {
    "top": top, "bennett": bennett, "line-symmetric": line_symmetric, "plane-symmetric": plane_symmetric,
    "sarrus": sarrus, "spherical": spherical, "parallelogram": parallelogram, "generic": generic, "rssr": rssr,
    "slider-crank": slider_crank, "platform": platform,
}  # fmt: skip
