"""Experimental designs: where to run for a polynomial, and which parameters take part in its products.

Each place is the one at which the fit knows least, which makes the determinant of the fit grow most (sequential
D-optimal design: Wynn, The sequential generation of D-optimum experimental designs, Annals of Mathematical Statistics
41, 1970). Of many parameters, elementary effects at the ends of a star choose those with products (Morris, Factorial
sampling plans for preliminary computational experiments, Technometrics 33, 1991); omitted products are part of the
error of the polynomial at runs that it has not seen, in which all parameters vary.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from shoal.response.extremes import MOST_CORNERS, corners
from shoal.response.inputs import BoolArray, Inputs
from shoal.response.polynomials import Terms, size, total_degree
from shoal.response.study import Study, fair_runs
from shoal.trajectory import Array

CHOICE = 8
"""Candidate places for every term."""
FEWEST = 256
"""Candidate places, at least."""
APART = 1e-3
"""Distance below which two places are one: about that of extremal points at the ends for degree 40, 1 / 40^2."""
UNKNOWN = 1e-8
"""Prior information on every term, as a share of that of one run."""


def box_places(inputs: Inputs, count: int, seed: int) -> Array:
    """Denser towards the faces of the box, where polynomials need runs; its corners, and places on its faces."""
    parameters = len(inputs)
    drawn = np.sin(0.5 * np.pi * inputs.sobol(count, seed))
    onto = np.where(np.abs(drawn) > np.cos(np.pi / 8), np.sign(drawn), drawn)
    found = [drawn, onto, np.eye(parameters), -np.eye(parameters)]
    if parameters <= MOST_CORNERS:
        found.append(corners(parameters))
    return np.concatenate(found)


def informative_places(inputs: Inputs, xi: Array, terms: Terms, count: int, places: Array) -> Array:
    """Choose places that determine the terms best beside the runs at `xi`, (count, parameters)."""
    known = inputs.basis(xi, terms)
    factor = np.linalg.cholesky(known.T @ known + UNKNOWN * np.eye(len(terms)))
    # Rows in which what is known has the unit matrix: their squares are the prediction variance at a place.
    rows = solve_triangular(factor, inputs.basis(places, terms).T, lower=True).T
    unknown = np.einsum("ij,ij->i", rows, rows)
    chosen: list[int] = []
    taken = np.empty((min(count, len(places)), len(terms)))
    for k in range(len(taken)):
        best = int(np.argmax(unknown))
        chosen.append(best)
        # The direction of new information of a run there, of the length by which it lessens the variance.
        new = rows[best] - taken[:k].T @ (taken[:k] @ rows[best])
        taken[k] = new / np.sqrt(1 + unknown[best])
        unknown -= (rows @ taken[k]) ** 2
    return np.asarray(places[chosen])


def box_design(inputs: Inputs, xi: Array, terms: Terms, count: int, seed: int) -> Array:
    """Choose places in the box of intervals for these terms beside the runs at `xi`."""
    if count <= 0:
        return np.empty((0, len(inputs)))
    places = box_places(inputs, max(FEWEST, CHOICE * len(terms)), seed)
    apart = np.full(len(places), np.inf)
    for known in xi:
        apart = np.minimum(apart, np.abs(places - known).max(axis=1))
    return informative_places(inputs, xi, terms, count, places[apart > APART])


MOST_ACTIVE = 10
"""Parameters up to which none is screened out."""
SMALL = 0.02
"""Joint share of the effects of all parameters that those screened out have in each group, at most."""
ALONE = 2
"""Degree of the terms of a parameter that is screened out: its effects at both ends and the centre determine two."""


@dataclass(frozen=True)
class Screened:
    """A study, and which of its parameters take part in products, (parameters,)."""

    study: Study
    active: BoolArray

    @property
    def fair(self) -> int:
        """Runs that the terms may take without further reason, as `Study.fair`."""
        return fair_runs(self.size(4))

    def size(self, degree: int) -> int:
        """Number of `terms`."""
        count = int(self.active.sum())
        return size(count, degree) + (len(self.active) - count) * min(degree, ALONE)

    def terms(self, degree: int) -> Terms:
        """Return terms of total degree, the lower ones first, the linear ones in the order of the parameters."""
        whole = np.zeros((size(int(self.active.sum()), degree), len(self.active)), dtype=np.int64)
        whole[:, self.active] = total_degree(int(self.active.sum()), degree)
        alone = np.eye(len(self.active), dtype=np.int64)[~self.active]
        terms: Terms = np.concatenate([whole, *(k * alone for k in range(1, min(degree, ALONE) + 1))])
        order: Terms = terms[np.lexsort((*(-terms.T[::-1]), terms.sum(axis=1)))]
        return order

    @cached_property
    def why(self) -> str:
        """Description, empty where all parameters take part."""
        left = [name for name, active in zip(self.study.inputs.names, self.active, strict=True) if not active]
        return f"; {len(left)} of {len(self.active)} parameters have little effect and no products" if left else ""


def screened(study: Study) -> Screened:
    """Screen parameters by the runs of a star: the centre and both ends of every axis."""
    parameters, xi, values = len(study.inputs), study.runs.xi, study.runs.values
    everyone = np.ones(parameters, dtype=bool)
    if parameters <= MOST_ACTIVE:
        return Screened(study, everyone)
    arms = np.zeros((parameters, values.shape[1]))
    middle = values[np.abs(xi).max(axis=1).argmin()]
    for k, unit in enumerate(np.eye(parameters)):
        beside = (xi == unit).all(axis=1) | (xi == -unit).all(axis=1)
        # What failed at both ends may do anything.
        arms[k] = (
            np.abs(values[beside] - middle).max(axis=0) if beside.any() else values.max(axis=0) - values.min(axis=0)
        )
    # Of every group the effect at the instant where it is largest, beside that of all parameters there.
    groups = study.groups.max() + 1
    effect = np.zeros((parameters, groups))
    for group in range(groups):
        effect[:, group] = arms[:, study.groups == group].max(axis=1)
    share = effect / np.maximum(effect.sum(axis=0), 1e-300)
    order = np.argsort(share.max(axis=1))
    small = order[np.cumsum(share[order], axis=0).max(axis=1) <= SMALL]
    everyone[small] = False
    everyone[order[: parameters - MOST_ACTIVE]] = False
    return Screened(study, everyone)
