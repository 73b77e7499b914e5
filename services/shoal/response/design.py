"""Where to run next for a polynomial: places that tell its terms apart best, beside the runs that there are.

Each place is the one at which the fit knows least, which makes the determinant of the fit grow most (sequential
D-optimal design: Wynn, The sequential generation of D-optimum experimental designs, Annals of Mathematical Statistics
41, 1970).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from shoal.response.extremes import MOST_CORNERS, corners
from shoal.response.inputs import Inputs
from shoal.response.polynomials import Terms
from shoal.trajectory import Array

CHOICE = 8
"""Places that are looked at, for every term."""
LEAST = 256
UNKNOWN = 1e-8
"""Of one run: what is known of a term that no run tells of."""


def box_places(inputs: Inputs, count: int, seed: int) -> Array:
    """Denser towards the faces of the box, where polynomials need runs; its corners, and places on its faces."""
    parameters = len(inputs)
    drawn = np.sin(0.5 * np.pi * inputs.sobol(count, seed))
    onto = np.where(np.abs(drawn) > np.cos(np.pi / 8), np.sign(drawn), drawn)
    found = [drawn, onto, np.eye(parameters), -np.eye(parameters)]
    if parameters <= MOST_CORNERS:
        found.append(corners(parameters))
    return np.concatenate(found)


def telling(inputs: Inputs, germs: Array, terms: Terms, count: int, places: Array) -> Array:
    """So many of these places, beside the runs at `germs`, (count, parameters)."""
    known = inputs.basis(germs, terms)
    factor = np.linalg.cholesky(known.T @ known + UNKNOWN * np.eye(len(terms)))
    # Rows in which what is known has the unit matrix: their squares tell how little is known at a place.
    rows = solve_triangular(factor, inputs.basis(places, terms).T, lower=True).T
    unknown = np.einsum("ij,ij->i", rows, rows)
    chosen: list[int] = []
    taken = np.empty((min(count, len(places)), len(terms)))
    for k in range(len(taken)):
        best = int(np.argmax(unknown))
        chosen.append(best)
        # The direction in which a run there tells something new, of the length by which it lessens what is unknown.
        new = rows[best] - taken[:k].T @ (taken[:k] @ rows[best])
        taken[k] = new / np.sqrt(1 + unknown[best])
        unknown -= (rows @ taken[k]) ** 2
    return np.asarray(places[chosen])


def box_design(inputs: Inputs, germs: Array, terms: Terms, count: int, seed: int) -> Array:
    """So many places in the box of intervals for these terms, beside the runs at `germs`."""
    if count <= 0:
        return np.empty((0, len(inputs)))
    places = box_places(inputs, max(LEAST, CHOICE * len(terms)), seed)
    apart = np.full(len(places), np.inf)
    for germ in germs:
        apart = np.minimum(apart, np.abs(places - germ).max(axis=1))
    return telling(inputs, germs, terms, count, places[apart > 1e-3])
