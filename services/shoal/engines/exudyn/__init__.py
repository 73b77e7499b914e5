"""Exudyn: independent elements, joints and integrators. Its library is imported when a scene is run."""

from shoal.engines.exudyn.engine import ExudynEngine

__all__ = ["ExudynEngine"]
