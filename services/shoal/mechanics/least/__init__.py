"""Gauss's principle of least constraint: the constraints, and the ways to the acceleration that obeys them."""
