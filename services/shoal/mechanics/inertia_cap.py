"""Longer steps for leapfrog: more inertia for axial vibrations that are too fast for the step.

Rods are stiff against stretching, and the step of an explicit integrator has to follow vibrations that move the
machine little. With the stiffness S of all rods against stretching, the same in every direction, and S phi = w^2 M phi,

    M' = M + sum over w > c of (w^2/c^2 - 1) M phi phi' M,    c = 2 SHARE/h,

slows every such mode to the frequency c that leapfrog resolves with the step h. M' is constant and turns with the
machine; energy is conserved; translations keep their inertia, rotations gain as little as they have of these modes. So
fast bending is slowed as well. All of it vanishes as the step becomes shorter. This is selective mass scaling
(Olovsson, Simonsson and Unosson, Int. J. Numer. Meth. Engng 63, 2005, 1436-1445), mode by mode.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.mechanics.model import Model
from shoal.mechanics.numerics import alike
from shoal.mechanics.numerics.tile import Array

SHARE = 0.95
"""Of the highest frequency that leapfrog resolves; the rest is for bending on top of stretching."""


def capped(model: Model, step: float) -> Model:
    """The model with as much more inertia as a step [s] of leapfrog asks for; itself where it asks for none."""
    if not model.stretching_entries:
        return model
    components, mass_entries = alike.analyse(model.unknowns, model.dimensions, model.mass_entries)
    also, stretching_entries = alike.analyse(model.unknowns, model.dimensions, model.stretching_entries)
    if also != components:
        components, mass_entries, stretching_entries = 1, model.mass_entries, model.stretching_entries
    size = model.unknowns // components
    mass = _dense(mass_entries, size)
    root = np.linalg.cholesky(mass)
    inverse = np.linalg.inv(root)
    squares, modes = np.linalg.eigh(inverse @ _dense(stretching_entries, size) @ inverse.swapaxes(-1, -2))
    excess = np.maximum(squares / (2 * SHARE / step) ** 2 - 1, 0.0)
    moved = root @ modes  # M phi, as M = root root' and phi = root'^-1 modes
    mass = mass + (moved * excess[:, None, :]) @ moved.swapaxes(-1, -2)
    entries = {
        (components * i + c, components * j + c): mass[:, i, j]
        for i in range(size)
        for j in range(i + 1)
        for c in range(components)
    }
    slowed = components * int(np.max(np.count_nonzero(excess, axis=1)))
    return replace(model, mass_entries=entries, slowed=slowed, shared_tiles={}) if slowed else model


def _dense(entries: dict[tuple[int, int], Array], size: int) -> Array:
    """The symmetric matrices of all lanes, (lanes, size, size) or (1, size, size)."""
    matrix = np.zeros((max(np.size(value) for value in entries.values()), size, size))
    for (i, j), value in entries.items():
        matrix[:, i, j] = matrix[:, j, i] = value
    return matrix
