"""Where a model does not fit: which of the things taken as known would explain it."""

from shoal.identification.judge.suspects.search import Findings, suspects
from shoal.identification.judge.suspects.suspect import Suspect

__all__ = ["Findings", "Suspect", "suspects"]
