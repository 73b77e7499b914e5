"""Error of an adaptive integrator by its tolerance, by theory: where its steps land, round-off decides.

Near a singular position the accelerations carry round-off by `eps / d^2` (docs/method.md). A method of fixed steps
meets the same distances `d` on every processor; an adaptive one does not, and only its tolerance bounds what that does.
"""

from __future__ import annotations

from dataclasses import dataclass

from shoal_validation.problems import get_problem

STEPS_PER_RADIAN = 10.0
"""Of the fastest rate: a method of order 8 meets 1e-12 with steps of some (1e-12)^(1/8) = 0.03 rad over 1/3."""


@dataclass(frozen=True)
class Motion:
    """Motion of a problem by the reference's own equation.

    reach: largest distance of the marker that a radian moves [m]; rate: fastest rate of an angle [rad/s];
    growth: largest change of an angle at any later time over a change at the start, of an angle or of a rate in
    units of `rate`
    """

    reach: float
    rate: float
    growth: float


MOTIONS = {
    "pendulum": Motion(1.0, 4.43, 4.26),
    "double-pendulum": Motion(3.0, 7.29, 7.79),
    "four-bar-2": Motion(1.0, 6.84, 127.0),
    "four-bar-40": Motion(1.0, 6.73, 126.0),
    "parallelogram": Motion(1.0, 6.94, 71.4),
    "slider-crank": Motion(2.0, 10.6, 74.0),
    # No equation of its own: a change of the crank's rate stays, as in free turning, and counts twice.
    "squeezer": Motion(7e-3, 1140.0, 68.0),
    "spherical-pendulum": Motion(1.0, 7.07, 12.5),
    "heavy-top": Motion(1.0, 150.1, 131.0),
}


def bound(problem: str, tolerance: float) -> float:
    """Largest error [m] of a motion whose steps are each within a relative tolerance of the state.

    Every step is as wrong as it may be, all in one direction, and each error grows as one at the start would. The
    references' own errors are smaller.
    """
    motion, duration = MOTIONS[problem], float(get_problem(problem).times[-1])
    return motion.growth * STEPS_PER_RADIAN * motion.rate * duration * tolerance * motion.reach


def bounds(tolerance: float, *problems: str) -> dict[str, float]:
    """The same for several problems; for all without a name."""
    return {name: bound(name, tolerance) for name in problems or MOTIONS}
