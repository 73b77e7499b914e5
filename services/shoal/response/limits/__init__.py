"""Structural reliability of a machine: probability of exceeding a limit, or whether interval values can exceed it."""

from shoal.response.limits.judge import MOST, judge
from shoal.response.limits.judged import Judged, Shown
from shoal.response.limits.limit import Limit, limit, read_limits, requirement

__all__ = ["MOST", "Judged", "Limit", "Shown", "judge", "limit", "read_limits", "requirement"]
