"""Machines whose motion through impacts is known, as data that every peer reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.special import ellipj, ellipk, ellipkinc

Data = dict[str, Any]
Array = Any
G = 9.81
GROUND: Data = {"body": "ground", "point": [0.0, 0.0]}


@dataclass(frozen=True)
class Case:
    """A machine at one time. error: of angles [rad] and places [m] of the bodies' origins, (bodies,), (bodies, 2)

    touching: its contacts for who knows no stops; unit: of the error
    """

    name: str
    data: Data
    time: float
    error: Callable[[Array, Array], float]
    unit: str
    reference: str
    touching: Data = field(default_factory=dict)

    @property
    def as_contacts(self) -> Data:
        """Return the data with contacts in place of stops."""
        if not self.touching:
            return self.data
        joints = {name: {key: value for key, value in joint.items() if key != "stops"}
                  for name, joint in self.data["joints"].items()}  # fmt: skip
        return {**self.data, "joints": joints, "contacts": self.touching}


def pendulum(stop: float = -0.2, kept: float = 0.8, start: float = np.pi / 3, time: float = 10.0) -> Case:
    """A uniform rod of 1 m and 1 kg on a pin, let go at an angle from the vertical before a stop at another."""
    angle, line = start - np.pi / 2, stop - np.pi / 2
    rod = {"kind": "rigid-body", "mass": 1.0, "inertia": 1.0 / 12.0}
    pin = {"kind": "revolute", "first": GROUND, "second": {"body": "rod", "point": [-0.5, 0.0]},
           "stops": {"min": line, "restitution": kept}}  # fmt: skip
    data = {"name": "pendulum", "bodies": {"rod": rod}, "joints": {"pin": pin}, "markers": {"rod": {"body": "rod"}},
            "initial": {"rod": {"position": [0.5 * np.cos(angle), 0.5 * np.sin(angle)], "angle": angle}}}  # fmt: skip
    touching = {"stop": {"first": {"body": "rod", "point": [0.5, 0.0]}, "second": {**GROUND, "line": line},
                         "restitution": kept}}  # fmt: skip
    exact = struck(stop, kept, start, time) - np.pi / 2
    return Case("pendulum", data, time, lambda angles, _: float(abs(angles[0] - exact)), "rad", "elliptic functions",
                touching)  # fmt: skip


def struck(stop: float, kept: float, start: float, time: float, length: float = 1.0) -> float:
    """Return the angle from the vertical of the rod of `pendulum` at a time [s]: elliptic functions between impacts.

    stop <= 0: at or behind the vertical, which the rod must reach; it rests there after an accumulation if the stop is
    at the vertical, or with no restitution comes to it after every swing from the stop.
    """
    slow = np.sqrt(1.5 * G / length)

    def phase_of_stop(k: float) -> float:
        # Without restitution the stop is where the rod turns round, but for round-off.
        return float(ellipkinc(np.arcsin(np.clip(np.sin(stop / 2) / k, -1.0, 1.0)), k * k))

    def swing(top: float) -> float:
        """Time from the top angle to the stop."""
        k = np.sin(top / 2)
        return (float(ellipk(k * k)) - phase_of_stop(k)) / float(slow)

    top, last, hit = start, None, swing(start)
    while hit <= time:
        rate = np.sqrt(3.0 * G / length * (np.cos(stop) - np.cos(top)))
        top, last = np.arccos(np.cos(stop) - (kept * rate) ** 2 * length / (3.0 * G)), hit
        if stop == 0.0 and top < 1e-12:
            return 0.0
        hit += 2.0 * swing(top)
    k = np.sin(top / 2)
    if last is None:
        return float(2.0 * np.arcsin(k * ellipj(ellipk(k * k) - slow * time, k * k)[0]))
    phase = phase_of_stop(k) + slow * (time - last)
    return float(2.0 * np.arcsin(k * ellipj(phase, k * k)[0]))


def balls(time: float = 2.0) -> Case:
    """Eight balls dropped by 1 m, restitution from 0.5 to 0.85."""
    kept = {f"ball{k}": 0.5 + 0.05 * k for k in range(8)}
    ball = {"kind": "rigid-body", "mass": 1.0, "inertia": 1e-3}
    contacts = {f"floor{k}": {"first": {"body": name, "radius": 0.05}, "second": {**GROUND, "line": 0.0},
                              "restitution": e} for k, (name, e) in enumerate(kept.items())}  # fmt: skip
    start = {name: {"position": [float(k), 1.05], "angle": 0.0} for k, name in enumerate(kept)}
    data = {"name": "balls", "bodies": dict.fromkeys(kept, ball), "contacts": contacts, "initial": start,
            "markers": {name: {"body": name} for name in kept}}  # fmt: skip
    exact = np.array([dropped(e, time) for e in kept.values()]) + 0.05
    return Case("balls", data, time, lambda _, places: float(np.max(np.abs(places[:, 1] - exact))), "m", "closed form")


def dropped(kept: float, time: float, height: float = 1.0) -> float:
    """Return the height of a ball at a time [s], dropped by a height [m]."""
    fall = np.sqrt(2.0 * height / G)
    if time < fall:
        return float(height - 0.5 * G * time * time)
    rate, begin = float(kept * G * fall), float(fall)
    while rate > 1e-14:
        if time < begin + 2.0 * rate / G:
            return rate * (time - begin) - 0.5 * G * (time - begin) ** 2
        begin, rate = begin + 2.0 * rate / G, kept * rate
    return 0.0


def guide() -> Case:
    """A slider-crank whose slider has play in its guide, at 20 ms: four corners between two lines, with friction.

    Of Flores, Leine and Glocker (2010), with the numbers of an event-driven solution in three angles that was checked
    in absolute coordinates, known to 2e-11 rad.
    """
    crank, rod, half, high, play = 0.153, 0.306, 0.05, 0.025, 1e-3
    bodies = {
        name: {"kind": "rigid-body", "mass": mass, "inertia": inertia}
        for name, mass, inertia in (("crank", 0.038, 7.4e-5), ("rod", 0.038, 5.9e-4), ("slider", 0.076, 2.7e-6))
    }
    joints = {
        "O": {"kind": "revolute", "first": GROUND, "second": {"body": "crank", "point": [-crank / 2, 0.0]}},
        "A": {"kind": "revolute", "first": {"body": "crank", "point": [crank / 2, 0.0]},
              "second": {"body": "rod", "point": [-rod / 2, 0.0]}},
        "B": {"kind": "revolute", "first": {"body": "rod", "point": [rod / 2, 0.0]},
              "second": {"body": "slider", "point": [0.0, 0.0]}},
    }  # fmt: skip
    rates = (150.0, -75.0, -0.01)
    speeds = (rates[0] * crank / 2, rates[0] * crank + rates[1] * rod / 2, rates[0] * crank + rates[1] * rod)
    start = {name: {"position": [x, 0.0], "angle": 0.0, "velocity": [0.0, speed], "rate": rate}
             for name, x, speed, rate in zip(bodies, (crank / 2, crank + rod / 2, crank + rod), speeds, rates,
                                             strict=True)}  # fmt: skip
    contacts = {f"{'upper' if up > 0 else 'lower'}-{'front' if fore > 0 else 'rear'}": {
                    "first": {"body": "slider", "point": [fore * half, up * high]},
                    "second": {"body": "ground", "point": [0.0, up * (high + play)], "line": np.pi if up > 0 else 0.0},
                    "restitution": 0.4, "mu": 0.01}
                for up in (1, -1) for fore in (1, -1)}  # fmt: skip
    data = {"name": "guide", "bodies": bodies, "joints": joints, "contacts": contacts, "initial": start,
            "markers": {name: {"body": name} for name in bodies}}  # fmt: skip
    exact = np.array([1.613025139994518, -0.5199104707752605, 0.0])
    return Case("guide", data, 0.02, lambda angles, _: float(np.max(np.abs(angles - exact))), "rad",
                "event-driven, in three angles")  # fmt: skip


CASES: dict[str, Callable[[], Case]] = {"pendulum": pendulum, "balls": balls, "guide": guide}
