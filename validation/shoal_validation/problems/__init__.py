"""The problem library: scenes with references that are not ours. One list; a new problem is one line."""

from __future__ import annotations

import numpy as np
from shoal.errors import InputError

from shoal_validation.problems import double_pendulum, in_space, one_angle, published
from shoal_validation.problems.continuum import stored
from shoal_validation.problems.contract import Problem, Reference

_HALF_SECOND = np.linspace(0.01, 0.5, 50)

PROBLEMS = {
    problem.name: problem
    for problem in (
        Problem(
            "pendulum",
            "a mass point on 1 m, released horizontally",
            "single-pendulum",
            "A",
            np.linspace(0.1, 5.0, 50),
            one_angle.pendulum,
        ),
        Problem(
            "double-pendulum",
            "two uniform rigid rods released from rest",
            "rigid-double-pendulum",
            "B",
            np.linspace(0.04, 2.0, 50),
            double_pendulum.settle,
        ),
        Problem(
            "four-bar-2",
            "four-bar linkage of two loops, singular twice a turn",
            "n-four-bar-2",
            "B0",
            np.linspace(0.2, 10.0, 50),
            one_angle.four_bar(2),
        ),
        Problem(
            "four-bar-40",
            "four-bar linkage of forty loops, singular twice a turn",
            "n-four-bar-40",
            "B0",
            np.linspace(0.2, 10.0, 50),
            one_angle.four_bar(40),
        ),
        Problem(
            "parallelogram",
            "unequal cranks, 1 and 3 kg, through the flat position",
            "parallelogram",
            "A",
            np.linspace(0.1, 5.0, 50),
            one_angle.parallelogram(np.pi / 2, -1.0),
        ),
        Problem(
            "slider-crank",
            "equal rods, whose slider passes the crank's bearing",
            "equal-slider-crank",
            "B",
            np.linspace(0.1, 5.0, 50),
            one_angle.slider_crank(np.pi / 4, 6.0),
        ),
        Problem(
            "squeezer",
            "Andrews' squeezing mechanism, seven bodies in three loops",
            "andrews-squeezer",
            "K1",
            np.array([0.03]),
            published.squeezer,
        ),
        Problem(
            "flexible-case-1",
            "flexible double pendulum of the paper, case 1",
            "flexible-double-pendulum",
            "B",
            _HALF_SECOND,
            stored("flexible-case-1"),
            flexible=True,
        ),
        Problem(
            "flexible-case-2",
            "flexible double pendulum of the paper, case 2",
            "flexible-double-pendulum-case-2",
            "B",
            _HALF_SECOND,
            stored("flexible-case-2"),
            flexible=True,
        ),
        Problem(
            "flexible-hanging",
            "flexible double pendulum, hanging variant of case 1",
            "flexible-double-pendulum-hanging",
            "B",
            _HALF_SECOND,
            stored("flexible-hanging"),
            flexible=True,
        ),
        Problem(
            "spherical-pendulum",
            "a mass point on 1 m that goes round in space",
            "spherical-pendulum",
            "A",
            np.linspace(0.1, 5.0, 50),
            in_space.spherical_pendulum,
        ),
        Problem(
            "heavy-top",
            "the heavy top of the literature, 15 kg that turn at 150 rad/s",
            "heavy-top",
            "C",
            np.linspace(0.04, 2.0, 50),
            in_space.heavy_top,
        ),
        Problem(
            "bricard",
            "Bricard's mechanism, a loop of six bars whose joints leave no freedom by count",
            "bricard",
            "P3",
            np.array([1.0]),
            in_space.bricard,
        ),
        Problem(
            "governor",
            "a flyball governor whose couplers are stiff spring-dampers",
            "flyball-governor",
            "s",
            np.array([1.0, 10.0]),
            in_space.governor,
        ),
        Problem(
            "flexible-spherical",
            "two flexible rods on spherical joints, in space",
            "flexible-spherical-double-pendulum",
            "B",
            _HALF_SECOND,
            stored("flexible-spherical"),
            flexible=True,
        ),
        Problem(
            "swinging-strip",
            "a curved and twisted strip of rubber, clamped, that bends about both axes and twists",
            "swinging-strip",
            "E",
            _HALF_SECOND,
            stored("swinging-strip"),
            flexible=True,
        ),
    )
}


def get_problem(name: str) -> Problem:
    """The problem of that name. Raises InputError."""
    if name not in PROBLEMS:
        raise InputError(f"problem: no problem {name!r}; there are {', '.join(PROBLEMS)}")
    return PROBLEMS[name]


__all__ = ["PROBLEMS", "Problem", "Reference", "get_problem"]
