"""Planar machines with contacts, drawn at random."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Data = dict[str, Any]
DURATION = 1.5


def drawn(seed: int) -> tuple[str, Data]:
    """Return the kind of a machine and its scene as data."""
    random = np.random.default_rng(seed)
    name = list(KINDS)[seed % len(KINDS)]
    found = KINDS[name](random)
    return name, {"name": f"{name}-{seed}", "solver": {"duration": DURATION}, **found}


def pushed(seed: int) -> tuple[str, Data]:
    """Return the same with a force and a torque on each body that begin at some time and end at another."""
    kind, data = drawn(seed)
    random, loads = np.random.default_rng([seed, 1]), {}
    for name, body in data["bodies"].items():
        begin, end = sorted(random.uniform(0.0, DURATION, 2).round(3).tolist())
        lasts = f"step(t - {begin}) - step(t - {end})"
        force = (15.0 * body["mass"] * random.uniform(-1.0, 1.0, 2)).tolist()
        loads[f"push-{name}"] = {"kind": "force", "at": {"body": name}, "force": force, "scale": lasts}
        torque = 20.0 * body["inertia"] * random.uniform(-1.0, 1.0)
        loads[f"turn-{name}"] = {"kind": "torque", "at": {"body": name}, "torque": f"{torque}*({lasts})"}
    return kind, {**data, "loads": loads}


def _law(random: Any) -> Data:
    """Restitution and friction, each absent at times."""
    kept = float(random.choice([0.0, random.uniform(0.2, 0.95)], p=[0.25, 0.75]))
    return {"restitution": kept, "mu": float(random.choice([0.0, random.uniform(0.05, 0.6)], p=[0.25, 0.75]))}


def _ball(random: Any) -> Data:
    mass, radius = float(random.uniform(0.5, 2.0)), float(random.uniform(0.05, 0.15))
    return {"kind": "rigid-body", "mass": mass, "inertia": 0.5 * mass * radius**2, "radius": radius}


def _thrown(random: Any, place: list[float]) -> Data:
    return {"position": place, "angle": 0.0, "velocity": random.uniform(-2.0, 2.0, 2).tolist(),
            "rate": float(random.uniform(-10.0, 10.0))}  # fmt: skip


def _balls(random: Any) -> Data:
    """One to three balls between a sloping floor and two walls."""
    count = int(random.integers(1, 4))
    balls = {f"ball{k}": _ball(random) for k in range(count)}
    radii = {name: ball.pop("radius") for name, ball in balls.items()}
    walls = {"floor": ([0.0, 0.0], float(random.uniform(-0.3, 0.3))), "left": ([-1.0, 0.0], -np.pi / 2),
             "right": ([1.0, 0.0], np.pi / 2)}  # fmt: skip
    contacts, law = {}, {wall: _law(random) for wall in walls}
    for name in balls:
        for wall, (point, angle) in walls.items():
            side = {"body": "ground", "point": point, "line": angle}
            contacts[f"{name}-{wall}"] = {"first": {"body": name, "radius": radii[name]}, "second": side, **law[wall]}
    for one in range(count):
        for other in range(one):
            sides = [{"body": f"ball{k}", "radius": radii[f"ball{k}"]} for k in (one, other)]
            contacts[f"ball{other}-ball{one}"] = {"first": sides[0], "second": sides[1], **_law(random)}
    start = {name: _thrown(random, [-0.6 + 0.6 * k, 0.5 + 0.2 * k]) for k, name in enumerate(balls)}
    return {
        "bodies": balls,
        "contacts": contacts,
        "initial": start,
        "markers": {name: {"body": name} for name in balls},
    }


def _block(random: Any) -> Data:
    """A block that tumbles on a slope with its corners."""
    b, h, mass = (float(random.uniform(*one)) for one in ((0.1, 0.4), (0.1, 0.4), (0.5, 2.0)))
    law, slope = _law(random), float(random.uniform(-0.4, 0.4))
    contacts = {
        f"corner{k}": {"first": {"body": "block", "point": [x * b, y * h]},
                       "second": {"body": "ground", "line": slope}, **law}
        for k, (x, y) in enumerate([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    }  # fmt: skip
    body = {"kind": "rigid-body", "mass": mass, "inertia": mass * (b * b + h * h) / 3}
    start = _thrown(random, [0.0, 1.0]) | {"angle": float(random.uniform(-3, 3)), "rate": float(random.uniform(-4, 4))}
    return {"bodies": {"block": body}, "contacts": contacts, "initial": {"block": start},
            "markers": {"block": {"body": "block"}, "corner": {"body": "block", "point": [b, h]}}}  # fmt: skip


def _chain(random: Any) -> Data:
    """One to three pinned links above a floor and beside a wall, which their ends strike."""
    count, bodies, joints, start = int(random.integers(1, 4)), {}, {}, {}
    place, before = np.zeros(2), {"body": "ground", "point": [0.0, 0.0]}
    length = float(random.uniform(0.3, 0.6))
    contacts: Data = {}
    floor: Data = {"body": "ground", "point": [0.0, -0.75 * count * length], "line": float(random.uniform(-0.2, 0.2))}
    law = _law(random)
    for k in range(count):
        mass, angle = float(random.uniform(0.5, 2.0)), float(random.uniform(-1.2, 0.3))
        way = length * np.array([np.cos(angle), np.sin(angle)])
        bodies[f"link{k}"] = {"kind": "rigid-body", "mass": mass, "inertia": mass * length**2 / 12}
        near, far = ({"body": f"link{k}", "point": [side * length / 2, 0.0]} for side in (-1, 1))
        joints[f"pin{k}"] = {"kind": "revolute", "first": before, "second": near}
        start[f"link{k}"] = {
            "position": (place + way / 2).tolist(),
            "angle": angle,
            "velocity": [0.0, 0.0],
            "rate": 0.0,
        }
        contacts[f"end{k}"] = {"first": far | {"radius": float(random.uniform(0.0, 0.05))}, "second": floor, **law}
        place, before = place + way, far
    if floor["point"][1] > min(place[1], 0.0) - 0.2:
        floor["point"][1] = float(min(place[1], 0.0)) - 0.3
    return {"bodies": bodies, "joints": joints, "contacts": contacts, "initial": start,
            "markers": {name: {"body": name} for name in bodies}}  # fmt: skip


def _drum(random: Any) -> Data:
    """A disc that rolls, slides and jumps in a hole of the ground, or of a body on a pin."""
    disc, hole = _ball(random), float(random.uniform(0.4, 0.8))
    radius = disc.pop("radius")
    angle = float(random.uniform(-2.8, 0.0))
    place = (hole - radius) * 0.9 * np.array([np.cos(angle), np.sin(angle)])
    bodies, start = {"disc": disc}, {"disc": _thrown(random, place.tolist())}
    side: Data = {"body": "ground", "point": [0.0, 0.0], "hole": hole}
    joints = {}
    if random.random() < 0.5:
        bodies["drum"] = {"kind": "rigid-body", "mass": 3.0, "inertia": 3.0 * hole**2}
        start["drum"] = {"position": [0.0, 0.0], "angle": 0.0, "velocity": [0.0, 0.0],
                         "rate": float(random.uniform(-5.0, 5.0))}  # fmt: skip
        joints["axle"] = {"kind": "revolute", "first": {"body": "ground", "point": [0.0, 0.0]},
                          "second": {"body": "drum", "point": [0.0, 0.0]}}  # fmt: skip
        side = {"body": "drum", "point": [0.0, 0.0], "hole": hole}
    contact = {"rim": {"first": {"body": "disc", "radius": radius}, "second": side, **_law(random)}}
    return {"bodies": bodies, "joints": joints, "contacts": contact, "initial": start,
            "markers": {name: {"body": name} for name in bodies}}  # fmt: skip


KINDS: dict[str, Callable[[Any], Data]] = {"balls": _balls, "block": _block, "chain": _chain, "drum": _drum}
