"""Studies of machines in space."""
