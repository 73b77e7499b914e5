"""Fault hypotheses: which of the things taken as known would explain a misfit."""

from shoal.identification.diagnostics.hypotheses import Suspect
from shoal.identification.diagnostics.suspects.search import FaultSearch, suspects

__all__ = ["FaultSearch", "Suspect", "suspects"]
