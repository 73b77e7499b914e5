"""Planar machines with signals, states and controllers, drawn at random, judged by Lagrange's equations."""
