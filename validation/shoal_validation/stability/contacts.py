"""Impacts, grazing and friction: restitution, gap, step, friction, number of contacts; ours beside springs of others.

The motions are known in closed form: a rod before a stop (elliptic functions between impacts), a disc that is thrown on
the ground (parabolas, Coulomb's law at impacts), balls that bounce beside each other (parabolas, geometric series).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.mujoco import MujocoEngine
from shoal.scene import Scene
from shoal.trajectory import Array

from shoal_validation.contacts.cases import G, balls, dropped, pendulum, struck
from shoal_validation.stability.contract import Axis, Method, StabilityMap, Watched
from shoal_validation.stability.methods import AUTO, both, ours

OURS = (AUTO, ours("rk4"), ours("leapfrog"), ours("semi-implicit-euler"))
PEERS = both(Method("exudyn, contacts give way", ExudynEngine()), Method("mujoco, contacts give way", MujocoEngine()))
STEPS = Axis("step", "s", (0.02, 5e-3, 1e-3, 2e-4))
RESTITUTION = Axis("restitution", "", (0.0, 0.2, 0.5, 0.8, 0.95, 1.0))
TOP = np.pi / 3
"""Amplitude of the rod [rad]."""
TIMES = np.linspace(0.1, 5.0, 50)
THROWN, RADIUS, INERTIA = (2.0, -10.0), 0.1, 0.005
"""Velocity [m/s] and spin [rad/s] of a disc of 1 kg at 0.6 m, its radius [m] and inertia [kg m^2]."""


def rod(stop: float, kept: float, duration: float = 5.0) -> Watched:
    """The end of the rod of `cases.pendulum` before a stop at an angle from the vertical [rad]."""
    times = TIMES[duration >= TIMES]
    scene = Scene.parse(
        pendulum(stop, kept, TOP, duration).data | {"markers": {"P": {"body": "rod", "point": [0.5, 0.0]}}}
    )
    return Watched(scene, {}, "P", times, swung(stop, kept, len(times)), 1.0)


@cache
def swung(stop: float, kept: float, count: int) -> Array:
    """Positions of the end of the rod [m], (times, 2)."""
    angles = np.array([struck(stop, kept, TOP, float(time)) for time in TIMES[:count]]) - np.pi / 2
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def disc(mu: float, kept: float, spin: float = THROWN[1]) -> Watched:
    """The centre of a disc that is thrown on the ground with a spin [rad/s]."""
    data = {
        "name": "thrown-disc",
        "bodies": {"disc": {"kind": "rigid-body", "mass": 1.0, "inertia": INERTIA}},
        "contacts": {"floor": {"first": {"body": "disc", "radius": RADIUS}, "second": {"body": "ground", "line": 0.0},
                               "restitution": kept, "mu": mu}},
        "initial": {"disc": {"position": [0.0, 0.6 + RADIUS], "velocity": [THROWN[0], 0.0], "rate": spin}},
        "markers": {"disc": {"body": "disc"}},
    }  # fmt: skip
    times = TIMES[:20]
    return Watched(Scene.parse(data), {}, "disc", times, bounced(mu, kept, spin, times.tobytes()), 1.0)


@cache
def bounced(mu: float, kept: float, spin: float, times: bytes) -> Array:
    """Positions of the centre of the disc [m], (times, 2)."""
    return np.array([_bounced(mu, kept, spin, float(time)) for time in np.frombuffer(times)])


def _bounced(mu: float, kept: float, spin: float, time: float) -> Array:
    u, w, rate, begin = THROWN[0], spin, np.sqrt(1.2 * G), np.sqrt(1.2 / G)
    if time < begin:
        return np.array([u * time, RADIUS + 0.6 - 0.5 * G * time * time])
    x = u * begin
    while True:
        u, w = _rubbed(u, w, mu * (1.0 + kept) * rate)
        rate *= kept
        flight = 2.0 * rate / G
        if flight < 1e-13:
            break
        if time < begin + flight:
            s = time - begin
            return np.array([x + u * s, RADIUS + rate * s - 0.5 * G * s * s])
        x, begin = x + u * flight, begin + flight
    # It slides until it rolls.
    slip, s = u + RADIUS * w, time - begin
    share = 1.0 + RADIUS**2 / INERTIA
    ends = abs(slip) / (mu * G * share) if mu else np.inf
    sliding = min(s, ends)
    push = -np.sign(slip) * mu * G
    x += u * sliding + 0.5 * push * sliding**2 + (u + push * sliding) * (s - sliding)
    return np.array([x, RADIUS])


def _rubbed(u: float, w: float, most: float) -> tuple[float, float]:
    """Return velocity and spin after a tangential impulse of at most so much [N s], which stops the slip if it can."""
    push = float(np.clip(-(u + RADIUS * w) / (1.0 + RADIUS**2 / INERTIA), -most, most))
    return u + push, w + RADIUS * push / INERTIA


def many(count: int) -> Watched:
    """The worst of several balls beside each other: that with the largest restitution."""
    whole = balls(2.0).data
    names = [f"ball{k}" for k in range(count)]
    kept = {name: float(e) for name, e in zip(names, np.linspace(0.5, 0.9, count), strict=True)}
    contacts = {f"floor{k}": {"first": {"body": name, "radius": 0.05}, "second": {"body": "ground", "line": 0.0},
                              "restitution": kept[name]} for k, name in enumerate(names)}  # fmt: skip
    data = {"name": "balls", "bodies": dict.fromkeys(names, whole["bodies"]["ball0"]), "contacts": contacts,
            "initial": {name: {"position": [float(k), 1.05]} for k, name in enumerate(names)},
            "markers": {"P": {"body": names[-1]}}}  # fmt: skip
    times = TIMES[:20]
    heights = [dropped(kept[names[-1]], float(time)) + 0.05 for time in times]
    places = np.stack([np.full(len(times), count - 1.0), heights], axis=1)
    return Watched(Scene.parse(data), {}, "P", times, places, 1.0)


def step(step: float) -> dict[str, object]:
    """Fields of the solver."""
    return {"solver.step": step}


def _map(name: str, question: str, teaches: str, x: Axis, y: Axis, watched: Any, solver: Any) -> StabilityMap:
    return StabilityMap(f"contacts-{name}", question, teaches, x, y, (*OURS, *PEERS), watched, solver)


MAPS = (
    _map(
        "step", "Which step resolves impacts against a stop, and which restitution?",
        "Ours holds at every restitution, rest on the stop after an accumulation included, as far as its integrator "
        "bears the step. Springs are inaccurate at 0.2 ms still, and do not say so.",
        RESTITUTION, STEPS, lambda x, y: rod(-0.2, x), lambda x, y: step(y),
    ),
    _map(
        "gap", "How near to the rod may the stop be?",
        "Without restitution the rod comes back to the stop with no rate at all, time and again: ours holds there too.",
        Axis("angle of the stop from the vertical", "rad", (-0.9, -0.5, -0.2, -0.05, 0.0)), RESTITUTION,
        lambda x, y: rod(x, y), lambda x, y: step(1e-3),
    ),
    _map(
        "grazing", "How gently may the rod touch the stop?",
        "Ours holds down to a touch of 1e-9 of the amplitude by default; leapfrog at 0.02 s does not know the motion, "
        "and says so. Springs are off wherever an impact takes energy.",
        Axis("amplitude beyond the stop, as a part of it", "", (1e-9, 1e-6, 1e-4, 1e-2, 0.1)), STEPS,
        lambda x, y: rod(-TOP * (1.0 - x), 0.5), lambda x, y: step(y),
    ),
    _map(
        "friction", "How much friction, with which restitution?",
        "A disc with spin that slips until an impact lets it roll. MuJoCo's law of friction lifts what "
        "slides; ours is Coulomb's.",
        Axis("coefficient of friction", "", (0.0, 0.05, 0.2, 0.5, 1.0)), RESTITUTION, disc, lambda x, y: step(1e-3),
    ),
    _map(
        "count", "How many contacts at once?",
        "Balls beside each other, each of which comes to rest in an accumulation of its own: events of many contacts "
        "end the steps of all.",
        Axis("balls", "", (1, 2, 4, 8, 16)), STEPS, lambda x, y: many(x), lambda x, y: step(y),
    ),
)  # fmt: skip
