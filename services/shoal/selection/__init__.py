"""No more model than a scene needs: the cheapest model whose estimated error meets a tolerance."""

from shoal.selection.select import Selection, select

__all__ = ["Selection", "select"]
