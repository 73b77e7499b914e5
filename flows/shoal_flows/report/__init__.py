"""The report of the demo, one HTML file that needs no network; and the identifications that MLflow keeps for others."""
