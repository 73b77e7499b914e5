"""Open trees of rigid bodies in space, in recursive relative coordinates, at linear cost in the number of bodies."""

from shoal.engines.tree.engine import TreeEngine

__all__ = ["TreeEngine"]
