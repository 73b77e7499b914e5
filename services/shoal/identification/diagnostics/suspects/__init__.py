"""Where a model does not fit: which of the things taken as known would explain it."""

from shoal.identification.diagnostics.suspects.search import FaultSearch, suspects
from shoal.identification.diagnostics.suspects.suspect import Suspect

__all__ = ["FaultSearch", "Suspect", "suspects"]
