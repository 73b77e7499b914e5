"""Which of many parameters take part in the products of a polynomial; the others have terms of their own alone.

What the runs of a star tell of each parameter decides (Morris, Factorial sampling plans for preliminary computational
experiments, Technometrics 33, 1991, by one elementary effect to either side). What is left out is part of the error of
the polynomial at runs that it has not seen, in which all parameters vary.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.response.inputs import BoolArray
from shoal.response.polynomials import Terms, size, total_degree
from shoal.response.study import FAIR, LEAST, Study

MANY = 10
"""Parameters up to which none is screened out."""
SMALL = 0.02
"""Share of the effects of all parameters that those which are screened out have together, at most, in each group."""
ALONE = 2
"""Degree of the terms of a parameter that is screened out."""


@dataclass(frozen=True)
class Screened:
    """A study, and which of its parameters take part in products, (parameters,)."""

    study: Study
    active: BoolArray

    @property
    def fair(self) -> int:
        """As that of a study, of the terms that there are."""
        return max(LEAST, int(FAIR * self.size(4)))

    def size(self, degree: int) -> int:
        """Number of `terms`."""
        count = int(self.active.sum())
        return size(count, degree) + (len(self.active) - count) * min(degree, ALONE)

    def terms(self, degree: int) -> Terms:
        """Of total degree, the lower ones first, the linear ones in the order of the parameters."""
        whole = np.zeros((size(int(self.active.sum()), degree), len(self.active)), dtype=np.int64)
        whole[:, self.active] = total_degree(int(self.active.sum()), degree)
        alone = np.eye(len(self.active), dtype=np.int64)[~self.active]
        terms: Terms = np.concatenate([whole, *(k * alone for k in range(1, min(degree, ALONE) + 1))])
        order: Terms = terms[np.lexsort((*(-terms.T[::-1]), terms.sum(axis=1)))]
        return order

    @cached_property
    def why(self) -> str:
        """In words, empty where all take part."""
        left = [name for name, active in zip(self.study.inputs.names, self.active, strict=True) if not active]
        return f"; {len(left)} of {len(self.active)} parameters have little effect and no products" if left else ""


def screened(study: Study) -> Screened:
    """After the runs of a star: the centre and both ends of every axis."""
    parameters, germs, values = len(study.inputs), study.runs.germs, study.runs.values
    everyone = np.ones(parameters, dtype=bool)
    if parameters <= MANY:
        return Screened(study, everyone)
    arms = np.zeros((parameters, values.shape[1]))
    middle = values[np.abs(germs).max(axis=1).argmin()]
    for k, unit in enumerate(np.eye(parameters)):
        beside = (germs == unit).all(axis=1) | (germs == -unit).all(axis=1)
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
    everyone[order[: parameters - MANY]] = False
    return Screened(study, everyone)
