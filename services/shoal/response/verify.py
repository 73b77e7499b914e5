"""Verification of a study by more careful runs: known errors of decisive runs, and bounds on a finer mesh."""

from __future__ import annotations

from collections import Counter

import numpy as np

from shoal.response.finer import Finer, repeated
from shoal.response.model_errors import ModelErrors, model_errors, unestimated
from shoal.response.problem import UncertainProblem
from shoal.response.respond import ModelResponse

CHECKED = 6
"""Extremal runs, or drawn ones, that are repeated more carefully."""


def known_errors(problem: UncertainProblem, found: ModelResponse) -> ModelErrors:
    """Return the errors of decisive runs, where they are asked for and there is time. Raises InputError."""
    if not problem.careful:
        return unestimated(problem.model)
    return model_errors(problem.model, found.runs, _decisive(found, problem.asked.seed))


def _decisive(found: ModelResponse, seed: int) -> list[int]:
    """Return the numbers of the runs that attain most bounds, or of some that were drawn."""
    runs = found.runs
    if found.bounds is None:
        drawn = np.random.default_rng(seed).choice(len(runs.germs), min(CHECKED, len(runs.germs)), False)
        return list(drawn.tolist())
    used = Counter([*runs.values.argmin(axis=0).tolist(), *runs.values.argmax(axis=0).tolist()])
    return [run for run, _ in used.most_common(CHECKED)]


def compare_meshes(problem: UncertainProblem, found: ModelResponse) -> Finer | None:
    """Return the bounds that a finer mesh moves, where a model was chosen and there is time. Raises InputError."""
    if problem.asked.tolerance is None or found.bounds is None or not problem.careful:
        return None
    return repeated(problem.model, found.runs)
