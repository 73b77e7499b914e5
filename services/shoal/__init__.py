"""Shoal: simulate and identify planar rigid-flexible machines."""
