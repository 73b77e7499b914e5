"""Rods in space that may spin about their own axes: a motion that changes no place, and with it no equilibrium.

A director rod on two balls, as Euler's column, has one. It is no reason to say that nothing holds the machine, so a
search for an equilibrium leaves such spins out, and checks in the end that no force would turn them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.mechanics.analysis.balance import Balance
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.numerics.tile import Array

UNSEEN = 1e-6
"""A motion whose places and slopes are this part of its directors is a spin."""


def idle_spins(balance: Balance, placement: Placement, q: Array) -> tuple[Array, list[str]]:
    """Free motions at q of directors alone that the unloaded machine has no stiffness against, and the rods that spin.

    The motions z have z' M z = 1 and are given as rows z' M, (spins, unknowns).
    """
    directors = dict(_directors(placement))
    none = np.zeros((0, len(q)))
    if not directors:
        return none, []
    view = balance.look(q, 0.0)
    found = balance.spectrum(q, view, 0.0)
    free = found.shapes[:, np.abs(found.values) <= found.levels]
    if not free.size:
        return none, []
    turning = np.zeros(len(q), dtype=bool)
    turning[[unknown for own in directors.values() for unknown in own]] = True
    _, sizes, ways = np.linalg.svd(free[~turning], full_matrices=True)
    seen = int(np.sum(sizes > UNSEEN * np.max(np.abs(free))))
    spins = free @ ways[seen:].T
    names = [name for name, own in directors.items() if np.max(np.abs(spins[own]), initial=0.0) > UNSEEN]
    return (balance.evaluator.mass @ spins).T, names


def _directors(placement: Placement) -> Iterator[tuple[str, list[int]]]:
    """Rods and the unknowns of their directors, where those are of their own."""
    for name, frame in placement.frames.items():
        if isinstance(frame, BeamFrame) and frame.element.director is not None:
            vectors = [*(node[2] for node in frame.nodes), *frame.axes.values()]
            yield name, sorted({unknown for vector in vectors for unknown in vector.terms})
