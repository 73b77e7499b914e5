"""Uncertainty of an answer: derivatives, covariance, intervals, profiles, and the model's own error."""
