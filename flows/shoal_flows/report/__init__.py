"""The report of the demo: one HTML file that needs no network."""
