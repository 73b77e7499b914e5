"""Geared linkages that start where branches of their motion cross, against their motion in one angle.

Two links whose angles a gear ties, and a third whose end slides on a line: y = l1 sin x + l2 sin(k x + c) + l3 sin z.
The third link is upright where dy/dx = 0, so that z has two branches, z = -pi/2 +- 2 asin sqrt((l3 - h(x)) / (2 l3)).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene


def _sine(x: Any) -> Any:
    """Return sin x - x without cancellation."""
    return -(x**3) / 6 * (1 - x**2 / 20 * (1 - x**2 / 42 * (1 - x**2 / 72 * (1 - x**2 / 110))))


class Geared(NamedTuple):
    ratio: Fraction
    lengths: list[float]
    angles: list[float]
    masses: Any
    inertias: Any
    rate: float
    side: float

    @classmethod
    def draw(cls, seed: int) -> Geared:
        rng = np.random.default_rng(seed)
        while True:
            ratio = Fraction(int(rng.integers(1, 40)), int(rng.integers(1, 40))) * int(rng.choice([-1, 1]))
            (x, y), k, first = rng.uniform(-np.pi, np.pi, 2), float(ratio), rng.uniform(0.5, 1.5)
            second = -first * np.cos(x) / (k * np.cos(y))
            third = first * np.sin(x) + second * np.sin(y)
            bend = first * np.sin(x) + k * k * second * np.sin(y)
            if 0.4 < abs(k) < 3 and abs(k) != 1 and 0.3 < second < 2 and 0.4 < third < 3 and bend > 0.3:
                break
        rate, side = rng.uniform(0.5, 2.0) * rng.choice([-1, 1]), rng.choice([-1, 1])
        lengths, masses, inertias = [first, second, third], rng.uniform(0.5, 2, 3), rng.uniform(0.05, 0.4, 3)
        return cls(ratio, lengths, [x, y, -np.pi / 2], masses, inertias, rate, side)

    def at(self, turn: Any) -> list[Any]:
        """Return the angles of the links [rad] when the first has turned from the singular position."""
        k, (first, second, third), (x, y, z) = float(self.ratio), self.lengths, self.angles
        fall = 0.0  # h(0) - h(turn), whose first derivative vanishes
        for length, begin, angle in ((first, x, turn), (second, y, k * turn)):
            fall = fall + length * (2 * np.sin(begin) * np.sin(angle / 2) ** 2 - np.cos(begin) * _sine(angle))
        return [x + turn, y + k * turn, z + self.side * 2 * np.arcsin(turn * np.sqrt(fall / turn**2 / (2 * third)))]

    def moving(self, turn: float) -> tuple[list[float], float]:
        """Return the rates by that of the first link, and twice the kinetic energy at its rate 1."""
        moved = self.at((turn or 1e-9) + 1e-30j)
        rates, end, energy = [float(one.imag / 1e-30) for one in moved], 0j, 0.0
        for length, angle, rate, mass, inertia in zip(
            self.lengths, moved, rates, self.masses, self.inertias, strict=True
        ):
            across = 1j * rate * length * np.exp(1j * angle.real)
            energy += mass * abs(end + across / 2) ** 2 + inertia * rate**2
            end += across
        return rates, energy

    def motion(self, times: Any) -> Any:
        """Return the angles of the links [rad] at times, (times, links): their energy stays, as nothing acts."""
        energy = self.moving(0.0)[1]

        def rate(_: float, turn: Any) -> list[float]:
            return [self.rate * np.sqrt(energy / self.moving(float(turn[0]))[1])]

        found = solve_ivp(rate, (0.0, times[-1]), [0.0], "DOP853", times, rtol=1e-12, atol=1e-15)
        return np.array(self.at(found.y[0])).T

    def scene(self, dimensions: int) -> Scene:
        """Return the machine in the plane or in space."""
        rest = [0.0] * (dimensions - 1)
        ground: dict[str, Any] = {"body": "ground", "point": [0.0, *rest]}
        bodies: dict[str, Any] = {}
        joints: dict[str, Any] = {}
        initial: dict[str, Any] = {}
        last = ground
        rates, _ = self.moving(0.0)
        axis: dict[str, Any] = {"axis": [0.0, 0.0, 1.0]} if dimensions == 3 else {}
        for name, mass, inertia, length, angle, rate in zip(
            "xyz", self.masses, self.inertias, self.lengths, self.angles, rates, strict=True
        ):
            bodies[name] = {"kind": "rigid-body", "mass": mass, "centre_of_mass": [length / 2, *rest],
                            "inertia": inertia if dimensions == 2 else [inertia] * 3,
                            "named_points": {"end": [length, *rest]}}  # fmt: skip
            joints[f"to-{name}"] = {"first": last, "second": {"body": name}} | axis
            initial[name] = {"angle": angle, "rate": rate * self.rate}
            last = {"body": name, "point": "end"}
        joints["line"] = {"kind": "slider", "first": ground, "second": last}
        joints["line"] |= {"direction": 0.0} if dimensions == 2 else {"axis": [1.0, 0.0, 0.0]}
        joints["teeth"] = {"kind": "gear", "first": {"body": "x"}, "second": {"body": "y"}, "ratio": str(self.ratio)}
        joints["teeth"] |= axis
        solver = {"duration": 0.1, "integrator": "rk4", "step": 1e-3}
        data = {"name": "geared", "bodies": bodies, "joints": joints, "initial": initial, "solver": solver}
        gravity, markers = [0.0, *rest], {name: {"body": name, "point": "end"} for name in bodies}
        return Scene.parse(data | {"dimensions": dimensions, "gravity": gravity, "markers": markers})


@pytest.mark.parametrize(("dimensions", "seed"), [(2, 0), (2, 2), (2, 4), (2, 5), (3, 2)])
def test_a_geared_linkage_leaves_its_singular_position_as_in_one_angle(dimensions: int, seed: int) -> None:
    """Cubes of rates in the third derivatives of gears were counted three times: up to 2e-8 rad off after a step."""
    machine, times = Geared.draw(seed), np.array([1e-4, 0.01, 0.1])
    run = simulate(machine.scene(dimensions), times)
    assert run.ok, run.message
    for number, name in enumerate(machine.scene(dimensions).bodies):
        angles = machine.motion(times)[:, : number + 1]
        expected = np.sum(np.array(machine.lengths[: number + 1]) * np.exp(1j * angles), axis=1)
        found = run.marker(name)
        off = np.abs(found[:, 0] + 1j * found[:, 1] - expected)
        assert off[0] < 1e-11
        assert off[-1] < 1e-8
