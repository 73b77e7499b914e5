"""Ablation of the improved fish swarm: every part on and off, with and without the others."""
