"""Analyses besides the motion: equilibrium, modes, reactions, section forces."""
