"""Small motions about a steady motion: gyroscopic modes, as an observer at rest sees them, and their sense of whirl.

In a basis Z of the free directions, Z' M Z = I, small motions in the moving frame obey
y'' + Z' (D + 2 M A) Z y' + Z' (K + M A^2) Z y = 0. A frame that is carried at the rate W about n shifts what turns in
it: of a displacement u the part along n keeps its frequency, and those that turn with and against the frame,
(u1 +- i u2)/2, have it raised and lowered by W. A mode of which one part is nearly all has that frequency at rest; any
other, as of a blade, is stated in the turning frame (Genta, Dynamics of Rotating Systems, 2005).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import combined, points
from shoal.mechanics.analysis.damped import Complex, roots
from shoal.mechanics.analysis.small_motions import parts_of, spectrum
from shoal.mechanics.analysis.steady import FITS, Steady
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Scene

ALONE = 0.9
"""A part of a mode with more than this share of its kinetic energy is the mode."""
PLANAR = 1e-3
"""Orbits whose forward and backward parts differ by a smaller share go to and fro."""
LINE = 1e-9
"""Parts across the axis below this share of a mode are none."""


class Whirl(NamedTuple):
    """A mode about a steady motion, shape * exp(eigenvalue * s) in the moving frame.

    value: the eigenvalue at rest [1/s], or that of the moving frame where `rotating`; whirl: forward, backward or none.
    hidden: whether it is zero only within round-off
    """

    value: complex
    shape: Complex
    whirl: str
    rotating: bool


def whirls(steady: Steady, placement: Placement) -> list[Whirl]:
    """All modes about a steady motion, those that grow first, then by frequency."""
    seen = steady.here()
    stiffness, gyroscopic = steady.stiffness(seen), steady.gyroscopic(seen)
    symmetric = stiffness._replace(matrix=(stiffness.matrix + stiffness.matrix.T) / 2)
    mass, basis = steady.evaluator.mass, seen.freedom.basis
    found = spectrum(symmetric, basis, mass, parts_of(mass, steady.evaluator.at(steady.q, t=steady.t).jacobian))
    solved = roots(stiffness, gyroscopic, found, follows=True)
    observed = _Observed(steady, placement)
    modes = [
        observed.mode(complex(value), shape, float(level))
        for value, shape, level in zip(solved.values, solved.shapes.T, solved.levels, strict=True)
    ]
    # A coordinate that nothing holds has two eigenvalues of zero, for its place and its rate.
    still = [mode for mode in modes if mode.value == 0]
    modes = [*still[: (len(still) + 1) // 2], *(mode for mode in modes if mode.value != 0)]
    return sorted(modes, key=lambda mode: (mode.value.real <= 1e-9 * abs(mode.value), abs(mode.value)))


class _Observed:
    """Displacements and rotations of bodies, times the roots of their masses and inertias, in axes of their frames."""

    def __init__(self, steady: Steady, placement: Placement) -> None:
        self.steady = steady
        rows: list[Array] = []
        rates: list[float] = []
        for name, weight, matrix in _motions(steady, placement):
            carried = steady.carried[name]
            rate = float(np.linalg.norm(carried))
            rate = rate if rate > FITS * steady.speed else 0.0
            axis = carried / rate if rate else steady.axis
            one, other = (np.asarray(side).ravel() for side in turns.across(axis[:, None]))
            rows.append(weight * (np.stack([one, other, axis]) @ matrix))
            rates.append(rate)
        self.matrix = np.array(rows).reshape(-1, 3, len(steady.q))
        self.rates = np.array(rates)

    def mode(self, value: complex, shape: Complex, level: float) -> Whirl:
        """One mode, as it is seen at rest."""
        first, second, along = np.moveaxis(self.matrix @ shape, 1, 0) if len(self.rates) else np.zeros((3, 0))
        parts = {
            1: np.abs(first + 1j * second) ** 2 / 2,
            -1: np.abs(first - 1j * second) ** 2 / 2,
            0: np.abs(along) ** 2,
        }
        shares: dict[float, Array] = {}
        for sign, energies in parts.items():
            for rate, energy in zip(self.rates, energies, strict=True):
                # In a frame at rest all parts have the frequency of the mode.
                both = shares.setdefault(round(sign * rate, 9), np.zeros(3))
                both[sign] += energy
        total = sum(float(np.sum(share)) for share in shares.values())
        if not total > 0:
            return Whirl(value, shape, "", False)
        shift = max(shares, key=lambda one: float(np.sum(shares[one])))
        rotating = bool(np.sum(shares[shift]) < ALONE * total)
        if rotating:
            return Whirl(value, shape, "", True)
        seen = value + 1j * shift
        if abs(seen) <= max(level, 1e-9 * abs(shift)):
            return Whirl(0j, shape, "", False)
        _, forward, backward = shares[shift]
        if seen.imag < 0:
            seen, shape, forward, backward = seen.conjugate(), shape.conj(), backward, forward
        across = forward + backward
        turning = self.steady.speed > 0 and seen.imag > 0 and across > LINE * np.sum(shares[shift])
        if not turning or abs(forward - backward) <= PLANAR * across:
            return Whirl(seen, shape, "", False)
        return Whirl(seen, shape, "forward" if forward > backward else "backward", False)


def _motions(steady: Steady, placement: Placement) -> list[tuple[str, float, Array]]:
    """Bodies, the roots of their masses and inertias, and what moves of them by the coordinates, (3, unknowns)."""
    scene, n = steady.scene, len(steady.q)
    found: list[tuple[str, float, Array]] = []
    for name, frame in placement.frames.items():
        body: Any = scene.bodies[name]
        mass = float(np.max(np.asarray(body.mass)))
        if isinstance(frame, BeamFrame):
            places = points([node[0] for node in frame.nodes], n).matrix
            weights = np.full(len(places), np.sqrt(mass / (len(places) - 1)))
            weights[[0, -1]] *= np.sqrt(0.5)
            found += [(name, float(w), _spatial(place)) for w, place in zip(weights, places, strict=True)]
            continue
        if not isinstance(frame, RigidFrame):
            found.append((name, np.sqrt(mass), _spatial(points([frame.vectors[0]], n).matrix[0])))
            continue
        centre = frame.origin + combined(frame.directors, _centre(scene, name))
        found.append((name, np.sqrt(mass), _spatial(points([centre], n).matrix[0])))
        found.append((name, np.sqrt(_across(body, frame, steady)), _rotation(frame, steady.q)))
    return found


def _centre(scene: Scene, name: str) -> tuple[float, ...]:
    body: Any = scene.bodies[name]
    centre = [float(np.max(np.asarray(part))) for part in np.atleast_1d(body.centre_of_mass)]
    return tuple([*centre, 0.0, 0.0][: scene.dimensions])


def _across(body: Any, frame: RigidFrame, steady: Steady) -> float:
    """Mean moment of inertia of a body about the axes across that of the motion [kg m^2]."""
    inertia = np.asarray(body.inertia, dtype=float)
    if inertia.ndim == 0:
        return float(inertia)
    matrix = np.diag(inertia) if inertia.ndim == 1 else inertia
    axis = points(list(frame.directors), len(steady.q)).at(steady.q) @ steady.axis
    return float(np.trace(matrix) - axis @ matrix @ axis) / 2


def _rotation(frame: RigidFrame, q: Array) -> Array:
    """Small rotation of a rigid body, half the sum of directors times their changes, (3, unknowns)."""
    found = points(list(frame.directors), len(q))
    now = found.at(q)
    if now.shape[1] == 2:
        turned = np.zeros((3, len(q)))
        turned[2] = now[0, 0] * found.matrix[0, 1] - now[0, 1] * found.matrix[0, 0]
        return turned
    return np.asarray(sum(turns.skew(d) @ matrix for d, matrix in zip(now, found.matrix, strict=True)) / 2)


def _spatial(matrix: Array) -> Array:
    """A displacement in the plane or in space as one in space."""
    return np.vstack([matrix, np.zeros((3 - len(matrix), matrix.shape[1]))])
