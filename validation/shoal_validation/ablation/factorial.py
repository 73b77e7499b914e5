"""A full factorial over the parts of the swarm, and the effect of each part paired over seeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.stats import bootstrap
from shoal.trajectory import Array

PARTS = ("traditional seed", "previous seed", "velocity", "mutation")
"""Seed from the traditional optimum, seed from the previous optimum, w v and the last term of eq. 17."""

Combination = tuple[bool, ...]
"""Which of PARTS are on, (4,)."""


def combinations() -> Iterator[Combination]:
    """All sixteen, none first, all last."""
    yield from product((False, True), repeat=4)


def label(combination: Combination) -> str:
    """The parts that are on by their first letters, for instance `T·VM`."""
    return "".join(part[0].upper() if on else "·" for part, on in zip(PARTS, combination, strict=True))


@dataclass(frozen=True)
class Effect:
    """Mean change by switching a part on, with its 95 % bootstrap interval over the seeds."""

    part: str
    mean: float
    lower: float
    upper: float

    @property
    def falls(self) -> bool:
        """Return whether the part lowers what was measured, beyond chance."""
        return self.upper < 0.0

    @property
    def rises(self) -> bool:
        """Return whether the part raises what was measured, beyond chance."""
        return self.lower > 0.0


def effects(values: Array) -> list[Effect]:
    """The effect of each of PARTS on measured values, (2, 2, 2, 2, seeds), index 1 standing for on.

    Each seed gives one difference on minus off, the mean over the settings of the other parts. With the traditional
    seed the search is settled before it begins; so the other parts are judged on the settings without it.
    """
    first, *others = range(len(PARTS))
    return [_effect(values, first), *(_effect(values[:1], axis) for axis in others)]


def _effect(values: Array, axis: int) -> Effect:
    difference = values.take(1, axis) - values.take(0, axis)
    paired = difference.reshape(-1, values.shape[-1]).mean(axis=0)
    interval = bootstrap((paired,), np.mean, method="percentile", rng=np.random.default_rng(0)).confidence_interval
    return Effect(PARTS[axis], float(paired.mean()), float(interval.low), float(interval.high))
