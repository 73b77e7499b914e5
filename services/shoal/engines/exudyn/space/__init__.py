"""Machines in space inside Exudyn: Euler parameters, spatial ANCF cables, joints by what they lock."""
