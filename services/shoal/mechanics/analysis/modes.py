"""Eigenfrequencies and shapes of small motions about a state at rest.

In a basis Z of the directions that the constraints leave free, Z' M Z = I, small motions obey
y'' + Z' D Z y' + Z' (K + sum lambda_k C_k,qq) Z y = 0 with the lambda that hold the state. About a state that is not an
equilibrium these are the motions relative to its fall. Dry friction is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import scipy.linalg

from shoal.errors import ComputationError
from shoal.mechanics.analysis.balance import Balance, zero_level
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.evaluate import Evaluator, points
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.assembly.placement import place
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.scene import Scene
from shoal.trajectory import plain

Complex = npt.NDArray[np.complex128]
DAMPED_AT_MOST = 400
"""So many undamped modes are coupled by damping at most, the lowest ones."""


@dataclass(frozen=True)
class Mode:
    """One small motion, shape * exp(eigenvalue * t).

    eigenvalue [1/s]: imaginary part the frequency of the oscillation [rad/s], real part its growth. shape: displacement
    of the coordinates, real and with shape' M shape = 1 where nothing is damped, (unknowns,). points: displacement
    of the markers, (markers, d); angles: their turns, (markers,).
    """

    eigenvalue: complex
    shape: Complex
    points: Complex
    angles: Complex

    @property
    def angular_frequency(self) -> float:
        """Frequency without the damping [rad/s]; 0 for motions that do not oscillate."""
        return abs(self.eigenvalue) if self.eigenvalue.imag > 0 else 0.0

    @property
    def frequency(self) -> float:
        """The same in Hz."""
        return self.angular_frequency / (2 * np.pi)

    @property
    def damped_frequency(self) -> float:
        """Frequency of the oscillation with its damping [Hz]."""
        return self.eigenvalue.imag / (2 * np.pi)

    @property
    def damping_ratio(self) -> float:
        """Damping over critical damping; 1 for motions that creep back, negative for those that grow."""
        return 0.0 - self.eigenvalue.real / abs(self.eigenvalue) if self.eigenvalue else 0.0

    @property
    def kind(self) -> str:
        """Oscillating, creeping back, free (nothing pulls back) or unstable."""
        if self.eigenvalue.real > 1e-9 * abs(self.eigenvalue):
            return "unstable"
        if not self.eigenvalue:
            return "free"
        return "oscillating" if self.eigenvalue.imag > 0 else "creeping"


@dataclass(frozen=True)
class Modes:
    """The lowest modes about a state q, slowest first (unstable ones before all). balanced: whether forces balance.

    mesh_errors: how far each eigenvalue is from the limit of ever finer meshes, relative; empty if not known
    """

    scene: Scene
    about: str
    balanced: bool
    message: str
    q: Array
    markers: tuple[str, ...]
    modes: tuple[Mode, ...]
    mesh_errors: tuple[float, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the state is an equilibrium, or was asked for as it is, and no mode grows."""
        return (self.balanced or self.about == "start") and all(mode.kind != "unstable" for mode in self.modes)

    @property
    def frequencies(self) -> Array:
        """Frequencies without damping [Hz], (modes,)."""
        return np.array([mode.frequency for mode in self.modes])

    def to_json(self) -> dict[str, Any]:
        """Plain data, which `shoal modes --json` prints."""
        return {
            "status": "ok" if self.ok else "unstable",
            "message": self.message,
            "about": self.about,
            "balanced": self.balanced,
            "modes": [
                {
                    "kind": mode.kind,
                    "frequency": mode.frequency,
                    "angular_frequency": mode.angular_frequency,
                    "damped_frequency": mode.damped_frequency,
                    "damping_ratio": mode.damping_ratio,
                    "growth": mode.eigenvalue.real,
                    "mesh_error": self.mesh_errors[number] if self.mesh_errors else None,
                    "shape": {
                        name: {
                            **{f"d{axis}": _two(part) for axis, part in zip("xyz", mode.points[k], strict=False)},
                            "dangle": _two(mode.angles[k]),
                        }
                        for k, name in enumerate(self.markers)
                    },
                }
                for number, mode in enumerate(self.modes)
            ],
        }


