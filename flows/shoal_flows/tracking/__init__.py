"""Logging to MLflow, one file for each kind of result."""
