"""Planar machines with contacts, drawn at random, judged by a formulation that shares no code with the mechanics."""
