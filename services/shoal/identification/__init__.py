"""From measured motion to parameters with an honest uncertainty."""

from shoal.identification.estimate import Estimate, Value, Verdict
from shoal.identification.identify import identify
from shoal.identification.measurement import Measurement, Recording, measure
from shoal.identification.methods import METHODS
from shoal.identification.problem import Problem, load_problem, problem_names

__all__ = [
    "METHODS",
    "Estimate",
    "Measurement",
    "Problem",
    "Recording",
    "Value",
    "Verdict",
    "identify",
    "load_problem",
    "measure",
    "problem_names",
]
