"""Confounded parameters in words: products that are known (`only E/rho`), or relative changes that do not show."""

from __future__ import annotations

from itertools import product
from math import gcd

import numpy as np

from shoal.identification.conventions import HIDDEN
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import MEASUREMENT, RESERVED
from shoal.identification.uncertainty.linearisation import Linearisation
from shoal.trajectory import Array

_INVOLVED = 1e-2
"""Share of an open direction from which on a parameter is part of it."""
_POWERS = range(-3, 4)
"""Exponents of a product: inertia and stiffness of a section depend on cubes of lengths."""
_MOST = 5
"""Parameters in a product, at most."""


def combinations(model: ForwardModel, point: Array, at: Linearisation) -> list[str]:
    """A sentence for each product of powers that is known though its factors are not; else for each open direction."""
    relative = relative_changes(model, point, at)
    if relative is not None:
        involved = np.flatnonzero(np.max(np.abs(relative), axis=1) > _INVOLVED)
        names = [model.names[k] for k in involved]
        found = products(relative[involved], names)
        if found:
            return [f"only {text} is known, not its factors" for text in found]
    sentences = []
    for direction in sparse_basis(at.unknown).T:
        largest = direction / direction[np.abs(direction).argmax()]
        parts = [f"{model.names[k]} {value:+.2g}" for k, value in enumerate(largest) if abs(value) > _INVOLVED]
        sentences.append("unchanged motion under relative changes of " + ", ".join(parts))
    return sentences


def relative_changes(model: ForwardModel, point: Array, at: Linearisation) -> Array | None:
    """Open directions in logarithms of the parameters, (p, k); None where one of them has no relative scale."""
    if not at.unknown.size:
        return None
    values, lower = model.parameters.to_values(point), model.parameters.to_values(model.lower)
    shifts = [f"{RESERVED}.{name}" for name in MEASUREMENT if name not in ("clock", "scale")]
    multiplies = ~model.parameters.initial & np.array([path not in shifts for path in model.parameters.paths])
    multiplies &= (lower >= 0) & (values > 0)
    involved = np.max(np.abs(at.unknown), axis=1) > _INVOLVED
    if not np.all(multiplies[involved]):
        return None
    size = np.where(model.parameters.logarithmic | ~multiplies, 1.0, values)
    directions = np.where(multiplies[:, None], at.unknown * (at.scale / size)[:, None], 0.0)
    return np.asarray(directions / np.max(np.abs(directions), axis=0))


def products(open_directions: Array, names: list[str]) -> list[str]:
    """Independent products of small powers that no open direction (names, k) changes; empty unless all exist."""
    count, hidden = open_directions.shape
    if not 0 < hidden < count <= _MOST:
        return []
    directions, _ = np.linalg.qr(open_directions)
    candidates = [np.array(powers) for powers in product(_POWERS, repeat=count) if gcd(*powers) == 1]
    # The simplest first: few factors, small powers, and a positive first one.
    candidates.sort(key=lambda n: (np.count_nonzero(n), np.abs(n).sum(), *(-n)))
    chosen: list[Array] = []
    for powers in candidates:
        if np.linalg.norm(powers @ directions) > HIDDEN * np.linalg.norm(powers):
            continue
        if np.linalg.matrix_rank(np.array([*chosen, powers])) > len(chosen):
            chosen.append(powers)
    return [_written(powers, names) for powers in chosen] if len(chosen) == count - hidden else []


def _written(powers: Array, names: list[str]) -> str:
    above = [_power(name, n) for name, n in zip(names, powers, strict=True) if n > 0]
    below = [_power(name, -n) for name, n in zip(names, powers, strict=True) if n < 0]
    bottom = "*".join(below) if len(below) < 2 else f"({'*'.join(below)})"
    return ("*".join(above) or "1") + (f"/{bottom}" if below else "")


def _power(name: str, exponent: int) -> str:
    return name if exponent == 1 else f"{name}^{exponent}"


def sparse_basis(unknown: Array) -> Array:
    """The same space with as few parameters per direction as elimination gives."""
    basis = unknown.copy()
    taken: list[int] = []
    for k in range(basis.shape[1]):
        free = [i for i in range(len(basis)) if i not in taken]
        row = free[int(np.abs(basis[free, k]).argmax())]
        taken.append(row)
        basis[:, k] /= basis[row, k]
        for other in range(basis.shape[1]):
            if other != k:
                basis[:, other] -= basis[row, other] * basis[:, k]
    return basis
