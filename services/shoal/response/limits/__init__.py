"""Structural reliability of a machine: probability of exceeding a limit, or whether interval values can exceed it."""

from shoal.response.limits.judge import MOST, judge
from shoal.response.limits.limit import Limit, limit, read_limits, requirement
from shoal.response.limits.result import LimitResult, VerifiedRun

__all__ = ["MOST", "Limit", "LimitResult", "VerifiedRun", "judge", "limit", "read_limits", "requirement"]
