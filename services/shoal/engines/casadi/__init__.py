"""CasADi: energies written down, everything else differentiated. Its library is imported when a scene is run."""

from shoal.engines.casadi.engine import CasadiEngine

__all__ = ["CasadiEngine"]
