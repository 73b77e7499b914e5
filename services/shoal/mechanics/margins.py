"""Stability margins of an open loop L: how much more gain, or how much less phase, its closed loop 1 + L = 0 bears.

Frequencies of |L| = 1 are imaginary eigenvalues of a Hamiltonian matrix (Boyd, Balakrishnan and Kabamba 1989), those of
a real L zeros of L(s) - L(-s): no grid of frequencies passes over a resonance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from shoal.errors import InputError
from shoal.mechanics.numerics.tile import Array

IMAGINARY = 1e-6
"""An eigenvalue whose real part is a smaller part of it is imaginary, within round-off of a double one."""
CLOSE = 1e-5
"""|L| at a crossover, or the phase of L there, is off by less."""
MARGINS = {"gain_margin": "1", "gain_reduction": "1", "phase_margin": "deg", "delay_margin": "s"}
"""Quantities that may be required, and their units."""


@dataclass(frozen=True)
class Margins:
    """Margins of a loop.

    stable: whether the closed loop is; of one that is not, no other number is one. gain_margin: the factor by which the
    gain may grow, infinite where no gain is too large; gain_reduction: the factor to which it may fall, 0 where it may
    vanish; phase_margin [deg]: the smallest lag (or lead) that makes the loop oscillate; delay_margin [s]: the delay
    that does. crossovers: frequencies [rad/s] of |L| = 1, and of L < 0.
    """

    stable: bool
    gain_margin: float
    gain_reduction: float
    phase_margin: float
    delay_margin: float
    gain_crossovers: tuple[float, ...]
    phase_crossovers: tuple[float, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain data; what is infinite or unknown is null."""
        return {
            name: value if isinstance(value, bool | tuple) or np.isfinite(value) else None
            for name, value in vars(self).items()
        }


def margins(a: Array, b: Array, c: Array, d: float, *, stable: bool) -> Margins:
    """Return the margins of a loop L(s) = c (s - a)^-1 b + d with one input, (n,), and one output, (n,).

    stable: whether the closed loop is.
    """
    gain_crossovers, phase_crossovers = _unit_gain(a, b, c, d), _negative(a, b, c, d)
    if not stable:
        return Margins(False, *(np.nan,) * 4, gain_crossovers, phase_crossovers)
    sizes = [abs(_at(a, b, c, d, w)) for w in phase_crossovers]
    sizes += [-d] if d < 0.0 else []  # at infinite frequency
    phases = [(np.degrees(np.angle(_at(a, b, c, d, w))) + 180.0) % 360.0 for w in gain_crossovers]
    delays = [np.radians(phase) / w for w, phase in zip(gain_crossovers, phases, strict=True) if w > 0.0]
    return Margins(
        True,
        min((1.0 / size for size in sizes if 0.0 < size < 1.0), default=np.inf),
        max((1.0 / size for size in sizes if size > 1.0), default=0.0),
        min((min(phase, 360.0 - phase) for phase in phases), default=np.inf),
        min(delays, default=np.inf),
        gain_crossovers,
        phase_crossovers,
    )


def _at(a: Array, b: Array, c: Array, d: float, w: float) -> complex:
    """Return L(j w); infinite at a pole."""
    try:
        return complex(c @ np.linalg.solve(1j * w * np.eye(len(a)) - a, b.astype(complex)) + d)
    except np.linalg.LinAlgError:
        return complex(np.inf)


def _unit_gain(a: Array, b: Array, c: Array, d: float) -> tuple[float, ...]:
    """Return the frequencies [rad/s] of |L| = 1, rising."""
    n, rest = len(a), 1.0 - d * d
    if not n or rest == 0.0:
        return ()
    own = a + np.outer(b, c) * (d / rest)
    across, back = np.outer(b, b) / rest, -np.outer(c, c) / rest
    found = np.linalg.eigvals(np.block([[own, across], [back, -own.T]]))
    return _kept(found, lambda w: abs(abs(_at(a, b, c, d, w)) - 1.0) < CLOSE)


def _negative(a: Array, b: Array, c: Array, d: float) -> tuple[float, ...]:
    """Return the frequencies [rad/s] at which L is real and negative, rising."""
    n, none = len(a), np.zeros_like(a)
    if not n:
        return ()
    pencil = np.block(
        [[a, none, b[:, None]], [none, -a, b[:, None]], [np.append(c, c)[None], np.zeros((1, 1))]],
    )
    metric = np.diag(np.append(np.ones(2 * n), 0.0))
    alpha, beta = scipy.linalg.eig(pencil, metric, right=False, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-12 * np.abs(alpha)

    def is_negative(w: float) -> bool:
        value = _at(a, b, c, d, w)
        return value.real < 0.0 and abs(value.imag) < CLOSE * abs(value)

    return _kept(alpha[finite] / beta[finite], is_negative)


def _kept(found: Any, holds: Any) -> tuple[float, ...]:
    """Return the imaginary parts of imaginary eigenvalues at which a condition holds, each once."""
    size = float(np.max(np.abs(found), initial=0.0))
    near = sorted(float(abs(one.imag)) for one in found if abs(one.real) <= IMAGINARY * abs(one) + 1e-12 * size)
    kept = list[float]()
    for w in near:
        if (not kept or w - kept[-1] > 1e-6 * w) and holds(w):
            kept.append(w)
    return tuple(kept)


@dataclass(frozen=True)
class Required:
    """A bound on a margin, from below or above."""

    text: str
    quantity: str
    more: bool
    bound: float

    @classmethod
    def read(cls, text: str) -> Required:
        """Read a requirement such as `phase_margin > 30`. Raises InputError."""
        sign = next((one for one in "><" if one in text), "")
        quantity, _, number = (part.strip() for part in text.partition(sign)) if sign else (text, "", "")
        if quantity not in MARGINS:
            known = ", ".join(f"{name} [{unit}]" for name, unit in MARGINS.items())
            raise InputError(f"require: {text!r}: there are {known}, as in phase_margin > 30")
        try:
            return cls(text, quantity, sign == ">", float(number))
        except ValueError:
            raise InputError(f"require: {text!r}: a number is needed behind {sign or '>'}") from None

    def holds(self, found: Margins) -> bool:
        """Return whether margins are as required; those of an unstable loop never are."""
        value = float(getattr(found, self.quantity))
        return value > self.bound if self.more else value < self.bound


def read_all(texts: Sequence[str]) -> tuple[Required, ...]:
    """Read requirements. Raises InputError."""
    return tuple(map(Required.read, texts))
