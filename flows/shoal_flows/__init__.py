"""Prefect flows and MLflow tracking around the library: the only place that knows either."""
