"""Chains of rods in floating frames by Lagrange's equations in angles and amplitudes, integrated by scipy: a judge.

Shares no code with the mechanics: minimal coordinates, a mass matrix that changes, closed forms of the shapes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Array = np.ndarray[Any, np.dtype[Any]]
X, W = (part / 2 for part in np.polynomial.legendre.leggauss(32))
X = X + 0.5


def sines(count: int, x: Array, order: int) -> Array:
    """sin(k pi x) and derivatives, of a rod with joints at both ends."""
    wave = np.pi * np.arange(1, count + 1)[:, None]
    return wave**order * np.sin(wave * x + order * np.pi / 2)


def hinged_free(count: int, x: Array, order: int) -> Array:
    """(sin bx / sin b + sinh bx / sinh b) / 2 with tan b = tanh b, of a rod that hangs on its first end."""
    found = []
    for k in range(1, count + 1):
        b = brentq(lambda b: np.sin(b) - np.tanh(b) * np.cos(b), (k + 0.1) * np.pi, (k + 0.4) * np.pi, xtol=1e-14)
        hyperbolic = (np.sinh, np.cosh)[order % 2](b * x) / np.sinh(b)
        found.append(b**order * (np.sin(b * x + order * np.pi / 2) / np.sin(b) + hyperbolic) / 2)
    return np.array(found)


@dataclass
class Bar:
    """A rod [m, kg/m, N, N m^2, kg m]; rotary: inertia of its sections per length; shapes across it."""

    length: float
    line: float
    stretching: float
    bending: float
    rotary: float
    retardation: float
    modes: int
    axial: int
    shapes: Any

    @property
    def size(self) -> int:
        """Its coordinates: angle, amplitudes across, amplitudes along."""
        return 1 + self.modes + self.axial

    def field(self, x: Array, order: int) -> Array:
        """Complex displacement per amplitude at fractions of the length, or a derivative by the length."""
        across = self.shapes(self.modes, x, order) / self.length**order
        even = (x, np.full_like(x, 1 / self.length), np.zeros_like(x))[order]
        return np.vstack([1j * across, *([even] if self.axial else []), across[: max(self.axial - 1, 0)]])

    def stiffness(self) -> Array:
        """Of the amplitudes."""
        slope, curving = self.field(X, 1).real, self.field(X, 2).imag
        return self.length * (self.stretching * (slope * W) @ slope.T + self.bending * (curving * W) @ curving.T)


def motion(bars: list[Bar], start: Array, rates: Array, times: Array, gravity: float) -> Array:
    """Ends of the bars, hung on the origin and on each other, (times, bars) complex."""
    sizes = np.cumsum([0, *(bar.size for bar in bars)])
    n = sizes[-1]
    fields = [(bar.field(X, 0), bar.field(X, 1), bar.field(np.ones(1), 0)) for bar in bars]
    stiff = [bar.stiffness() for bar in bars]

    def kinematics(q: Array, v: Array) -> list[tuple[Array, Array, Array, Array]]:
        """Of all masses: mass, derivatives of the place, acceleration without that of q, whether it weighs."""
        found, base, bias = [], np.zeros((1, n), dtype=complex), np.zeros(1, dtype=complex)
        for bar, first, (f0, f1, f_end) in zip(bars, sizes, fields, strict=False):
            part = slice(first + 1, first + bar.size)
            e, spin = np.exp(1j * q[first]), v[first]

            def reach(place: Array, field: Array, part=part, e=e, spin=spin, first=first) -> tuple[Array, Array]:  # type: ignore[no-untyped-def]
                way, rate = place + q[part] @ field, v[part] @ field
                jacobian = np.zeros((len(way), n), dtype=complex)
                jacobian[:, first], jacobian[:, part] = 1j * e * way, e * field.T
                return jacobian, e * (-(spin**2) * way + 2j * spin * rate)

            jacobian, change = reach(X * bar.length, f0)
            weight = np.ones(len(X))
            found.append((bar.line * bar.length * W, base + jacobian, bias + change, weight))
            jacobian, change = reach(np.ones(len(X)), 1j * f1.imag)
            found.append((bar.rotary * bar.length * W, jacobian, change, 0 * weight))
            jacobian, change = reach(np.array([bar.length]), f_end)
            base, bias = base + jacobian, bias + change
        return found

    def rhs(t: float, y: Array) -> Array:
        q, v = y[:n], y[n:]
        mass, force = np.zeros((n, n)), np.zeros(n)
        for m, jacobian, bias, weight in kinematics(q, v):
            mass += np.real(jacobian.conj().T @ (m[:, None] * jacobian))
            force += np.real(jacobian.conj().T @ (m * (-1j * gravity * weight - bias)))
        for bar, first, k in zip(bars, sizes, stiff, strict=False):
            part = slice(first + 1, first + bar.size)
            force[part] -= k @ (q[part] + bar.retardation * v[part])
        return np.concatenate([v, np.linalg.solve(mass, force)])

    run = solve_ivp(rhs, (0, times[-1]), np.concatenate([start, rates]), "DOP853", times, rtol=1e-11, atol=1e-13)
    ends = []
    for y in run.y.T:
        place, here = 0j, []
        for bar, first, (_, _, f_end) in zip(bars, sizes, fields, strict=False):
            place = place + np.exp(1j * y[first]) * (bar.length + y[first + 1 : first + bar.size] @ f_end[:, 0])
            here.append(place)
        ends.append(here)
    return np.array(ends)
