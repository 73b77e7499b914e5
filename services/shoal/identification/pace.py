"""The step of a fit to measured data: so short that its error in the channels is small beside their noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.errors import InputError
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.least_squares import descend
from shoal.identification.methods.outcome import Outcome
from shoal.scene import FRAMED, Rod
from shoal.trajectory import Array

_OF_NOISE = 0.1
"""Of the noise: a smaller error of the step is not told from it, and what it does to the answer is in the intervals."""
_HALVINGS = 6
"""At most."""
_SETTLES = 2.0
"""An error that falls by less when the step is halved is not that of the step: the motion is chaotic, for instance."""
_ORDER = 2
"""Of generalized-alpha and leapfrog, one of which `auto` takes where rods have elements."""


def paced(model: ForwardModel, point: Array) -> ForwardModel:
    """The model with its step halved until that counts no more, at a point.

    A step is chosen where the scene leaves the integrator open and rods have elements; the scene's own is the longest.
    Noise that is not stated is what the data show. A run that is rejected has an infinite error. Runs are not
    counted. Raises TimeIsUp.
    """
    rods = [body for body in model.scene.bodies.values() if isinstance(body, Rod)]
    free = model.scene.solver.integrator == "auto" and any(rod.element not in FRAMED for rod in rods)
    if not free:
        return model
    step, before = model.scene.solver.step, np.inf
    try:
        seen = model.uncounted(point[None])[0]
        for halvings in range(1, _HALVINGS + 1):
            shorter = _stepping(model, step / 2**halvings)
            found = shorter.uncounted(point[None])[0]
            error = _between(seen, found) / model.rows.shown
            if error > before / _SETTLES:
                return model
            if error <= _OF_NOISE:
                return _stepping(model, 2 * step / 2**halvings) if halvings > 1 else model
            seen, before = found, error
    except InputError:
        return model
    return shorter if np.isfinite(error) else model


def _between(seen: Array, found: Array) -> float:
    """Error of residuals (rows,) by those of half the step [RMS]; infinite where a run is rejected."""
    if not (np.all(np.isfinite(seen)) and np.all(np.isfinite(found))):
        return np.inf
    return float(np.sqrt(np.mean((found - seen) ** 2))) / (1.0 - 0.5**_ORDER)


def _stepping(model: ForwardModel, step: float) -> ForwardModel:
    return replace(model, scene=model.scene.with_values({"solver.step": step}))


def repaced(model: ForwardModel, outcome: Outcome, progress: Progress) -> tuple[ForwardModel, Outcome]:
    """What was found, or where least squares go from there where motions are faster than at the start. See `paced`."""
    shorter = paced(model, outcome.point)
    if shorter is model:
        return model, outcome
    descent = descend(shorter, outcome.point, progress)
    # Values of different models cannot be compared, so the search before counts without a best value.
    shorter.counter.charge(model.counter.evaluations, outcome.point, np.inf)
    shorter.work += model.work
    rows = [*outcome.iterations, *((len(outcome.iterations) + i, best, mean) for i, best, mean in descent.rows)]
    choice = "; then ".join(part for part in (outcome.choice, "least squares with a shorter step") if part)
    return shorter, replace(outcome, point=descent.point, fitness=descent.fitness, iterations=rows, choice=choice)
