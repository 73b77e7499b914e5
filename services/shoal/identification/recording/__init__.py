"""Recordings: from a statement to samples in SI units by reading, mending and checks without a model."""
