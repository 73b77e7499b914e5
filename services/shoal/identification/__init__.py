"""From measured motion to parameters with an honest uncertainty."""

from shoal.identification.estimate import Estimate
from shoal.identification.findings import Verdict
from shoal.identification.identify import identify
from shoal.identification.measure import measure
from shoal.identification.methods import METHODS
from shoal.identification.problem import Problem, load_problem, problem_names
from shoal.identification.recording.measurement import Measurement, Recording
from shoal.identification.uncertainty.intervals import Value

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