def modes(
    scene: Scene,
    *,
    about: Literal["equilibrium", "start"] = "equilibrium",
    time: float = 0.0,
    count: int = 10,
    leave_unstable: bool = True,
) -> Modes:
    """The lowest modes about the static equilibrium, or about the start of the scene, with drives at time [s].

    Raises InputError if the scene cannot be modelled, ComputationError if there is no equilibrium.
    """
    if about == "equilibrium":
        equilibrium = statics(scene, time, leave_unstable=leave_unstable)
        if not equilibrium.balanced:
            raise ComputationError(f"{scene.name}: no equilibrium to vibrate about: {equilibrium.message}")
        return modes_about(equilibrium, count=count)
    evaluator = Evaluator.of(scene, horizon=time)
    q, gap = _balance(scene, evaluator, time).restore(evaluator.model.q0[:, 0].copy())
    if gap > 1e-9:
        raise ComputationError(f"{scene.name}: the joints cannot be closed at the start; they gape by {gap:.2g}")
    return _modes(scene, evaluator, q, time, count, "start", "")


def modes_about(equilibrium: Equilibrium, *, count: int = 10) -> Modes:
    """The `count` lowest modes about an equilibrium."""
    scene, time = equilibrium.scene, equilibrium.time
    evaluator = Evaluator.of(scene, horizon=time)
    evaluator.turns = equilibrium.turns
    return _modes(scene, evaluator, equilibrium.q, time, count, "equilibrium", equilibrium.message)


def _balance(scene: Scene, evaluator: Evaluator, time: float) -> Balance:
    mass = sum(float(body.mass) for body in scene.bodies.values())
    return Balance(evaluator, time, span(scene), mass)


def _modes(scene: Scene, evaluator: Evaluator, q: Array, time: float, count: int, about: str, message: str) -> Modes:
    balance = _balance(scene, evaluator, time)
    view = balance.look(q)
    basis = view.freedom.basis
    stiffness = balance.hessian(q, view)
    damping = np.asarray(basis.T @ (evaluator.damping(q) @ basis))
    values, shapes = _eigen(stiffness, damping, evaluator.follows)
    keep = slice(0, count)
    placement, unknowns = place(scene), evaluator.model.unknowns
    at = points([placement.point(scene, side) for side in scene.markers.values()], unknowns).matrix
    lines = points([placement.direction(scene, side) for side in scene.markers.values()], unknowns)
    turning = lines.turning(q)
    found = []
    for value, y in zip(values[keep], shapes.T[keep], strict=True):
        shape = basis @ y
        found.append(Mode(complex(value), shape, at @ shape, turning @ shape))
    balanced = balance.residual(view) < 1e-5
    return Modes(scene, about, balanced, message, q, tuple(scene.markers), tuple(found))


def _eigen(stiffness: Array, damping: Array, follows: bool) -> tuple[Complex, Complex]:
    """Eigenvalues with their columns of shapes, one of each conjugate pair; those that grow first, then by size."""
    if not len(stiffness):
        return np.zeros(0, dtype=complex), np.zeros((0, 0), dtype=complex)
    damped = bool(np.max(np.abs(damping)) > 0)
    if not follows:
        squares, undamped = scipy.linalg.eigh(stiffness)
        squares = np.where(np.abs(squares) <= zero_level(squares), 0.0, squares)
        if not damped:
            values = np.where(squares < 0, np.sqrt(np.abs(squares)) + 0j, 1j * np.sqrt(np.abs(squares)))
            return _sorted(values, undamped.astype(complex))
        undamped = undamped[:, :DAMPED_AT_MOST]
        stiffness, damping = np.diag(squares[:DAMPED_AT_MOST]), undamped.T @ damping @ undamped
    else:
        undamped = np.eye(len(stiffness))
    n = len(stiffness)
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])
    values, shapes = scipy.linalg.eig(matrix)
    scale = float(np.max(np.abs(values)))
    values = np.where(np.abs(values) <= 1e-8 * scale, 0.0, values)
    values = np.where(np.abs(values.imag) <= 1e-9 * np.abs(values), values.real + 0j, values)
    values = np.where(np.abs(values.real) <= 1e-13 * scale, 1j * values.imag, values)
    keep = values.imag >= 0
    return _sorted(values[keep], undamped @ shapes[:n, keep])


def _sorted(values: Complex, shapes: Complex) -> tuple[Complex, Complex]:
    grows = values.real > 1e-9 * np.abs(values)
    order = np.lexsort([np.abs(values), ~grows])
    return values[order], shapes[:, order]


def _two(value: complex) -> Any:
    """A real number, or real and imaginary part."""
    value = complex(value)
    return plain(value.real) if value.imag == 0 else plain([value.real, value.imag])
