"""Which part of the improved fish swarm earns its cost: every part on and off, with and without the others."""
