"""Machines in space drawn at random, and how often what is said of them is right."""
