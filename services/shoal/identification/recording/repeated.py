"""Samples that stand in two recordings: they would count twice, as if they had been measured twice."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path

import numpy as np
import numpy.typing as npt

from shoal.errors import InputError
from shoal.identification.recording.measurement import Recording
from shoal.trajectory import Array

Samples = npt.NDArray[np.intp]
_SHARED = 2
"""Samples from which on windows overlap: two that touch have one in common."""
_FEWEST = 3
"""Samples, without which there is no motion."""
_SAME = 1e-6
"""Of the interval between samples: times that differ by less are one."""


def check_repeated(recordings: Mapping[str, Recording], files: Mapping[str, Path]) -> None:
    """Refuse two recordings that are fitted to the same samples of a channel. Raises InputError.

    files: where recordings were read from, by their names; the others are not looked at. Two windows of one file, other
    columns of it, and what is held out are no repetition.
    """
    for one, other in combinations(files, 2):
        a, b = recordings[one], recordings[other]
        pairs, (mine, its) = _pairs(a, b), _at_once(a, b)
        for i, k in pairs if files[one].resolve() == files[other].resolve() else ():
            column = a.channels[i].column
            twice = mine[np.isfinite(a.values[mine, i]) & np.isfinite(b.values[its, k])]
            if column == b.channels[k].column and len(twice) >= _SHARED:
                begin, end = a.begin + a.times[twice[0]], a.begin + a.times[twice[-1]]
                raise InputError(
                    f"recordings: {one} and {other} are fitted to the same {len(twice)} samples of column {column!r} "
                    f"of {files[one].name}, {begin:g} s to {end:g} s, which would count twice; name the file once, or "
                    "choose windows (`start`, `duration`) that do not overlap"
                )
        count = np.arange(min(len(a.times), len(b.times)))
        for at, then in ((mine, its), (count, count)):
            if pairs and all(_equal(a.values[at, i], b.values[then, k]) for i, k in pairs):
                raise InputError(
                    f"recordings: {one} and {other} hold the same {len(at)} samples ({files[one].name}, "
                    f"{files[other].name}); a copy would count twice: name it once"
                )


def _pairs(a: Recording, b: Recording) -> list[tuple[int, int]]:
    """Channels by number that show the same thing, or are read from columns of one name."""
    return [
        (i, k)
        for i, one in enumerate(a.channels)
        for k, other in enumerate(b.channels)
        if one.name == other.name or one.column == other.column
    ]


def _at_once(a: Recording, b: Recording) -> tuple[Samples, Samples]:
    """Samples by number, of either recording, at the same times of their tables."""
    times, others = a.begin + a.times, b.begin + b.times
    near = np.clip(np.searchsorted(others, times), 1, len(others) - 1)
    near -= times - others[near - 1] < others[near] - times
    same = np.abs(others[near] - times) <= _SAME * float(np.median(np.diff(times)))
    return np.flatnonzero(same), near[same]


def _equal(one: Array, other: Array) -> bool:
    """Return whether numbers that change are the same to the last digit, and gaps stand in the same places."""
    known = np.isfinite(one)
    return bool(np.sum(known) >= _FEWEST and np.array_equal(one, other, equal_nan=True) and np.ptp(one[known]) > 0.0)
