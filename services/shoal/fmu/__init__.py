"""Scenes as units of the Functional Mock-up Interface 2.0 for co-simulation (extra `fmu`)."""
