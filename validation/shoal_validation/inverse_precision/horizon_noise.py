"""Horizon times noise: where an identification holds, and where its verdict says `identified` of a wrong answer.

The rigid double pendulum, both angles anywhere, from noisy positions of its tip; data by Lagrange's equations, the
model DOP853 on our own. The longer the horizon, the more local minima the box has and the narrower the true one is.

A verdict that is no answer is `failed`, right or wrong. An answer is honest if the truth lies within DEVIATIONS of its
reported standard deviations or is off by no more than the model itself may be, EXACT. It holds when it is honest and
right within RIGHT; it is `inaccurate` when it is only one of the two, and `silently wrong` when it is neither. Of
several draws of the noise the worst counts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from shoal.errors import ComputationError, InputError
from shoal.identification import METHODS, Estimate, identify

from shoal_validation.inverse_precision.cases import RATE, rigid_problem, textbook
from shoal_validation.judge import Outcome

HORIZONS = (0.5, 1.0, 2.0, 5.0, 10.0)
"""Seconds."""
NOISES = (1e-4, 1e-2, 1e-1)
"""Standard deviation of each coordinate of the tip [m]; the machine reaches 3 m."""
RIGHT = 1e-2
"""Largest error of an angle [rad]."""
EXACT = 1e-4
"""Largest error of an angle [rad] that asks for no interval."""
DEVIATIONS = 10.0
SOLVER = {"solver.relative_tolerance": 1e-8, "solver.absolute_tolerance": 1e-8}
LEFT_OUT = ("afsa", "iafsa", "iafsa-printed")
"""AFSA is off by a degree without any noise, after 19 000 evaluations; the seeded swarms begin at the answer of least
squares and only keep or improve it."""
REPEATS = 2
"""Draws of the noise for methods that take no random numbers and little time; one for the others."""


@dataclass(frozen=True)
class Panel:
    """A method on records of one kind.

    stated: whether the problem states the noise, so that the verdict can be told by the residuals' size;
    rate: samples a second
    """

    method: str
    stated: bool = False
    rate: float = RATE

    @property
    def title(self) -> str:
        """In words."""
        return f"{self.method}, noise {'stated' if self.stated else 'not stated'}, {self.rate:g} Hz"


@dataclass(frozen=True)
class Cell:
    """One identification. error [rad]; deviations: the error in reported standard deviations, the largest."""

    method: str
    stated: bool
    rate: float
    horizon: float
    noise: float
    seed: int
    outcome: str
    error: float
    deviations: float
    verdict: str
    message: str
    evaluations: int

    @property
    def panel(self) -> Panel:
        """Panel of the map that shows the cell."""
        return Panel(self.method, self.stated, self.rate)


def panels() -> list[Panel]:
    """Every method at the paper's rate with the noise not stated; least squares with it, and at a tenth of the rate."""
    rest = [Panel(name) for name in METHODS if name not in LEFT_OUT]
    return [Panel("least-squares", stated=True), Panel("least-squares", rate=RATE / 10), *rest]


def measure_panel(
    panel: Panel,
    *,
    horizons: tuple[float, ...] = HORIZONS,
    noises: tuple[float, ...] = NOISES,
    note: Callable[[], None] = lambda: None,
) -> Iterator[Cell]:
    """Every cell and draw of one method."""
    for horizon in horizons:
        for noise in noises:
            for seed in range(REPEATS if panel.method == "least-squares" else 1):
                yield measure_cell(panel, horizon, noise, seed)
            note()


def measure_cell(panel: Panel, horizon: float, noise: float, seed: int) -> Cell:
    """One identification of one draw of the noise."""
    problem = rigid_problem()
    data = textbook(problem, horizon, noise, seed, panel.rate, panel.stated)
    where = (panel.method, panel.stated, panel.rate, horizon, noise, seed)
    try:
        estimate = identify(problem, method=panel.method, measurement=data, values=SOLVER, seed=seed)
    except (InputError, ComputationError) as reason:
        outcome = Outcome.REFUSED if isinstance(reason, InputError) else Outcome.FAILED
        return Cell(*where, outcome, np.inf, np.inf, "none", str(reason), 0)
    error, deviations = _off(estimate)
    outcome = classify(estimate.verdict.trusted, error, deviations)
    return Cell(*where, outcome, error, deviations, str(estimate.verdict), estimate.message, estimate.evaluations)


def classify(trusted: bool, error: float, deviations: float) -> Outcome:
    """The class of an answer: trusted: whether its verdict is an answer; error [rad]; deviations: in reported ones."""
    if not trusted:
        return Outcome.FAILED
    honest, right = deviations <= DEVIATIONS or error <= EXACT, error <= RIGHT
    if honest and right:
        return Outcome.HOLDS
    return Outcome.INACCURATE if honest or right else Outcome.SILENT


def worst(cells: list[Cell]) -> Cell:
    """The one whose class is worst, in the order of Outcome."""
    order = list(Outcome)
    return max(cells, key=lambda cell: order.index(Outcome(cell.outcome)))


def _off(estimate: Estimate) -> tuple[float, float]:
    """Largest error of a parameter, and the largest in units of its standard deviation."""
    errors = {name: abs(estimate.parameters[name].value - true) for name, true in estimate.truth.items()}
    scaled = [error / max(estimate.parameters[name].std, 1e-300) for name, error in errors.items()]
    return max(errors.values()), max(scaled)
