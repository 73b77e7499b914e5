"""What is logged to MLflow, one file for each kind of result."""
