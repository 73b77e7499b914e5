"""Coverage of the 95 % intervals of an identification."""
