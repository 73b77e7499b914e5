"""Bodies other than rods: rigid bodies, modal bodies (floating frame of reference formulation), point masses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from shoal.scene.record import NonNegative, Positive, Record, Vector, Vector3


def _formed(given: Any) -> Any:
    try:
        shape: tuple[int, ...] | None = np.shape(given)
    except ValueError:  # rows of different lengths
        shape = None
    if shape not in ((), (3,), (3, 3)):
        raise ValueError(f"a number, three principal moments or a 3 x 3 matrix [kg m^2], found {given!r}")
    return given


Principal = tuple[NonNegative, NonNegative, NonNegative]
Matrix = tuple[Vector3, Vector3, Vector3]
if TYPE_CHECKING:
    Inertia = Any  # in the plane one number, or one a lane
else:
    Inertia = Annotated[NonNegative | Principal | Matrix, BeforeValidator(_formed)]


class RigidBody(Record):
    """A rigid body of any shape."""

    kind: Literal["rigid-body"] = "rigid-body"
    mass: Positive
    """Mass [kg]."""
    inertia: Inertia
    """Moment of inertia about the centre of mass [kg m^2]. In space a number (the same about every axis), three
    principal moments about the axes of the body's frame, or a symmetric matrix in it.
    """
    centre_of_mass: Vector = (0.0, 0.0)
    """Centre of mass in the body's frame [m]."""
    named_points: dict[str, Vector] = {}
    """Points in the body's frame by name [m]. `start` is the origin unless it is named here."""
    element: Literal["rigid"] = "rigid"
    limiting: ClassVar[tuple[str, ...]] = ("inertia",)

    @model_validator(mode="after")
    def _possible(self) -> RigidBody:
        if isinstance(self.inertia, tuple):
            matrix = np.array(self.inertia) if isinstance(self.inertia[0], tuple) else np.diag(self.inertia)
            if np.max(np.abs(matrix - matrix.T)) > 1e-9 * np.max(np.abs(matrix)):
                raise ValueError("inertia: the matrix is not symmetric")
            a, b, c = np.linalg.eigvalsh(matrix)
            if a < -1e-12 * c or a + b < c * (1 - 1e-9):
                raise ValueError(
                    f"inertia: no body has the principal moments {a:g}, {b:g}, {c:g} kg m^2; none is negative or "
                    "larger than the sum of the others"
                )
        return self

    @property
    def inertia_matrix(self) -> Any:
        """Inertia about the centre of mass in the body's frame [kg m^2], (3, 3), or (3, 3, lanes)."""
        if not isinstance(self.inertia, tuple):
            return np.multiply.outer(np.eye(3), self.inertia)
        if isinstance(self.inertia[0], tuple):
            return np.array(self.inertia)
        moments = np.stack(np.broadcast_arrays(*self.inertia))
        return np.einsum("ij,i...->ij...", np.eye(3), moments)

    @property
    def points(self) -> dict[str, Vector]:
        """Named points in the body's frame [m]."""
        return {"start": (0.0, 0.0), **self.named_points}


Rows = Annotated[tuple[float, ...] | tuple[tuple[float, ...], ...], Field(min_length=1)]
"""A matrix by its rows, or by its diagonal."""


class Mode(Record):
    """A shape (u, v) by which the material points of a body move in its frame, per unit of its amplitude."""

    translation: tuple[float, float] = (0.0, 0.0)
    """Integral of (u, v) over the mass [kg]."""
    moment: float = 0.0
    """Integral of x v - y u over the mass [kg m]."""
    stretch: float = 0.0
    """Integral of x u + y v over the mass [kg m]."""
    points: dict[str, Annotated[tuple[float, ...], Field(min_length=2, max_length=3)]] = {}
    """(u, v) or (u, v, turn) at named points [1, 1, rad/m]; zero at others."""


