"""Scene -> Model: coordinates, frames, masses, loads, constraints."""
