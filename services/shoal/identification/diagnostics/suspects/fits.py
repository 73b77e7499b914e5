"""Fits of the parameters with one candidate each, side by side: those of one machine share the calls of the engine."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.identification.diagnostics.suspects.candidate import FaultHypothesis, with_parameters
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import Descent, descend_each, difference_at
from shoal.identification.methods.least_squares import PATIENCE
from shoal.mechanics.numerics.tile import WIDE
from shoal.trajectory import Array

_ITERATIONS = 15


def groups_of(candidates: Iterable[FaultHypothesis]) -> list[list[FaultHypothesis]]:
    """Candidates of one machine that can be freed beside each other."""
    groups = dict[int, list[FaultHypothesis]]()
    for candidate in candidates:
        groups.setdefault(id(candidate if candidate.alone else candidate.scene), []).append(candidate)
    return list(groups.values())


@dataclass(frozen=True, eq=False)
class Together:
    """A model with all numbers of a group of candidates, of which each point changes those of one."""

    model: ForwardModel
    group: list[FaultHypothesis]

    @cached_property
    def _union(self) -> ForwardModel:
        return with_parameters(self.model, self.group)

    @cached_property
    def _begins(self) -> list[int]:
        sizes = [len(candidate.parameters) for candidate in self.group]
        return list(len(self.model.names) + np.cumsum([0, *sizes[:-1]]))

    def residuals(self, numbers: Sequence[int], points: Sequence[Array]) -> Array:
        """At points (parameters and the candidate's numbers,) of candidates by number, (points, rows). Not counted."""
        union, known = self._union, len(self.model.names)
        stated = np.concatenate([c.vector(np.nan_to_num(c.stated, posinf=1e300)) for c in self.group])
        stated = np.clip(stated, union.lower[known:], union.upper[known:])
        lanes = np.tile(np.append(np.zeros(known), stated), (len(points), 1))
        for lane, k, point in zip(lanes, numbers, points, strict=True):
            lane[:known] = point[:known]
            lane[self._begins[k] : self._begins[k] + len(point) - known] = point[known:]
        return union.uncounted(lanes)

    def fit(self, numbers: Sequence[int], starts: Sequence[Array]) -> list[Descent]:
        """Descend from a start for each of some candidates."""
        models = [self.group[k].freed(self.model) for k in numbers]

        def differentiate(chosen: Sequence[int], points: Sequence[Array]) -> tuple[list[Array], list[Array]]:
            # A point and its neighbours stand in one tile, which has one step: see `differentiate_many`.
            most = 1 + max(len(point) for point in points)
            block = next((size for size in (2, 4, 8, len(WIDE)) if size >= most), most)
            steps = [difference_at(models[k], point) for k, point in zip(chosen, points, strict=True)]
            lanes, owners = list[Array](), list[int]()
            for k, point, step in zip(chosen, points, steps, strict=True):
                beside = [point, *(point + step * unit for unit in np.eye(len(point)))]
                lanes += beside + [point] * (block - len(beside))
                owners += [numbers[k]] * block
            seen = self.residuals(owners, lanes).reshape(len(points), block, -1)
            jacobians = list[Array]()
            for found, step in zip(seen, steps, strict=True):
                with np.errstate(invalid="ignore"):
                    slope = ((found[1 : 1 + len(step)] - found[0]) / step[:, None]).T
                jacobians.append(np.where(np.isfinite(slope), slope, 0.0))
            return list(seen[:, 0]), jacobians

        return descend_each(models, starts, differentiate, patience=PATIENCE, most=_ITERATIONS)