class ModalBody(Record):
    """A body of the plane that bends by given modes: a floating frame and small displacements in it."""

    kind: Literal["modal-body"] = "modal-body"
    mass: Positive
    """Mass [kg]."""
    inertia: Positive
    """Moment of inertia about the centre of mass of the undeformed body [kg m^2]."""
    centre_of_mass: tuple[float, float] = (0.0, 0.0)
    """Centre of mass of the undeformed body in its frame [m]."""
    named_points: dict[str, tuple[float, float]] = {}
    """Points of the undeformed body in its frame by name [m]."""
    modes: Annotated[tuple[Mode, ...], Field(min_length=1)]
    """The shapes."""
    modal_mass: Rows
    """Integrals of u_i u_j + v_i v_j over the mass [kg], by rows or by the diagonal."""
    modal_stiffness: Rows
    """Modal stiffness [N/m], by rows or by the diagonal."""
    modal_damping: Rows | None = None
    """Modal damping [N s/m], by rows or by the diagonal; default zero."""
    modal_coupling: Rows | None = None
    """Integrals of u_i v_j - v_i u_j over the mass [kg], the gyroscopic coupling of modes in a rotating frame; default
    zero.
    """
    element: Literal["modal"] = "modal"

    @model_validator(mode="after")
    def _possible(self) -> ModalBody:
        count = len(self.modes)
        for field in ("modal_mass", "modal_stiffness", "modal_damping", "modal_coupling"):
            rows = getattr(self, field)
            shape = {len(row) if isinstance(row, tuple) else count for row in rows or ()}
            if rows is not None and (len(rows) != count or shape != {count}):
                raise ValueError(f"{field}: needs {count} rows of {count} numbers, or {count} numbers on its diagonal")
            matrix, sign = self.matrix(field)[..., 0], -1 if field == "modal_coupling" else 1
            if np.max(np.abs(matrix - sign * matrix.T)) > 1e-9 * np.max(np.abs(matrix)):
                raise ValueError(f"{field}: is not {'anti' * (sign < 0)}symmetric")
        for field in ("modal_stiffness", "modal_damping"):
            found = np.linalg.eigvalsh(self.matrix(field)[..., 0])
            if found[0] < -1e-9 * np.max(np.abs(found)):
                raise ValueError(f"{field}: has a negative eigenvalue; no motion gains energy by deformation")
        for number, mode in enumerate(self.modes):
            for name in mode.points:
                if name not in self.points:
                    known = ", ".join(self.points)
                    raise ValueError(f"modes.{number}.points: no named point {name!r}; there are {known}")
        _check_inertia(self.moments[..., 0])
        return self

    def matrix(self, field: str) -> Any:
        """One of the modal matrices, (modes, modes, lanes); zeros where it is not stated."""
        rows, count = getattr(self, field), len(self.modes)
        if rows is None:
            return np.zeros((count, count, 1))
        if not isinstance(rows[0], tuple):
            rows = [[rows[i] if i == j else 0.0 for j in range(count)] for i in range(count)]
        return _stacked(rows)

    @property
    def moments(self) -> Any:
        """Integrals over the mass of conj(f_a) f_b for the fields 1, x + iy and u + iv of every mode, Hermitian.

        (2 + modes, 2 + modes, lanes)
        """
        x, y = self.centre_of_mass
        arm = self.mass * (x + 1j * y)
        first = [mode.translation[0] + 1j * mode.translation[1] for mode in self.modes]
        second = [mode.stretch + 1j * mode.moment for mode in self.modes]
        turning = self.inertia + self.mass * (x**2 + y**2)
        upper = _stacked([[self.mass, arm, *first], [np.conj(arm), turning, *second]])
        lower = self.matrix("modal_mass") + 1j * self.matrix("modal_coupling")
        lanes = max(upper.shape[2], lower.shape[2])
        left = np.conj(upper[:, 2:]).swapaxes(0, 1)
        parts = (np.broadcast_to(part, (*part.shape[:2], lanes)) for part in (left, lower, upper))
        left, lower, upper = parts
        return np.concatenate([upper, np.concatenate([left, lower], axis=1)])

    @property
    def points(self) -> dict[str, Vector]:
        """Named points in the body's frame [m]."""
        return {"start": (0.0, 0.0), **self.named_points}

    @property
    def elements(self) -> int:
        """It is one element."""
        return 1


def _stacked(rows: Any) -> Any:
    """A matrix of numbers, or of one number a lane, (rows, columns, lanes)."""
    flat = np.broadcast_arrays(*(np.atleast_1d(np.asarray(entry)) for row in rows for entry in row))
    return np.stack(flat).reshape(len(rows), len(rows[0]), -1)


_INDEPENDENT = 1e-10
"""Smallest eigenvalue of a body's moments, each scaled to one, with which its modes count as independent."""


def _check_inertia(moments: Any) -> None:
    """Raises ValueError where no distribution of mass has these moments, or modes move it as a rigid body does."""
    scale = np.sqrt(np.real(np.diag(moments)))
    if not np.all(scale > 0):
        raise ValueError("modal_mass: every mode moves mass; a number on the diagonal is not positive")
    if np.min(np.linalg.eigvalsh(moments / np.outer(scale, scale))) < _INDEPENDENT:
        raise ValueError(
            "modal_mass: with translation, moment, stretch and modal_coupling no mass has it, or the modes and the "
            "displacements c + d (x + iy) depend on each other; leave out modes that stretch the whole body evenly"
        )


class PointMass(Record):
    """A mass without extension."""

    kind: Literal["point-mass"] = "point-mass"
    mass: Positive
    """Mass [kg]."""
    element: Literal["rigid"] = "rigid"

    @property
    def points(self) -> dict[str, Vector]:
        """The one point there is."""
        return {"start": (0.0, 0.0)}
