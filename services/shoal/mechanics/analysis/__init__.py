"""What is asked of a machine besides its motion: equilibrium, modes, reactions, section forces."""
