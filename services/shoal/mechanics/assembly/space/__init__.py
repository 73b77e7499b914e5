"""Scene -> coordinates in space."""
