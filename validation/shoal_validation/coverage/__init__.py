"""How often the 95 % intervals of an identification contain the truth."""
